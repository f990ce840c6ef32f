/* SPDX-License-Identifier: GPL-3.0-or-later */
/* D of eq. 10 where all positions are free: ARAP of all exemplars at once, over the vertices.
 *
 * The matrices that rotations are fitted to and the forces of turned exemplars need only what each group's energy pulls
 * its carriers with at rest, L_g p_s: K of eq. 17. D itself is measured on proxies, as a sum of squares. Exemplars lie
 * side by side, so that they are worked on several at a time. */
#include <math.h>
#include <string.h>

#include "base/simd.h"
#include "deform/amrap/amrap.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/* Local/global iterations from nothing, on a drag, and at most to a tolerance; see exemplars.c. */
enum { COUNT_FROM_SCRATCH = 20, COUNT_WARM = 1, CAP = 200 };
static double const MATRIX_TOLERANCE = 1e-7;

exm_status amrap_whole_create(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, G = r->group_count, width = S * d;
  size_t const carriers = r->carriers->offsets[G], squares = G * d * width;
  amrap_whole *w = &a->whole;
  arena scratch = {0};
  exm_status status = EXM_OK;
  double *pulls = ARENA_NEW(&scratch, double, carriers *width);
  *w = (amrap_whole){.pulls = ARENA_NEW(owner, double, carriers *width),
                     .shapes = ARENA_NEW(owner, double, r->shape_rows *width),
                     .turns = ARENA_NEW(owner, double, squares),
                     .fits = ARENA_NEW(owner, double, squares),
                     .before = ARENA_NEW(owner, double, squares),
                     .points = ARENA_NEW(owner, double, r->atom_count *width),
                     .forces = ARENA_NEW(owner, double, r->atom_count *width),
                     .u = ARENA_NEW(owner, double, r->rank *width),
                     .held = ARENA_NEW(owner, double, r->atom_count *d)};
  if (!pulls || !w->pulls || !w->shapes || !w->turns || !w->fits || !w->before || !w->points || !w->forces || !w->u ||
      !w->held) {
    status = status_no_memory("the deformer");
    goto done;
  }
  for (size_t g = 0; g < G; g++) {
    reduced_carry(r, g, width, r->shapes + r->shape_offsets[g] * width, pulls + r->carriers->offsets[g] * width);
  }
  for (size_t i = 0; i < carriers; i++) {
    dense_transpose(S, d, pulls + i * width, w->pulls + i * width);
  }
  for (size_t i = 0; i < r->shape_rows; i++) {
    dense_transpose(S, d, r->shapes + i * width, w->shapes + i * width);
  }
done:
  arena_release(&scratch);
  return status;
}

/** out[j][k][.] += a[j][.] b[k][.] */
INLINE void add_outer(size_t d, size_t S, const double *a, const double *b, double *out)
{
  for (size_t j = 0; j < d; j++) {
    for (size_t k = 0; k < d; k++) {
      for (size_t s = 0; s < S; s++) {
        out[(j * d + k) * S + s] += a[j * S + s] * b[k * S + s];
      }
    }
  }
}

/** out[k][.] += sign a[j][.] turns[j][k][.] */
INLINE void add_turned(size_t d, size_t S, double sign, const double *a, const double *turns, double *out)
{
  for (size_t k = 0; k < d; k++) {
    for (size_t j = 0; j < d; j++) {
      for (size_t s = 0; s < S; s++) {
        out[k * S + s] += sign * a[j * S + s] * turns[(j * d + k) * S + s];
      }
    }
  }
}

INLINE void fit_all(const reduced_mesh *r, amrap_whole *w, size_t d)
{
  size_t const S = r->exemplar_count, width = S * d;
  memset(w->fits, 0, r->group_count * d * width * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t i = r->carriers->offsets[g]; i < r->carriers->offsets[g + 1]; i++) {
      add_outer(d, S, w->pulls + i * width, w->points + r->carriers->indices[i] * width, w->fits + g * d * width);
    }
  }
}

INLINE void push_all(const reduced_mesh *r, amrap_whole *w, size_t d)
{
  size_t const S = r->exemplar_count, width = S * d;
  memset(w->forces, 0, r->atom_count * width * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t i = r->carriers->offsets[g]; i < r->carriers->offsets[g + 1]; i++) {
      add_turned(d, S, 1, w->pulls + i * width, w->turns + g * d * width, w->forces + r->carriers->indices[i] * width);
    }
  }
}

