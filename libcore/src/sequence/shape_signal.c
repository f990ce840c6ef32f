/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/shape_signal.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Directions in which examples differ by less than this share of the largest difference say nothing: a least-squares
 * solution would divide by them. */
static double const SMALLEST_DIFFERENCE = 1e-5;

/* ------------------------------------------------------------------------------------------------------------- fit */

/** Components from examples, coordinates from frames. */
static exm_status span_examples(arena *owner, arena *scratch, const shape_request *request, const progress *report,
                                const float *const *rows, pca *out)
{
  const float *const *poses = NULL, *const *examples = NULL;
  size_t const n = request->frame_count, V = request->space->reference->vertex_count;
  TRY(rows_of_array(scratch, request->example_count, V, request->examples, &poses));
  TRY(rows_encode(scratch, request->space, request->example_count, poses, NULL, &examples));
  TRY(pca_fit(owner, request->example_count, request->space->dimension, examples, request->example_count - 1, 0, report,
              out));
  out->row_count = n;
  out->total = out->rest = 0;
  out->coordinates = ARENA_NEW(owner, double, n * out->component_count);
  if (!out->coordinates) {
    return status_no_memory("the shape signal");
  }
  for (size_t i = 0; i < n; i++) {
    double *x = out->coordinates + i * out->component_count;
    out->rest += pca_project(out, rows[i], x);
    out->total += dense_dot(out->component_count, x, x);
  }
  out->total += out->rest;
  return EXM_OK;
}

exm_status shape_signal_fit(arena *owner, const shape_request *request, const progress *report, pca *out)
{
  arena scratch = {0};
  const float *const *rows = NULL;
  progress const measuring = progress_part(report, 0, request->space->methods ? 0.3 : 0);
  progress const finding = progress_part(report, request->space->methods ? 0.3 : 0, 1);
  exm_status status = rows_encode(&scratch, request->space, request->frame_count, request->frames, &measuring, &rows);
  if (status >= 0 && request->examples) {
    status = span_examples(owner, &scratch, request, &finding, rows, out);
  } else if (status >= 0) {
    status = pca_fit(owner, request->frame_count, request->space->dimension, rows, request->component_count,
                     request->limit, &finding, out);
  }
  arena_release(&scratch);
  return status;
}

/* -------------------------------------------------------------------------------------------------------- transfer */

/** Examples as their own signal: every component, and the coordinates [count][m] of the examples. */
static exm_status span(arena *owner, arena *scratch, shape_space *space, const float *examples, size_t count, pca *out)
{
  const float *const *poses = NULL, *const *rows = NULL;
  TRY(rows_of_array(scratch, count, space->reference->vertex_count, examples, &poses));
  TRY(rows_encode(scratch, space, count, poses, NULL, &rows));
  TRY(pca_fit(owner, count, space->dimension, rows, count - 1, 0, NULL, out));
  if (out->component_count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "the examples all have one and the same shape");
  }
  return EXM_OK;
}

/** Differences of coordinates to those of example 0: [count - 1][m]. */
static double *differences(arena *scratch, const pca *examples)
{
  size_t const m = examples->component_count, count = examples->row_count - 1;
  double *made = ARENA_NEW(scratch, double, count *m);
  for (size_t i = 0; made && i < count * m; i++) {
    made[i] = examples->coordinates[m + i] - examples->coordinates[i % m];
  }
  return made;
}

/**
 * X [count][columns] of least length with D' X = Y in the least-squares sense, for D [count][m], Y [m][columns]:
 * X = (D D')^+ D Y.
 */
static exm_status solve_least(arena *scratch, size_t count, size_t m, size_t columns, const double *D, const double *Y,
                              double *X)
{
  double *gram = ARENA_NEW(scratch, double, count *count);
  double *values = ARENA_NEW(scratch, double, count);
  double *right = ARENA_NEW(scratch, double, count *columns);
  double *turned = ARENA_NEW(scratch, double, count *columns);
  if (!gram || !values || !right || !turned) {
    return status_no_memory("the examples");
  }
  dense_multiply(0, 1, count, count, m, 1, D, D, 0, gram);
  TRY(dense_eigen(count, gram, values));
  dense_multiply(0, 0, count, columns, m, 1, D, Y, 0, right);
  dense_multiply(0, 0, count, columns, count, 1, gram, right, 0, turned);
  for (size_t i = 0; i < count; i++) {
    double const smallest = SMALLEST_DIFFERENCE * SMALLEST_DIFFERENCE * values[count - 1];
    double const inverse = values[i] > smallest ? 1 / values[i] : 0;
    for (size_t k = 0; k < columns; k++) {
      turned[i * columns + k] *= inverse;
    }
  }
  dense_multiply(1, 0, count, columns, count, 1, gram, turned, 0, X);
  return EXM_OK;
}

