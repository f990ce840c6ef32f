/* SPDX-License-Identifier: GPL-3.0-or-later */
/* D of eq. 10: how far each exemplar is from the handles, by ARAP on that exemplar alone [AMRAP, 5.2]. */
#include <math.h>
#include <string.h>

#include "deform/amrap/amrap.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/* Local/global iterations of one exemplar, a few microseconds each: how many from nothing and on a drag, and at most to
 * a tolerance. Plain ones where their number is fixed: the result is then a continuous function of the handles.
 * Acceleration branches, and its branches show as jitter of exemplars that are far from the handles. */
enum { COUNT_FROM_SCRATCH = 40, COUNT_WARM = 4, CAP = 200 };
/* Largest change of a matrix that rotations are fitted to that counts as none, relative to the energy of the mesh. */
static double const MATRIX_TOLERANCE = 1e-7;

/** The rigid motion that takes exemplar s's handles closest to the targets: where its ARAP starts. Equivariant, so that
 * the result is. */
void amrap_rigid_start(amrap *a, size_t s)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, bound = r->constraint_count, width = r->exemplar_count * d;
  double mean_from[3] = {0}, mean_to[3] = {0}, moment[9] = {0}, rotation[9];
  double positions = 0;
  for (size_t i = 0; i < bound; i++) {
    if (!r->is_frame_row[i]) {
      dense_axpy(d, 1, r->exemplar_targets + i * width + s * d, mean_from);
      dense_axpy(d, 1, a->c + i * d, mean_to);
      positions += 1;
    }
  }
  /* Frame rows are images of unit vectors, many times longer than what they stand for. */
  double const frame_weight = 0.05;
  for (size_t i = 0; i < bound; i++) {
    int const is_frame = r->is_frame_row[i];
    for (size_t j = 0; j < d; j++) {
      double const from = r->exemplar_targets[i * width + s * d + j] - (is_frame ? 0 : mean_from[j] / positions);
      for (size_t k = 0; k < d; k++) {
        double const to = a->c[i * d + k] - (is_frame ? 0 : mean_to[k] / positions);
        moment[j * d + k] += (is_frame ? frame_weight : 1) * from * to;
      }
    }
  }
  rotation_fit(d, 1, moment, rotation);
  for (size_t g = 0; g < r->group_count; g++) {
    memcpy(a->single_rotations + (s * r->group_count + g) * d * d, rotation, d * d * sizeof(double));
  }
}

static void identity_rotations(size_t dimension, size_t count, double *rotations)
{
  memset(rotations, 0, count * dimension * dimension * sizeof(double));
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < dimension; k++) {
      rotations[(i * dimension + k) * dimension + k] = 1;
    }
  }
}

/** M = Gs Rt + Fs c, and the energy of the best pose for Rt but for a constant: -1/2 <Rt, Gs Rt> - <Rt, Fs c>. */
static double global_step(const amrap *a, size_t s, const double *rotations, const double *held, double *matrices)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, stacked = r->group_count * d;
  dense_times_transposed(stacked, stacked, d, a->Gs + s * stacked * stacked, stacked, rotations, matrices);
  double const energy = -dense_dot(stacked * d, rotations, matrices) / 2 - dense_dot(stacked * d, rotations, held);
  dense_axpy(stacked * d, 1, held, matrices);
  return energy;
}

/** Local/global alternation of exemplar s, as a fixed point of the matrices M that rotations are fitted to, with
 * Anderson mixing. The energy is the guard: where a mixed step raised it, the plain step is taken instead. */
