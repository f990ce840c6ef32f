/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/vertices.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "linalg/sparse.h"

/** A constraint binds the vertex that moves it most; below this nothing moves it. */
static double const SMALLEST_PIVOT = 1e-9;

static exm_status cannot_be_held(size_t handle)
{
  return status_set_at(EXM_ERROR_NUMERIC, EXM_ELEMENT_HANDLE, handle,
                       "handle %zu cannot be held: its constraint follows from those of other handles", handle);
}

/** Gauss-Jordan with column pivoting of the constraints A [bound][V]: the identity on bound vertices. */
static exm_status bind_vertices(const constraints *c, vertex_space *s, double *A)
{
  size_t const rows = s->bound_count, V = s->vertex_count;
  for (size_t i = 0; i < rows; i++) {
    s->to_bound[i * rows + i] = 1;
    for (size_t t = 0; t < c->rows[i].term_count; t++) {
      A[i * V + c->rows[i].vertices[t]] = c->rows[i].weights[t];
    }
  }
  for (size_t i = 0; i < rows; i++) {
    double *row = A + i * V;
    size_t pivot = 0;
    for (size_t v = 1; v < V; v++) {
      pivot = fabs(row[v]) > fabs(row[pivot]) ? v : pivot;
    }
    if (fabs(row[pivot]) < SMALLEST_PIVOT) {
      return cannot_be_held(c->rows[i].handle);
    }
    s->bound[i] = pivot;
    double const scale = 1 / row[pivot];
    for (size_t v = 0; v < V; v++) {
      row[v] *= scale;
    }
    for (size_t j = 0; j < rows; j++) {
      s->to_bound[i * rows + j] *= scale;
    }
    for (size_t k = 0; k < rows; k++) {
      double const factor = A[k * V + pivot];
      if (k != i && factor != 0) {
        dense_axpy(V, -factor, row, A + k * V);
        dense_axpy(rows, -factor, s->to_bound + i * rows, s->to_bound + k * rows);
        A[k * V + pivot] = 0;
      }
    }
  }
  return EXM_OK;
}

/** What is left of A on the kept vertices, as sparse rows. place [V]: of a vertex among the kept, or UINT32_MAX. */
static exm_status keep_rest(arena *owner, const double *A, vertex_space *s, uint32_t *place)
{
  size_t const rows = s->bound_count, V = s->vertex_count;
  size_t count = 0, next = 0;
  memset(place, 0, V * sizeof *place);
  for (size_t i = 0; i < rows; i++) {
    place[s->bound[i]] = UINT32_MAX;
  }
  for (size_t v = 0; v < V; v++) {
    if (place[v] != UINT32_MAX) {
      place[v] = (uint32_t)next;
      s->kept[next++] = v;
    }
  }
  for (size_t i = 0; i < rows * V; i++) {
    count += A[i] != 0;
  }
  s->rest_offsets = ARENA_NEW(owner, size_t, rows + 1);
  s->rest_columns = ARENA_NEW(owner, uint32_t, count);
  s->rest_values = ARENA_NEW(owner, double, count);
  if (!s->rest_offsets || !s->rest_columns || !s->rest_values) {
    return status_no_memory("the handle constraints");
  }
  size_t at = 0;
  for (size_t i = 0; i < rows; i++) {
    for (size_t v = 0; v < V; v++) {
      if (A[i * V + v] != 0 && place[v] != UINT32_MAX) {
        s->rest_columns[at] = place[v];
        s->rest_values[at++] = A[i * V + v];
      }
    }
    s->rest_offsets[i + 1] = at;
  }
  return EXM_OK;
}

/** A vertex as a combination of kept ones: itself, or the rest of its constraint. */
typedef struct combination {
  size_t count;
  const uint32_t *columns;
  const double *values;
  double sign;
} combination;

