/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A shape put into the pose plane [SEQ, section 6: direct manipulation]. It joins the fitted frames, pinned, with a
 * site of its own; what it has outside of the space of the components becomes a component more. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sequence/shape_signal.h"

/* A remainder of this share of the frames' variation is rounding and no new direction. */
static double const SMALLEST_REMAINDER = 1e-12;

/** `from` with one row more and, where the row is not in its space, a component more. */
static exm_status append_row(const pca *from, const float *row, arena *owner, pca *to)
{
  size_t const n = from->row_count, m = from->component_count, d = from->dimension;
  arena scratch = {0};
  double *shape = ARENA_NEW(&scratch, double, d);
  double *x = ARENA_NEW(&scratch, double, m + 1);
  exm_status status = shape && x ? EXM_OK : status_no_memory("the shape signal");
  *to = *from;
  if (status >= 0) {
    double const squared = pca_project(from, row, x), length = sqrt(squared);
    size_t const more = squared > SMALLEST_REMAINDER * from->total, wide = m + more;
    to->row_count = n + 1;
    to->component_count = wide;
    to->mean = ARENA_NEW(owner, float, d);
    to->basis = ARENA_NEW(owner, float, wide *d);
    to->coordinates = ARENA_NEW(owner, double, (n + 1) * wide);
    status = to->mean && to->basis && to->coordinates ? EXM_OK : status_no_memory("the shape signal");
    if (status >= 0) {
      memcpy(to->mean, from->mean, d * sizeof(float));
      memcpy(to->basis, from->basis, m * d * sizeof(float));
      pca_combine(from, x, shape);
      for (size_t i = 0; more && i < d; i++) {
        to->basis[m * d + i] = (float)(((double)row[i] - shape[i]) / length);
      }
      x[m] = more ? length : 0;
      for (size_t i = 0; i < n; i++) {
        memcpy(to->coordinates + i * wide, from->coordinates + i * m, m * sizeof(double));
      }
      memcpy(to->coordinates + n * wide, x, wide * sizeof(double));
    }
  }
  arena_release(&scratch);
  return status;
}

/** The pose signal with a pose more, the last of the rows. */
static exm_status refit_plate(const signals *fitted, const double point[2], window *w, const window *old)
{
  size_t const n = old->fitted_count + 1, m = fitted->shape.component_count;
  arena scratch = {0};
  double *weights = ARENA_NEW(&scratch, double, n);
  w->fitted_count = n;
  w->positions = arena_array(&w->memory, n, sizeof *w->positions);
  w->pinned = ARENA_NEW(&w->memory, uint8_t, n);
  w->sites = ARENA_NEW(&w->memory, uint32_t, n);
  exm_status status = weights && w->positions && w->pinned && w->sites ? EXM_OK : status_no_memory("the pose signal");
  if (status >= 0) {
    memcpy(w->positions, old->positions, (n - 1) * sizeof *w->positions);
    memcpy(w->positions[n - 1], point, sizeof *w->positions);
    memcpy(w->pinned, old->pinned, n - 1);
    w->pinned[n - 1] = 1;
    for (size_t i = 0; i < n; i++) {
      weights[i] = i < old->timed_count ? 1 : ADDED_POSE_WEIGHT;
    }
    thin_plate_request const request = {.point_count = n,
                                        .value_count = m,
                                        .points = (const double(*)[2])w->positions,
                                        .values = fitted->shape.coordinates,
                                        .weights = weights,
                                        .site_count = old->plate.site_count + 1,
                                        .order = w->sites};
    status = thin_plate_fit(&w->memory, &request, NULL, &w->plate, NULL);
  }
  arena_release(&scratch);
  return status;
}

static exm_status build(exm_sequence *sequence, const float *positions, const double point[2], signals *fresh)
{
  const signals *old = sequence->fitted;
  arena scratch = {0};
  const float *const *row = NULL;
  shape_map identity = {.from = old->shape.component_count};
  exm_status status = rows_encode(&scratch, &sequence->space, 1, &positions, NULL, &row);
  if (status >= 0) {
    status = append_row(&old->shape, row[0], &fresh->memory, &fresh->shape);
  }
  if (status >= 0) {
    identity.to = fresh->shape.component_count;
    identity.linear = ARENA_NEW(&scratch, double, identity.to *identity.from);
    identity.constant = ARENA_NEW(&scratch, double, identity.to);
    status = identity.linear && identity.constant ? EXM_OK : status_no_memory("the shape signal");
  }
  for (size_t i = 0; i < identity.from && status >= 0; i++) {
    identity.linear[i * identity.from + i] = 1;
  }
  if (status >= 0 && (status = signals_map(old, &identity, fresh)) >= 0) {
    window *w = &fresh->windows[0];
    arena_release(&w->memory);
    status = refit_plate(fresh, point, w, &old->windows[0]);
  }
  arena_release(&scratch);
  return status;
}

exm_status sequence_add_pose(exm_sequence *sequence, const float *positions, const double point[2])
{
  const window *old = &sequence->fitted->windows[0];
  for (size_t i = 0; i < old->fitted_count; i++) {
    if (old->positions[i][0] == point[0] && old->positions[i][1] == point[1]) {
      return status_set(EXM_ERROR_ARGUMENT, "point: pose %zu is there already", i);
    }
  }
  signals *fresh = calloc(1, sizeof *fresh);
  exm_status status = fresh ? build(sequence, positions, point, fresh) : status_no_memory("the sequence");
  if (status >= 0) {
    fresh->diagonal = sequence->fitted->diagonal;
    fresh->unit = sequence->fitted->unit;
    status = sequence_adopt(sequence, fresh);
  }
  if (status < 0) {
    signals_release(fresh);
  }
  return status;
}