static void alternate(amrap *a, size_t s, int cap, int is_accelerated)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, stacked = r->group_count * d, size = stacked * d;
  double *rotations = a->single_rotations + s * size;
  double *held = a->fit, *matrices = a->fit + size, *fallback = a->fit_fallback, *image = a->fit_image;
  double lowest = INFINITY;
  dense_times(stacked, r->constraint_count, d, a->Fs + s * stacked * r->constraint_count, a->c, held);
  anderson_reset(&a->single_mixing);
  global_step(a, s, rotations, held, matrices);
  memcpy(fallback, matrices, size * sizeof(double));
  for (int i = 0; i < cap; i++) {
    double change = 0;
    rotation_fit(d, r->group_count, matrices, rotations);
    double energy = global_step(a, s, rotations, held, image);
    if (is_accelerated && energy > lowest) {
      anderson_reset(&a->single_mixing);
      memcpy(matrices, fallback, size * sizeof(double));
      rotation_fit(d, r->group_count, matrices, rotations);
      energy = global_step(a, s, rotations, held, image);
    }
    lowest = energy;
    for (size_t k = 0; k < size; k++) {
      change = fmax(change, fabs(image[k] - matrices[k]));
    }
    memcpy(fallback, image, size * sizeof(double));
    if (change < MATRIX_TOLERANCE * r->size * r->size) {
      break;
    }
    if (is_accelerated) {
      anderson_mix(&a->single_mixing, image, matrices);
    } else {
      memcpy(matrices, image, size * sizeof(double));
    }
  }
}

/** Turned proxies of exemplar s at row i. */
static void turn_single(const amrap *a, size_t i, size_t g, size_t s, double *out)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension;
  const double *rotation = a->single_rotations + (s * r->group_count + g) * d * d;
  const double *shape = r->shapes + (i * r->exemplar_count + s) * d;
  for (size_t k = 0; k < d; k++) {
    out[k] = shape[0] * rotation[k] + shape[1] * rotation[d + k];
  }
  for (size_t k = 0; d == 3 && k < 3; k++) {
    out[k] += shape[2] * rotation[6 + k];
  }
}

/** Proxies of all exemplars' solutions, but for what the handles hold. */
static void solve_poses(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, width = r->exemplar_count * d;
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      for (size_t s = 0; s < r->exemplar_count; s++) {
        turn_single(a, i, g, s, a->single_blend + i * width + s * d);
      }
    }
  }
  reduced_to_basis(r, width, a->single_blend, a->carried, a->global_u);
  reduced_to_shapes(r, width, a->global_u, a->carried, a->single_shapes);
  dense_multiply(0, 0, r->rest_rows, width, r->rank, 1, r->Ur, a->global_u, 0, a->single_rest);
}

void amrap_exemplar_pose(const amrap *a, size_t s, double *scratch, double *u)
{
  const reduced_mesh *r = &a->reduced;
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      turn_single(a, i, g, s, scratch + i * r->dimension);
    }
  }
  reduced_to_basis(r, r->dimension, scratch, a->carried, u);
}

/** D_gs = 1/2 |proxies of the pose - turned exemplar|^2 over the group's rows. */
static void measure(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, bound = r->constraint_count;
  double held[3];
  memset(a->D, 0, r->group_count * S * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    double *D = a->D + g * S;
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      for (size_t s = 0; s < S; s++) {
        for (size_t k = 0; k < d; k++) {
          size_t const at = (i * S + s) * d + k;
          double const difference = a->single_shapes[at] + a->Fxc[i * d + k] - a->single_blend[at];
          D[s] += difference * difference / 2;
        }
      }
    }
    for (size_t i = r->rest_offsets[g]; i < r->rest_offsets[g + 1]; i++) {
      dense_times(1, bound, d, r->Fr + i * bound, a->c, held);
      for (size_t s = 0; s < S; s++) {
        for (size_t k = 0; k < d; k++) {
          double const value = a->single_rest[(i * S + s) * d + k] + held[k];
          D[s] += value * value / 2;
        }
      }
    }
  }
}

void amrap_solve_exemplars(amrap *a, const amrap_options *options, int from_scratch)
{
  const reduced_mesh *r = &a->reduced;
  for (size_t s = 0; s < r->exemplar_count && options->has_rotations && from_scratch; s++) {
    amrap_rigid_start(a, s);
  }
  if (!options->has_rotations) {
    identity_rotations(r->dimension, r->exemplar_count * r->group_count, a->single_rotations);
  }
  if (r->carriers) {
    amrap_whole_solve(a, options, from_scratch);
    return;
  }
  for (size_t s = 0; s < r->exemplar_count && options->has_rotations; s++) {
    int const count = from_scratch ? COUNT_FROM_SCRATCH : COUNT_WARM;
    alternate(a, s, options->tolerance > 0 ? CAP : count, options->tolerance > 0);
  }
  if (a->D_roots) {
    amrap_measure_by_roots(a);
  } else {
    solve_poses(a);
    measure(a);
  }
}