static combination combination_of(const vertex_space *s, const uint32_t *place, const uint32_t *row_of, size_t v)
{
  static const double one = 1;
  if (place[v] != UINT32_MAX) {
    return (combination){.count = 1, .columns = place + v, .values = &one, .sign = 1};
  }
  size_t const first = s->rest_offsets[row_of[v]];
  return (combination){.count = s->rest_offsets[row_of[v] + 1] - first,
                       .columns = s->rest_columns + first,
                       .values = s->rest_values + first,
                       .sign = -1};
}

/** Lower triangle of value left right', as triplets; NULL: just count them. */
static size_t add_entries(combination left, combination right, double value, uint32_t *rows, uint32_t *columns,
                          double *values)
{
  size_t count = 0;
  for (size_t a = 0; a < left.count; a++) {
    for (size_t b = 0; b < right.count; b++) {
      if (left.columns[a] < right.columns[b]) {
        continue;
      }
      if (rows && columns && values) {
        rows[count] = left.columns[a];
        columns[count] = right.columns[b];
        values[count] = value * left.sign * left.values[a] * right.sign * right.values[b];
      }
      count++;
    }
  }
  return count;
}

/** Triplets of N'LN, or how many there are where rows is NULL. L is whole: every entry off the diagonal of the product
 * is found together with its mirror image, and half of them is written. */
static size_t reduced_entries(const vertex_space *s, const sparse *laplacian, const uint32_t *place,
                              const uint32_t *row_of, uint32_t *rows, uint32_t *columns, double *values)
{
  size_t count = 0;
  for (size_t j = 0; j < s->vertex_count; j++) {
    combination const right = combination_of(s, place, row_of, j);
    for (int32_t e = laplacian->starts[j]; e < laplacian->starts[j + 1]; e++) {
      combination const left = combination_of(s, place, row_of, (size_t)laplacian->rows[e]);
      count += add_entries(left, right, laplacian->values[e], rows ? rows + count : NULL,
                           columns ? columns + count : NULL, values ? values + count : NULL);
    }
  }
  return count;
}

static exm_status factor_energy(const mesh *reference, const uint32_t *place, vertex_space *s, sparse *laplacian,
                                arena *scratch)
{
  sparse lower, reduced;
  uint32_t *row_of = ARENA_NEW(scratch, uint32_t, s->vertex_count);
  if (!row_of) {
    return status_no_memory("the mesh's energy");
  }
  for (size_t i = 0; i < s->bound_count; i++) {
    row_of[s->bound[i]] = (uint32_t)i;
  }
  TRY(sparse_laplacian(scratch, reference->vertex_count, reference->triangle_count,
                       (const uint32_t(*)[3])reference->triangles, (const double(*)[3])reference->cotangents, &lower));
  TRY(sparse_whole(scratch, &lower, laplacian));
  size_t const count = reduced_entries(s, laplacian, place, row_of, NULL, NULL, NULL);
  uint32_t *rows = ARENA_NEW(scratch, uint32_t, count), *columns = ARENA_NEW(scratch, uint32_t, count);
  double *values = ARENA_NEW(scratch, double, count);
  if (!rows || !columns || !values) {
    return status_no_memory("the mesh's energy");
  }
  reduced_entries(s, laplacian, place, row_of, rows, columns, values);
  TRY(sparse_from_triplets(scratch, s->kept_count, count, rows, columns, values, &reduced));
  return cholesky_create(&reduced, &s->root);
}

