/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Products with the operators of the reduced mesh, whichever way they are stored. */
#include <string.h>

#include "base/simd.h"
#include "linalg/dense.h"
#include "subspace/reduced.h"

/** out[n][width] = A x or, from A [m][n], A' x: by our own loops for positions, by BLAS for many columns. */
static void times(size_t n, size_t m, size_t width, const double *A, const double *x, double *out)
{
  if (width <= 3) {
    dense_times(n, m, width, A, x, out);
  } else {
    dense_multiply(0, 0, n, width, m, 1, A, x, 0, out);
  }
}

static void times_transposed(size_t m, size_t n, size_t width, const double *A, const double *x, double *out)
{
  if (width <= 3) {
    dense_times_transposed(m, n, width, A, n, x, out);
  } else {
    dense_multiply(1, 0, n, width, m, 1, A, x, 0, out);
  }
}

size_t reduced_scratch(const reduced_mesh *r)
{
  size_t const pose = r->rank + r->constraint_count;
  return r->carriers ? r->rank + r->atom_count + r->rest_rows : 2 * pose;
}

/* -------------------------------------------------------------------------------------------------------- carriers */

static size_t carriers_of(const reduced_carriers *c, size_t g)
{
  return c->offsets[g + 1] - c->offsets[g];
}

void reduced_carry(const reduced_mesh *r, size_t group, size_t width, const double *x, double *out)
{
  size_t const rows = r->shape_offsets[group + 1] - r->shape_offsets[group];
  times_transposed(rows, carriers_of(r->carriers, group), width, r->carriers->shapes[group], x, out);
}

/* Groups are worked on this many carriers at a time where columns are few. */
enum { PIECE = 64, NARROW = 3 };

/** A piece of gather() for up to three columns, a column an array. */
INLINE void gather_piece(size_t rows, size_t stride, size_t some, size_t width, const double *root, const double *X,
                         const uint32_t *indices, double *out)
{
  double sum[NARROW][PIECE] = {{0}};
  for (size_t i = 0; i < rows; i++) {
    for (size_t q = 0; q < width; q++) {
      double const x = X[i * width + q];
      for (size_t k = 0; k < some; k++) {
        sum[q][k] += root[i * stride + k] * x;
      }
    }
  }
  for (size_t k = 0; k < some; k++) {
    for (size_t q = 0; q < width; q++) {
      out[indices[k] * width + q] += sum[q][k];
    }
  }
}

/** A piece of spread(), likewise. */
INLINE void spread_piece(size_t rows, size_t stride, size_t some, size_t width, const double *root,
                         const double *points, const uint32_t *indices, double *out)
{
  double from[NARROW][PIECE];
  for (size_t k = 0; k < some; k++) {
    for (size_t q = 0; q < width; q++) {
      from[q][k] = points[indices[k] * width + q];
    }
  }
  for (size_t i = 0; i < rows; i++) {
    for (size_t q = 0; q < width; q++) {
      double sum = 0;
#pragma omp simd reduction(+ : sum)
      for (size_t k = 0; k < some; k++) {
        sum += root[i * stride + k] * from[q][k];
      }
      out[i * width + q] += sum;
    }
  }
}

SIMD_CLONES static void gather_narrow(const reduced_mesh *r, size_t width, const double *X, double *out)
{
  const reduced_carriers *c = r->carriers;
  for (size_t g = 0; g < r->group_count; g++) {
    size_t const n = c->offsets[g + 1] - c->offsets[g], row = r->shape_offsets[g];
    for (size_t k = 0; k < n; k += PIECE) {
      gather_piece(r->shape_offsets[g + 1] - row, n, n - k < PIECE ? n - k : PIECE, width, c->shapes[g] + k,
                   X + row * width, c->indices + c->offsets[g] + k, out);
    }
  }
}

SIMD_CLONES static void spread_narrow(const reduced_mesh *r, size_t width, const size_t *offsets, double **roots,
                                      const double *points, double *out)
{
  const reduced_carriers *c = r->carriers;
  for (size_t g = 0; g < r->group_count; g++) {
    size_t const n = c->offsets[g + 1] - c->offsets[g];
    for (size_t k = 0; k < n; k += PIECE) {
      spread_piece(offsets[g + 1] - offsets[g], n, n - k < PIECE ? n - k : PIECE, width, roots[g] + k, points,
                   c->indices + c->offsets[g] + k, out + offsets[g] * width);
    }
  }
}

/** Forces on the carriers of proxies X, [V][width]. */
static void gather(const reduced_mesh *r, size_t width, const double *X, double *out)
{
  const reduced_carriers *c = r->carriers;
  memset(out, 0, r->atom_count * width * sizeof(double));
  if (width <= NARROW) {
    gather_narrow(r, width, X, out);
    return;
  }
  for (size_t g = 0; g < r->group_count; g++) {
    const uint32_t *indices = c->indices + c->offsets[g];
    size_t const n = carriers_of(c, g);
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      const double *row = c->shapes[g] + (i - r->shape_offsets[g]) * n;
      for (size_t k = 0; k < n; k++) {
        dense_axpy(width, row[k], X + i * width, out + indices[k] * width);
      }
    }
  }
}

