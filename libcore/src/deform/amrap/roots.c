/* SPDX-License-Identifier: GPL-3.0-or-later */
/* D of eq. 10 without poses. Proxies of exemplar s's own solution less the turned exemplar are linear in its rotations
 * and in the handles: in group g,  M_gs z  with  z = (Rt_s over c),
 *
 *     M_gs = [ U_g K_s - E_gs | F_g ],   K_s = Ux' shapes_s,
 *
 * E_gs the exemplar in the columns of Rt_gs. The triangle of M's QR has as many rows as z at most, has the same sum of
 * squares, and is exact where that vanishes. */
#include <string.h>

#include "base/simd.h"
#include "deform/amrap/amrap.h"
#include "linalg/dense.h"

/* What may be spent on them at bind, in multiplications (about a tenth of a nanosecond each), and in bytes. */
static double const WORK_MAXIMUM = 2e9, BYTES_MAXIMUM = 128e6;

static int are_worth_it(const reduced_mesh *r)
{
  double const S = (double)r->exemplar_count, G = (double)r->group_count, d = (double)r->dimension;
  double const rows = (double)(r->shape_rows + r->rest_rows), rank = (double)r->rank;
  double const n = G * d + (double)r->constraint_count, triangle = n * (n + 1) / 2;
  double const by_roots = S * G * triangle, by_rows = (rows + (double)r->shape_rows) * rank * S;
  double const work = rows * rank * S * G * d + S * rows * n * n;
  return by_roots < by_rows && work < WORK_MAXIMUM && by_roots * sizeof(double) < BYTES_MAXIMUM;
}

/** K_s, [rank][G d]. */
static void response_of_rotations(const reduced_mesh *r, size_t s, double *K)
{
  size_t const d = r->dimension, stacked = r->group_count * d, width = r->exemplar_count * d;
  memset(K, 0, r->rank * stacked * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      for (size_t q = 0; q < r->rank; q++) {
        dense_axpy(d, r->Ux[i * r->rank + q], r->shapes + i * width + s * d, K + q * stacked + g * d);
      }
    }
  }
}

/** M_gs, [rows of g, at least n][n]. */
static void fill(const reduced_mesh *r, size_t g, size_t s, const double *K, double *part, double *M)
{
  size_t const d = r->dimension, stacked = r->group_count * d, bound = r->constraint_count, n = stacked + bound;
  size_t const first = r->shape_offsets[g], shapes = r->shape_offsets[g + 1] - first;
  size_t const rest_first = r->rest_offsets[g], rest = r->rest_offsets[g + 1] - rest_first;
  dense_multiply(0, 0, shapes, stacked, r->rank, 1, r->Ux + first * r->rank, K, 0, part);
  dense_multiply(0, 0, rest, stacked, r->rank, 1, r->Ur + rest_first * r->rank, K, 0, part + shapes * stacked);
  for (size_t i = 0; i < shapes + rest; i++) {
    const double *F = i < shapes ? r->Fx + (first + i) * bound : r->Fr + (rest_first + i - shapes) * bound;
    memcpy(M + i * n, part + i * stacked, stacked * sizeof(double));
    memcpy(M + i * n + stacked, F, bound * sizeof(double));
    if (i < shapes) {
      dense_axpy(d, -1, r->shapes + ((first + i) * r->exemplar_count + s) * d, M + i * n + g * d);
    }
  }
}

static void pack(size_t n, const double *R, double *out)
{
  for (size_t i = 0; i < n; i++) {
    memcpy(out, R + i * n + i, (n - i) * sizeof(double));
    out += n - i;
  }
}

exm_status amrap_roots_create(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  if (!are_worth_it(r)) {
    return EXM_OK;
  }
  size_t const stacked = r->group_count * r->dimension, n = stacked + r->constraint_count, triangle = n * (n + 1) / 2;
  size_t longest = n;
  for (size_t g = 0; g < r->group_count; g++) {
    size_t const rows = r->shape_offsets[g + 1] - r->shape_offsets[g] + r->rest_offsets[g + 1] - r->rest_offsets[g];
    longest = rows > longest ? rows : longest;
  }
  arena scratch = {0};
  double *K = ARENA_NEW(&scratch, double, r->rank *stacked);
  double *part = ARENA_NEW(&scratch, double, longest *stacked);
  double *M = ARENA_NEW(&scratch, double, longest *n);
  a->D_roots = ARENA_NEW(owner, double, r->exemplar_count * r->group_count * triangle);
  exm_status status = K && part && M && a->D_roots ? EXM_OK : status_no_memory("the deformer");
  for (size_t s = 0; s < r->exemplar_count && status == EXM_OK; s++) {
    response_of_rotations(r, s, K);
    for (size_t g = 0; g < r->group_count && status == EXM_OK; g++) {
      memset(M, 0, longest * n * sizeof(double));
      fill(r, g, s, K, part, M);
      status = dense_qr_factor(longest, n, M);
      pack(n, M, a->D_roots + (g * r->exemplar_count + s) * triangle);
    }
  }
  arena_release(&scratch);
  return status;
}

/** |root z|^2 for a packed triangle and z [d][n]. */
INLINE double squares(size_t n, size_t d, const double *root, const double *z)
{
  double sum = 0;
  for (size_t i = 0; i < n; root += n - i, i++) {
    double x = 0, y = 0, t = 0;
    const double *z0 = z + i, *z1 = z + n + i, *z2 = z + (d - 1) * n + i;
#pragma omp simd reduction(+ : x, y, t)
    for (size_t j = 0; j < n - i; j++) {
      x += root[j] * z0[j];
      y += root[j] * z1[j];
      t += root[j] * z2[j];
    }
    sum += x * x + y * y + (d == 3 ? t * t : 0);
  }
  return sum;
}

SIMD_CLONES static void measure(const reduced_mesh *r, const double *roots, size_t s, const double *z, double *D)
{
  size_t const n = r->group_count * r->dimension + r->constraint_count, triangle = n * (n + 1) / 2;
  for (size_t g = 0; g < r->group_count; g++) {
    size_t const at = g * r->exemplar_count + s;
    D[at] = squares(n, r->dimension, roots + at * triangle, z) / 2;
  }
}

void amrap_measure_by_roots(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, stacked = r->group_count * d, n = stacked + r->constraint_count;
  for (size_t s = 0; s < r->exemplar_count; s++) {
    for (size_t k = 0; k < d; k++) {
      for (size_t i = 0; i < stacked; i++) {
        a->stacked[k * n + i] = a->single_rotations[(s * stacked + i) * d + k];
      }
      for (size_t i = 0; i < r->constraint_count; i++) {
        a->stacked[k * n + stacked + i] = a->c[i * d + k];
      }
    }
    measure(r, a->D_roots, s, a->stacked, a->D);
  }
}