/** D: squared proxies of the poses less turned exemplars. row [d S] is scratch. */
INLINE void measure_all(const reduced_mesh *r, const amrap_whole *w, size_t d, double *row, double *D)
{
  size_t const S = r->exemplar_count, width = S * d;
  memset(D, 0, r->group_count * S * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    const uint32_t *indices = r->carriers->indices + r->carriers->offsets[g];
    size_t const n = r->carriers->offsets[g + 1] - r->carriers->offsets[g];
    size_t const shapes = r->shape_offsets[g + 1] - r->shape_offsets[g];
    size_t const rest = r->rest_offsets[g + 1] - r->rest_offsets[g];
    for (size_t i = 0; i < shapes + rest; i++) {
      const double *root = i < shapes ? r->carriers->shapes[g] + i * n : r->carriers->rest[g] + (i - shapes) * n;
      memset(row, 0, width * sizeof(double));
      for (size_t c = 0; c < n; c++) {
        for (size_t k = 0; k < width; k++) {
          row[k] += root[c] * w->points[indices[c] * width + k];
        }
      }
      if (i < shapes) {
        add_turned(d, S, -1, w->shapes + (r->shape_offsets[g] + i) * width, w->turns + g * d * width, row);
      }
      for (size_t k = 0; k < d; k++) {
        for (size_t s = 0; s < S; s++) {
          D[g * S + s] += row[k * S + s] * row[k * S + s] / 2;
        }
      }
    }
  }
}

SIMD_CLONES static void fit_matrices(const reduced_mesh *r, amrap_whole *w)
{
  if (r->dimension == 3) {
    fit_all(r, w, 3);
  } else {
    fit_all(r, w, 2);
  }
}

SIMD_CLONES static void push(const reduced_mesh *r, amrap_whole *w)
{
  if (r->dimension == 3) {
    push_all(r, w, 3);
  } else {
    push_all(r, w, 2);
  }
}

SIMD_CLONES static void measure(const reduced_mesh *r, const amrap_whole *w, double *row, double *D)
{
  if (r->dimension == 3) {
    measure_all(r, w, 3, row, D);
  } else {
    measure_all(r, w, 2, row, D);
  }
}

/** Between the rotations of each exemplar [S][G][d][d] and exemplars side by side [G][d][d][S]. */
static void interleave(amrap *a)
{
  size_t const S = a->reduced.exemplar_count, G = a->reduced.group_count,
               dd = a->reduced.dimension * a->reduced.dimension;
  for (size_t s = 0; s < S; s++) {
    for (size_t g = 0; g < G; g++) {
      for (size_t i = 0; i < dd; i++) {
        a->whole.turns[(g * dd + i) * S + s] = a->single_rotations[(s * G + g) * dd + i];
      }
    }
  }
}

static void separate(amrap *a, const double *from)
{
  size_t const S = a->reduced.exemplar_count, G = a->reduced.group_count,
               dd = a->reduced.dimension * a->reduced.dimension;
  for (size_t s = 0; s < S; s++) {
    for (size_t g = 0; g < G; g++) {
      for (size_t i = 0; i < dd; i++) {
        a->single_rotations[(s * G + g) * dd + i] = from[(g * dd + i) * S + s];
      }
    }
  }
}

/** The same displacement for all exemplars. */
static void move_points(amrap *a, double sign)
{
  size_t const S = a->reduced.exemplar_count, count = a->reduced.atom_count * a->reduced.dimension;
  for (size_t i = 0; i < count; i++) {
    for (size_t s = 0; s < S; s++) {
      a->whole.points[i * S + s] += sign * a->whole.held[i];
    }
  }
}

/** Rotations from the points. Returns the largest change of a matrix that they are fitted to. */
static double local_step(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  amrap_whole *w = &a->whole;
  size_t const count = r->group_count * r->exemplar_count, d = r->dimension;
  double change = 0;
  fit_matrices(r, w);
  for (size_t i = 0; i < count * d * d; i++) {
    change = fmax(change, fabs(w->fits[i] - w->before[i]));
  }
  memcpy(w->before, w->fits, count * d * d * sizeof(double));
  separate(a, w->fits);
  rotation_fit(d, count, a->single_rotations, a->single_rotations);
  interleave(a);
  return change;
}

static void global_step(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  amrap_whole *w = &a->whole;
  size_t const width = r->exemplar_count * r->dimension;
  push(r, w);
  vertices_to_basis(&r->carriers->space, width, w->forces, w->u);
  vertices_from_basis(&r->carriers->space, width, w->u, w->points);
  move_points(a, 1);
}

void amrap_whole_solve(amrap *a, const amrap_options *options, int from_scratch)
{
  const reduced_mesh *r = &a->reduced;
  amrap_whole *w = &a->whole;
  size_t const d = r->dimension;
  int const count = options->tolerance > 0 ? CAP : from_scratch ? COUNT_FROM_SCRATCH : COUNT_WARM;
  int const is_fresh = from_scratch || !options->has_rotations;
  if (!is_fresh) {
    move_points(a, -1);
  }
  memset(w->held, 0, r->atom_count * d * sizeof(double));
  vertices_hold(&r->carriers->space, d, a->c, w->held);
  if (is_fresh) {
    interleave(a);
    global_step(a);
  } else {
    move_points(a, 1);
  }
  for (int i = 0; i < count && options->has_rotations; i++) {
    double const change = local_step(a);
    global_step(a);
    if (change < MATRIX_TOLERANCE * r->size * r->size) {
      break;
    }
  }
  measure(r, w, a->moments, a->D);
}