static void spread(const reduced_mesh *r, size_t width, const size_t *offsets, double **rows_of, const double *points,
                   double *out)
{
  const reduced_carriers *c = r->carriers;
  memset(out, 0, offsets[r->group_count] * width * sizeof(double));
  if (width <= NARROW) {
    spread_narrow(r, width, offsets, rows_of, points, out);
    return;
  }
  for (size_t g = 0; g < r->group_count; g++) {
    const uint32_t *indices = c->indices + c->offsets[g];
    size_t const n = carriers_of(c, g);
    for (size_t i = offsets[g]; i < offsets[g + 1]; i++) {
      const double *row = rows_of[g] + (i - offsets[g]) * n;
      for (size_t k = 0; k < n; k++) {
        dense_axpy(width, row[k], points + indices[k] * width, out + i * width);
      }
    }
  }
}

void reduced_from_carriers(const reduced_mesh *r, size_t width, const double *points, double *shapes, double *rest)
{
  spread(r, width, r->shape_offsets, r->carriers->shapes, points, shapes);
  if (rest) {
    spread(r, width, r->rest_offsets, r->carriers->rest, points, rest);
  }
}

/** Positions of the pose u under c, [V][d]. scratch [rank][d]. */
static void carrier_positions(const reduced_mesh *r, const double *u, const double *c, double *scratch, double *points)
{
  memcpy(scratch, u, r->rank * r->dimension * sizeof(double));
  vertices_from_basis(&r->carriers->space, r->dimension, scratch, points);
  vertices_hold(&r->carriers->space, r->dimension, c, points);
}

/* -------------------------------------------------------------------------------------------------------- operators */

void reduced_to_basis(const reduced_mesh *r, size_t width, const double *X, double *scratch, double *u)
{
  if (!r->carriers) {
    times_transposed(r->shape_rows, r->rank, width, r->Ux, X, u);
    return;
  }
  gather(r, width, X, scratch);
  vertices_to_basis(&r->carriers->space, width, scratch, u);
}

void reduced_to_shapes(const reduced_mesh *r, size_t width, const double *u, double *scratch, double *y)
{
  if (!r->carriers) {
    times(r->shape_rows, r->rank, width, r->Ux, u, y);
    return;
  }
  double *points = scratch + r->rank * width;
  memcpy(scratch, u, r->rank * width * sizeof(double));
  vertices_from_basis(&r->carriers->space, width, scratch, points);
  spread(r, width, r->shape_offsets, r->carriers->shapes, points, y);
}

void reduced_hold(const reduced_mesh *r, const double *c, double *scratch, double *held)
{
  size_t const d = r->dimension;
  if (!r->carriers) {
    dense_times(r->shape_rows, r->constraint_count, d, r->Fx, c, held);
    return;
  }
  memset(scratch, 0, r->atom_count * d * sizeof(double));
  vertices_hold(&r->carriers->space, d, c, scratch);
  spread(r, d, r->shape_offsets, r->carriers->shapes, scratch, held);
}

double reduced_rest_energy(const reduced_mesh *r, const double *u, const double *c, double *scratch)
{
  size_t const d = r->dimension, width = r->rank + r->constraint_count;
  if (r->carriers) {
    double *points = scratch + r->rank * d, *rest = points + r->atom_count * d;
    carrier_positions(r, u, c, scratch, points);
    spread(r, d, r->rest_offsets, r->carriers->rest, points, rest);
    return dense_dot(r->rest_rows * d, rest, rest) / 2;
  }
  double *of_pose = scratch + width * d;
  memcpy(scratch, u, r->rank * d * sizeof(double));
  memcpy(scratch + r->rank * d, c, r->constraint_count * d * sizeof(double));
  dense_times(r->rest_root_rows, width, d, r->rest_root, scratch, of_pose);
  return dense_dot(r->rest_root_rows * d, of_pose, of_pose) / 2;
}

void reduced_coefficients(const reduced_mesh *r, const double *u, const double *c, double *scratch, double *T)
{
  size_t const d = r->dimension, kept = r->atom_count - r->constraint_count, bound = r->constraint_count;
  if (r->carriers) {
    carrier_positions(r, u, c, scratch, T);
    return;
  }
  /* scratch = u - shift c */
  dense_times(r->rank, bound, d, r->shift, c, scratch);
  for (size_t i = 0; i < r->rank * d; i++) {
    scratch[i] = u[i] - scratch[i];
  }
  for (size_t j = 0; j < kept; j++) {
    dense_times(1, r->rank, d, r->basis + j * r->rank, scratch, T + r->kept[j] * d);
  }
  for (size_t i = 0; i < bound; i++) {
    double value[3] = {0};
    dense_times(1, bound, d, r->bound_to_c + i * bound, c, value);
    for (size_t j = 0; j < kept; j++) {
      dense_axpy(d, -r->bound_rest[i * kept + j], T + r->kept[j] * d, value);
    }
    memcpy(T + r->bound[i] * d, value, d * sizeof(double));
  }
}
