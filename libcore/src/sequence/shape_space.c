/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/shape_space.h"

#include "sequence/shape_spaces/spaces.h"

exm_status shape_space_create(int32_t kind, const mesh *reference, shape_space *out)
{
  shape_space space = {.reference = reference, .dimension = 3 * reference->vertex_count};
  switch (kind) {
  case EXM_SHAPE_POSITIONS:
    break;
  case EXM_SHAPE_GRADIENTS:
    space.methods = &shape_space_gradients;
    break;
  case EXM_SHAPE_LINEAR_ROTATION_INVARIANT:
    space.methods = &shape_space_linear_rotation_invariant;
    break;
  case EXM_SHAPE_LENGTHS_ANGLES:
    space.methods = &shape_space_lengths_angles;
    break;
  case EXM_SHAPE_PATCHES:
    space.methods = &shape_space_patches;
    break;
  default:
    return status_set(EXM_ERROR_ARGUMENT, "shape_space is %d, not one of exm_shape_space", kind);
  }
  exm_status const status = space.methods ? space.methods->prepare(&space) : EXM_OK;
  if (status < 0) {
    shape_space_release(&space);
    return status;
  }
  *out = space;
  return EXM_OK;
}

void shape_space_release(shape_space *space)
{
  if (space->methods) {
    space->methods->release(space);
  }
  arena_release(&space->memory);
}
