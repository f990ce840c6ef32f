/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Products with the operators of the reduced mesh, whichever way they are stored. */
#include <string.h>

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

static size_t carriers_of(const reduced_mesh *r, size_t g)
{
  return r->carrier_offsets[g + 1] - r->carrier_offsets[g];
}

void reduced_carry(const reduced_mesh *r, size_t group, size_t width, const double *x, double *out)
{
  size_t const rows = r->shape_offsets[group + 1] - r->shape_offsets[group], carriers = carriers_of(r, group);
  times_transposed(rows, carriers, width, r->carried_shapes[group], x, out);
}

/** out [carrier_count][width] = A' X. */
static void gather(const reduced_mesh *r, size_t width, const double *X, double *out)
{
  memset(out, 0, r->carrier_count * width * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    const uint32_t *carriers = r->carriers + r->carrier_offsets[g];
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      const double *row = r->carried_shapes[g] + (i - r->shape_offsets[g]) * carriers_of(r, g);
      for (size_t k = 0; k < carriers_of(r, g); k++) {
        dense_axpy(width, row[k], X + i * width, out + carriers[k] * width);
      }
    }
  }
}

/** Proxies that points [carrier_count][width] carry, for rows that A_g [rows of g][carriers of g] describes. */
static void spread(const reduced_mesh *r, size_t width, const size_t *offsets, double **carried, const double *points,
                   double *out)
{
  memset(out, 0, offsets[r->group_count] * width * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    const uint32_t *carriers = r->carriers + r->carrier_offsets[g];
    for (size_t i = offsets[g]; i < offsets[g + 1]; i++) {
      const double *row = carried[g] + (i - offsets[g]) * carriers_of(r, g);
      for (size_t k = 0; k < carriers_of(r, g); k++) {
        dense_axpy(width, row[k], points + carriers[k] * width, out + i * width);
      }
    }
  }
}

void reduced_to_basis(const reduced_mesh *r, size_t width, const double *X, double *scratch, double *u)
{
  if (r->carrier_count == 0) {
    times_transposed(r->shape_rows, r->rank, width, r->Ux, X, u);
    return;
  }
  gather(r, width, X, scratch);
  times_transposed(r->carrier_count, r->rank, width, r->P, scratch, u);
}

void reduced_to_shapes(const reduced_mesh *r, size_t width, const double *u, double *scratch, double *y)
{
  if (r->carrier_count == 0) {
    times(r->shape_rows, r->rank, width, r->Ux, u, y);
    return;
  }
  times(r->carrier_count, r->rank, width, r->P, u, scratch);
  spread(r, width, r->shape_offsets, r->carried_shapes, scratch, y);
}

void reduced_respond(const reduced_mesh *r, size_t width, const double *X, double *scratch, double *shapes,
                     double *rest)
{
  if (r->carrier_count == 0) {
    times_transposed(r->shape_rows, r->rank, width, r->Ux, X, scratch);
    times(r->shape_rows, r->rank, width, r->Ux, scratch, shapes);
    times(r->rest_rows, r->rank, width, r->Ur, scratch, rest);
    return;
  }
  double *points = scratch + r->carrier_count * width;
  gather(r, width, X, scratch);
  times(r->carrier_count, r->carrier_count, width, r->PP, scratch, points);
  spread(r, width, r->shape_offsets, r->carried_shapes, points, shapes);
  spread(r, width, r->rest_offsets, r->carried_rest, points, rest);
}

double reduced_rest_energy(const reduced_mesh *r, const double *u, const double *c, double *scratch)
{
  size_t const d = r->dimension, width = r->rank + r->constraint_count;
  double *of_pose = scratch + width * d;
  memcpy(scratch, u, r->rank * d * sizeof(double));
  memcpy(scratch + r->rank * d, c, r->constraint_count * d * sizeof(double));
  dense_times(r->rest_root_rows, width, d, r->rest_root, scratch, of_pose);
  return dense_dot(r->rest_root_rows * d, of_pose, of_pose) / 2;
}

void reduced_green(const reduced_mesh *r, double *scratch, double *G)
{
  size_t const rows = r->shape_rows;
  if (r->carrier_count == 0) {
    memcpy(G, r->G, rows * rows * sizeof(double));
    return;
  }
  /* (A PP)' = PP A' first, then A times that. */
  memset(scratch, 0, r->carrier_count * rows * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    const uint32_t *carriers = r->carriers + r->carrier_offsets[g];
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      const double *row = r->carried_shapes[g] + (i - r->shape_offsets[g]) * carriers_of(r, g);
      for (size_t k = 0; k < carriers_of(r, g); k++) {
        for (size_t v = 0; v < r->carrier_count; v++) {
          scratch[v * rows + i] += row[k] * r->PP[carriers[k] * r->carrier_count + v];
        }
      }
    }
  }
  spread(r, rows, r->shape_offsets, r->carried_shapes, scratch, G);
}

void reduced_coefficients(const reduced_mesh *r, const double *u, const double *c, double *scratch, double *T)
{
  size_t const d = r->dimension, kept = r->atom_count - r->constraint_count, bound = r->constraint_count;
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