/** Y [m'][m + 1]: the source's components, and its mean less q_0, in the coordinates of its examples. */
static exm_status project_source(arena *scratch, const pca *source, const pca *examples, double **out)
{
  size_t const m = source->component_count, rows = examples->component_count, columns = m + 1;
  double *Y = ARENA_NEW(scratch, double, rows *columns);
  double *coordinates = ARENA_NEW(scratch, double, rows);
  if (!Y || !coordinates) {
    return status_no_memory("the examples");
  }
  for (size_t i = 0; i < rows; i++) {
    for (size_t k = 0; k < m; k++) {
      double sum = 0;
      const float *a = examples->basis + i * source->dimension, *b = source->basis + k * source->dimension;
      for (size_t j = 0; j < source->dimension; j++) {
        sum += (double)a[j] * (double)b[j];
      }
      Y[i * columns + k] = sum;
    }
  }
  (void)pca_project(examples, source->mean, coordinates);
  for (size_t i = 0; i < rows; i++) {
    Y[i * columns + m] = coordinates[i] - examples->coordinates[i];
  }
  *out = Y;
  return EXM_OK;
}

static exm_status find_map(arena *owner, arena *scratch, const pca *source, const pca *from, const pca *to,
                           shape_map *map)
{
  size_t const m = source->component_count, count = from->row_count - 1, columns = m + 1;
  double *D = differences(scratch, from), *E = differences(scratch, to), *Y = NULL;
  double *X = ARENA_NEW(scratch, double, count *columns);
  *map = (shape_map){.from = m, .to = to->component_count};
  double *whole = ARENA_NEW(scratch, double, map->to *columns);
  map->linear = ARENA_NEW(owner, double, map->to *m);
  map->constant = ARENA_NEW(owner, double, map->to);
  if (!D || !E || !X || !whole || !map->linear || !map->constant) {
    return status_no_memory("the examples");
  }
  TRY(project_source(scratch, source, from, &Y));
  TRY(solve_least(scratch, count, from->component_count, columns, D, Y, X));
  dense_multiply(1, 0, map->to, columns, count, 1, E, X, 0, whole);
  for (size_t i = 0; i < map->to; i++) {
    memcpy(map->linear + i * m, whole + i * columns, m * sizeof(double));
    map->constant[i] = whole[i * columns + m] + to->coordinates[i];
  }
  return EXM_OK;
}

exm_status shape_signal_transfer(arena *owner, const pca *source, shape_space *source_space,
                                 const float *source_examples, shape_space *target_space, const float *target_examples,
                                 size_t count, pca *target, shape_map *map)
{
  arena scratch = {0};
  pca from;
  exm_status status = span(&scratch, &scratch, source_space, source_examples, count, &from);
  if (status >= 0 && (status = span(owner, &scratch, target_space, target_examples, count, target)) >= 0) {
    status = find_map(owner, &scratch, source, &from, target, map);
  }
  if (status >= 0) { /* the frames, in the place of the examples */
    double *coordinates = ARENA_NEW(owner, double, source->row_count * map->to);
    status = coordinates ? EXM_OK : status_no_memory("the shape signal");
    target->rest = target->total = 0;
    for (size_t i = 0; i < source->row_count && coordinates; i++) {
      double *x = coordinates + i * map->to;
      dense_times(map->to, map->from, 1, map->linear, source->coordinates + i * map->from, x);
      dense_axpy(map->to, 1, map->constant, x);
      target->total += dense_dot(map->to, x, x);
    }
    target->row_count = source->row_count;
    target->coordinates = coordinates;
  }
  arena_release(&scratch);
  return status;
}
