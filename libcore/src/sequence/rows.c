/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/rows.h"

static exm_status encode_one(shape_space *space, const float *frame, const double *before, double *coordinates,
                             float *row)
{
  TRY(space->methods->encode(space, frame, before, coordinates));
  for (size_t j = 0; j < space->dimension; j++) {
    row[j] = (float)coordinates[j];
  }
  return EXM_OK;
}

static exm_status encode_all(shape_space *space, size_t count, const float *const *frames, const progress *report,
                             double *two, float **made)
{
  size_t const d = space->dimension;
  for (size_t i = 0; i < count; i++) {
    double *now = two + i % 2 * d;
    const double *before = i > 0 ? two + (i + 1) % 2 * d : NULL;
    TRY(progress_report(report, (double)i / (double)count, "measuring frames"));
    TRY(encode_one(space, frames[i], before, now, made[i]));
  }
  return EXM_OK;
}

exm_status rows_encode(arena *owner, shape_space *space, size_t count, const float *const *frames,
                       const progress *report, const float *const **rows)
{
  if (!space->methods) {
    *rows = frames;
    return EXM_OK;
  }
  arena scratch = {0};
  double *two = ARENA_NEW(&scratch, double, 2 * space->dimension);
  float **made = ARENA_NEW(owner, float *, count);
  exm_status status = two && made ? EXM_OK : status_no_memory("the frames in their shape space");
  for (size_t i = 0; i < count && status >= 0; i++) {
    made[i] = ARENA_NEW(owner, float, space->dimension);
    status = made[i] ? EXM_OK : status_no_memory("the frames in their shape space");
  }
  if (status >= 0) {
    status = encode_all(space, count, frames, report, two, made);
  }
  arena_release(&scratch);
  *rows = (const float *const *)made;
  return status;
}

exm_status rows_of_array(arena *owner, size_t count, size_t vertex_count, const float *poses,
                         const float *const **frames)
{
  const float **made = ARENA_NEW(owner, const float *, count);
  if (!made) {
    return status_no_memory("the poses");
  }
  for (size_t i = 0; i < count; i++) {
    made[i] = poses + i * vertex_count * 3;
  }
  *frames = (const float *const *)made;
  return EXM_OK;
}
