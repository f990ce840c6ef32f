/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "weights/handles.h"

#include <math.h>

/* Columns of single-precision weights from other programs sum to 1 within this. */
static double const LOOSEST_SUM = 1e-3;

static exm_status check_offsets(const exm_handles *handles)
{
  if (handles->count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "there are no handles");
  }
  if (!handles->vertex_offsets || !handles->vertices) {
    return status_set(EXM_ERROR_ARGUMENT, "handles->%s is NULL", handles->vertices ? "vertex_offsets" : "vertices");
  }
  if (handles->vertex_offsets[0] != 0) {
    return status_set(EXM_ERROR_ARGUMENT, "handles->vertex_offsets begins with %zu, not with 0",
                      handles->vertex_offsets[0]);
  }
  for (size_t h = 0; h < handles->count; h++) {
    size_t const begin = handles->vertex_offsets[h], end = handles->vertex_offsets[h + 1];
    if (end == begin) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_HANDLE, h, "handle %zu has no vertices", h);
    }
    if (end < begin) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_HANDLE, h,
                           "handle %zu: its vertex offsets, %zu and %zu, do not increase", h, begin, end);
    }
  }
  return EXM_OK;
}

/* owners [V]: 1 + the handle each vertex was seen in. */
static exm_status check_owners(const mesh *reference, const exm_handles *handles, size_t *owners)
{
  for (size_t h = 0; h < handles->count; h++) {
    for (size_t i = handles->vertex_offsets[h]; i < handles->vertex_offsets[h + 1]; i++) {
      size_t const v = handles->vertices[i];
      if (v >= reference->vertex_count) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_HANDLE, h,
                             "handle %zu holds vertex %zu, but there are %zu vertices", h, v, reference->vertex_count);
      }
      if (owners[v] == h + 1) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, v, "vertex %zu is twice in handle %zu", v, h);
      }
      if (owners[v] != 0) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, v, "vertex %zu belongs to handles %zu and %zu", v,
                             owners[v] - 1, h);
      }
      owners[v] = h + 1;
    }
  }
  return EXM_OK;
}

exm_status handles_check_vertices(const mesh *reference, const exm_handles *handles)
{
  TRY(check_offsets(handles));
  /* Offsets that increase one by one and exceed this repeat a vertex or leave the mesh: report that, and do not walk an
   * array that cannot be as long as they say. */
  size_t const held = handles->vertex_offsets[handles->count];
  if (held > reference->vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "the handles hold %zu vertices, but there are %zu", held,
                      reference->vertex_count);
  }
  arena scratch = {0};
  size_t *owners = ARENA_NEW(&scratch, size_t, reference->vertex_count);
  exm_status const status = owners ? check_owners(reference, handles, owners) : status_no_memory("the handles");
  arena_release(&scratch);
  return status;
}

exm_status handles_check(const mesh *reference, const exm_handles *handles)
{
  TRY(handles_check_vertices(reference, handles));
  if (!handles->kinds) {
    return status_set(EXM_ERROR_ARGUMENT, "handles->kinds is NULL");
  }
  for (size_t h = 0; h < handles->count; h++) {
    int32_t const kind = handles->kinds[h];
    if (kind != EXM_HANDLE_PINNED && kind != EXM_HANDLE_ORIENTED && kind != EXM_HANDLE_FREE) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_HANDLE, h, "handle %zu: there is no kind %d", h, (int)kind);
    }
  }
  return EXM_OK;
}

exm_status handles_check_coverage(const mesh *reference, const exm_handles *handles)
{
  size_t const parts = reference->report.component_count;
  arena scratch = {0};
  unsigned char *is_covered = ARENA_NEW(&scratch, unsigned char, parts);
  if (!is_covered) {
    return status_no_memory("the handles");
  }
  for (size_t i = 0; i < handles->vertex_offsets[handles->count]; i++) {
    is_covered[reference->components[handles->vertices[i]]] = 1;
  }
  size_t bare = 0, first = 0;
  for (size_t p = 0; p < parts; p++) {
    bare += !is_covered[p];
  }
  while (bare > 0 && is_covered[reference->components[first]]) {
    first++;
  }
  arena_release(&scratch);
  if (bare > 0) {
    return status_set_at(EXM_ERROR_UNCONSTRAINED, EXM_ELEMENT_VERTEX, first,
                         "%zu of %zu connected parts have no handle, that of vertex %zu for one", bare, parts, first);
  }
  return EXM_OK;
}

/* A row is what one handle does; a column is what one vertex gets. */
static exm_status check_column(const exm_handles *handles, size_t vertex_count, size_t vertex, const float *weights)
{
  double sum = 0;
  for (size_t h = 0; h < handles->count; h++) {
    double const w = (double)weights[h * vertex_count + vertex];
    if (!isfinite(w) || w < 0) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, vertex, "weight of vertex %zu for handle %zu: %g",
                           vertex, h, w);
    }
    sum += w;
  }
  if (fabs(sum - 1) > LOOSEST_SUM) {
    return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, vertex,
                         "the weights of vertex %zu sum to %g instead of 1", vertex, sum);
  }
  return EXM_OK;
}

exm_status handles_check_weights(const mesh *reference, const exm_handles *handles, const float *weights)
{
  size_t const count = reference->vertex_count;
  for (size_t v = 0; v < count; v++) {
    TRY(check_column(handles, count, v, weights));
  }
  for (size_t h = 0; h < handles->count; h++) {
    for (size_t i = handles->vertex_offsets[h]; i < handles->vertex_offsets[h + 1]; i++) {
      size_t const v = handles->vertices[i];
      /* Columns sum to 1 and are not negative, so that the others' are 0 where this is 1. */
      if (fabs((double)weights[h * count + v] - 1) > LOOSEST_SUM) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, v,
                             "vertex %zu is one of handle %zu's, but its weight there is %g instead of 1", v, h,
                             (double)weights[h * count + v]);
      }
    }
  }
  return EXM_OK;
}
