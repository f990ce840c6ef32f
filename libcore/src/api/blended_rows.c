/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Constraints of a Blended deformer that come and go. */
#include <math.h>

#include "api/checks.h"
#include "api/structs.h"
#include "deform/blended/deformer.h"

static blended_deformer *blended_of(exm_deformer *deformer)
{
  return (blended_deformer *)deformer;
}

static size_t added_rows(const blended_deformer *deformer)
{
  return deformer->solver.held.row_count - deformer->solver.held.handle_row_count;
}

static exm_status check_weight(const char *what, size_t index, double weight)
{
  if (!(weight >= 0) || !isfinite(weight)) {
    return status_set(EXM_ERROR_ARGUMENT, "weight of %s %zu is %g, not 0 or more", what, index, weight);
  }
  return EXM_OK;
}

static exm_status check_terms(const exm_rows *rows, size_t row, size_t vertex_count)
{
  for (size_t i = rows->offsets[row]; i < rows->offsets[row + 1]; i++) {
    if (rows->vertices[i] >= vertex_count) {
      return status_set(EXM_ERROR_ARGUMENT, "row %zu holds vertex %u, but there are %zu vertices", row,
                        rows->vertices[i], vertex_count);
    }
    if (!isfinite(rows->coefficients[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "row %zu: the coefficient of vertex %u is not finite", row,
                        rows->vertices[i]);
    }
  }
  return rows->weights ? check_weight("row", row, rows->weights[row]) : EXM_OK;
}

static exm_status check_rows(const exm_rows *rows, size_t vertex_count)
{
  TRY(check_pointer(rows, "rows"));
  if (rows->count == 0) {
    return EXM_OK;
  }
  TRY(check_pointer(rows->offsets, "rows->offsets"));
  TRY(check_pointer(rows->vertices, "rows->vertices"));
  TRY(check_pointer(rows->coefficients, "rows->coefficients"));
  if (rows->offsets[0] != 0) {
    return status_set(EXM_ERROR_ARGUMENT, "rows->offsets begins with %zu, not with 0", rows->offsets[0]);
  }
  for (size_t r = 0; r < rows->count; r++) {
    if (rows->offsets[r + 1] <= rows->offsets[r]) {
      return status_set(EXM_ERROR_ARGUMENT, "row %zu has no terms", r);
    }
    TRY(check_terms(rows, r, vertex_count));
  }
  return EXM_OK;
}

exm_status exm_blended_add_rows(exm_deformer *deformer, const exm_rows *rows)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_rows(rows, deformer->info.vertex_count));
  return rows->count > 0 ? blended_deformer_add_rows(blended_of(deformer), rows) : EXM_OK;
}

static exm_status check_range(const blended_deformer *deformer, size_t first, size_t count)
{
  size_t const rows = added_rows(deformer);
  if (first > rows || count > rows - first) {
    return status_set(EXM_ERROR_ARGUMENT, "rows %zu to %zu are asked for, but there are %zu", first, first + count,
                      rows);
  }
  return EXM_OK;
}

exm_status exm_blended_remove_rows(exm_deformer *deformer, size_t first, size_t count)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_range(blended_of(deformer), first, count));
  return count > 0 ? blended_constraints_remove(&blended_of(deformer)->solver, first, count) : EXM_OK;
}

exm_status exm_blended_weigh_rows(exm_deformer *deformer, size_t first, size_t count, const double *weights)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(weights, "weights"));
  TRY(check_range(blended_of(deformer), first, count));
  for (size_t i = 0; i < count; i++) {
    TRY(check_weight("row", first + i, weights[i]));
  }
  return blended_deformer_weigh_rows(blended_of(deformer), first, count, weights);
}

exm_status exm_blended_weigh_handles(exm_deformer *deformer, const double *weights)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  for (size_t h = 0; weights && h < deformer->info.handle_count; h++) {
    TRY(check_weight("handle", h, weights[h]));
  }
  return blended_deformer_weigh_handles(blended_of(deformer), weights);
}