/** Y: bound vertices as c puts them, the others where the energy is least. */
static exm_status find_held(arena *owner, arena *scratch, const sparse *laplacian, vertex_space *s)
{
  size_t const bound = s->bound_count, V = s->vertex_count;
  double *forces = ARENA_NEW(scratch, double, V *bound);
  double *u = ARENA_NEW(scratch, double, s->kept_count *bound);
  s->held = ARENA_NEW(owner, double, V *bound);
  if (!forces || !u || !s->held) {
    return status_no_memory("the mesh's energy");
  }
  for (size_t i = 0; i < bound; i++) {
    for (int32_t e = laplacian->starts[s->bound[i]]; e < laplacian->starts[s->bound[i] + 1]; e++) {
      dense_axpy(bound, -laplacian->values[e], s->to_bound + i * bound, forces + (size_t)laplacian->rows[e] * bound);
    }
  }
  vertices_to_basis(s, bound, forces, u);
  vertices_from_basis(s, bound, u, s->held);
  for (size_t i = 0; i < bound; i++) {
    dense_axpy(bound, 1, s->to_bound + i * bound, s->held + s->bound[i] * bound);
  }
  return EXM_OK;
}

exm_status vertices_create(arena *owner, const mesh *reference, const constraints *c, vertex_space *out)
{
  size_t const V = reference->vertex_count, bound = c->row_count;
  *out = (vertex_space){.vertex_count = V, .bound_count = bound};
  if (bound > V) {
    return cannot_be_held(c->rows[V].handle);
  }
  arena scratch = {0};
  sparse laplacian;
  out->kept_count = V - bound;
  out->kept = ARENA_NEW(owner, size_t, out->kept_count);
  out->bound = ARENA_NEW(owner, size_t, bound);
  out->to_bound = ARENA_NEW(owner, double, bound *bound);
  double *A = ARENA_NEW(&scratch, double, bound *V);
  uint32_t *place = ARENA_NEW(&scratch, uint32_t, V);
  exm_status status =
      out->kept && out->bound && out->to_bound && A && place ? EXM_OK : status_no_memory("the handle constraints");
  if (status < 0 || (status = bind_vertices(c, out, A)) < 0 || (status = keep_rest(owner, A, out, place)) < 0 ||
      (status = factor_energy(reference, place, out, &laplacian, &scratch)) < 0 ||
      (status = find_held(owner, &scratch, &laplacian, out)) < 0) {
    vertices_destroy(out);
  }
  arena_release(&scratch);
  return status;
}

void vertices_destroy(vertex_space *s)
{
  cholesky_destroy(s->root);
  s->root = NULL;
}

void vertices_to_basis(const vertex_space *s, size_t width, const double *forces, double *u)
{
  for (size_t i = 0; i < s->kept_count; i++) {
    memcpy(u + i * width, forces + s->kept[i] * width, width * sizeof(double));
  }
  for (size_t i = 0; i < s->bound_count; i++) {
    for (size_t e = s->rest_offsets[i]; e < s->rest_offsets[i + 1]; e++) {
      dense_axpy(width, -s->rest_values[e], forces + s->bound[i] * width, u + s->rest_columns[e] * width);
    }
  }
  cholesky_solve_root_rows(s->root, width, u);
}

void vertices_from_basis(const vertex_space *s, size_t width, double *u, double *points)
{
  cholesky_solve_root_transposed_rows(s->root, width, u);
  for (size_t i = 0; i < s->kept_count; i++) {
    memcpy(points + s->kept[i] * width, u + i * width, width * sizeof(double));
  }
  for (size_t i = 0; i < s->bound_count; i++) {
    double *point = points + s->bound[i] * width;
    memset(point, 0, width * sizeof(double));
    for (size_t e = s->rest_offsets[i]; e < s->rest_offsets[i + 1]; e++) {
      dense_axpy(width, -s->rest_values[e], u + s->rest_columns[e] * width, point);
    }
  }
}

void vertices_hold(const vertex_space *s, size_t d, const double *c, double *points)
{
  enum { BATCH = 64 };
  double some[BATCH * 3];
  for (size_t v = 0; v < s->vertex_count; v += BATCH) {
    size_t const count = s->vertex_count - v < BATCH ? s->vertex_count - v : BATCH;
    dense_times(count, s->bound_count, d, s->held + v * s->bound_count, c, some);
    dense_axpy(count * d, 1, some, points + v * d);
  }
}
