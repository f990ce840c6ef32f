/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/shape_space.h"

exm_status shape_space_create(int32_t kind, const mesh *reference, shape_space *out)
{
  shape_space space = {.reference = reference, .dimension = 3 * reference->vertex_count, .unit = 1};
  if (kind != EXM_SHAPE_POSITIONS) {
    return status_set(EXM_ERROR_ARGUMENT, "shape_space is %d, not one of exm_shape_space", kind);
  }
  *out = space;
  return EXM_OK;
}

void shape_space_release(shape_space *space)
{
  if (space->methods && space->methods->release) {
    space->methods->release(space);
  }
  arena_release(&space->memory);
}
