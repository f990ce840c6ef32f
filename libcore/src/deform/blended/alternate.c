/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/* The least scale in the frame: a pose that is best turned inside out has none. */
static double const LEAST_SCALE = 1e-3;

/** What a step's energies are made of: lost, <R, y>, <R, G R> and tr V'LV. */
typedef struct terms {
  double lost, along, met, own;
} terms;

/** alpha at the minimum over T as well. Of the energy itself (eq. 16) it comes out small: whatever rotations do not
 *  explain pulls a least-squares factor down. Divided by alpha, distortion counts the same whether exemplar or pose is
 * the larger one. */
static double find_scale(const terms *t, int scale)
{
  double const stiffness = t->own - t->met;
  /* Nothing resists a change of scale where the constraints leave it open. */
  if (scale == EXM_SCALE_HELD || !(stiffness > 1e-12 * t->own) || !(t->along > 0)) {
    return 1;
  }
  double const least_squares = t->along / stiffness;
  double const balanced = sqrt(fmax(t->lost, 0) / stiffness);
  return fmax(scale == EXM_SCALE_BALANCED ? fmax(balanced, least_squares) : least_squares, LEAST_SCALE);
}

static double energy_of(const terms *t, double alpha, int scale)
{
  double const energy = 0.5 * (t->lost - 2 * alpha * t->along + alpha * alpha * (t->own - t->met));
  return fmax(scale == EXM_SCALE_BALANCED ? energy / alpha : energy, 0);
}

static void record(exm_solve_report *report, double energy)
{
  if (report && report->history && report->history_count < report->history_capacity) {
    report->history[report->history_count++] = energy;
  }
}

static int has_settled(double before, double energy, double tolerance)
{
  return tolerance > 0 && before - energy <= tolerance * before;
}

double blended_average(blended *b, const blended_options *options, exm_solve_report *report)
{
  const blended_factor *f = &b->held.factors[BLENDED_FIRST];
  size_t const d = b->dimension, rank = b->bases[BLENDED_FIRST].rank, S = b->compared_count;
  size_t const rows = S * b->group_count * d;
  double own = 0, energy = INFINITY;
  for (size_t s = 0; s < S; s++) {
    own += b->energy->own[s] / (double)S;
  }
  for (int32_t i = 0; i < options->average_iterations; i++) {
    double const before = energy;
    dense_times_transposed(rows, rank, d, f->responses, rank, b->rotations, b->reached);
    for (size_t k = 0; k < rank * d; k++) {
      b->reached[k] /= (double)S;
    }
    terms const t = {.lost = f->lost,
                     .along = dense_dot(rank * d, b->reached, f->z),
                     .met = dense_dot(rank * d, b->reached, b->reached),
                     .own = own};
    b->scale = find_scale(&t, options->scale);
    energy = energy_of(&t, b->scale, options->scale);
    record(report, energy);
    report->iterations++;
    dense_times(rows, rank, d, f->responses, b->reached, b->turned);
    memcpy(b->fits, f->y, rows * d * sizeof(double));
    dense_axpy(rows * d, b->scale, b->turned, b->fits);
    rotation_fit(d, S * b->group_count, b->fits, b->rotations);
    if (has_settled(before, energy, options->tolerance)) {
      report->converged = 1;
      break;
    }
  }
  return energy;
}

double blended_minimal(blended *b, int stage, size_t s, int32_t iterations, const blended_options *options,
                       exm_solve_report *report)
{
  const blended_factor *f = &b->held.factors[stage];
  size_t const d = b->dimension, rows = b->group_count * d, at = s * rows * d;
  const double *G = f->green + s * rows * rows, *y = f->y + at;
  double *R = b->rotations + at, *turned = b->turned + at, *fits = b->fits + at;
  double energy = INFINITY;
  for (int32_t i = 0; i < iterations; i++) {
    double const before = energy;
    if (i > 0) {
      rotation_fit(d, b->group_count, fits, R);
    }
    dense_times(rows, rows, d, G, R, turned);
    terms const t = {.lost = f->lost,
                     .along = dense_dot(rows * d, R, y),
                     .met = dense_dot(rows * d, R, turned),
                     .own = b->energy->own[s]};
    b->scale = find_scale(&t, options->scale);
    energy = energy_of(&t, b->scale, options->scale);
    record(report, energy);
    report->iterations++;
    memcpy(fits, y, rows * d * sizeof(double));
    dense_axpy(rows * d, b->scale, turned, fits);
    if (has_settled(before, energy, options->tolerance)) {
      report->converged = 1;
      break;
    }
  }
  return energy;
}

void blended_pose(blended *b, int stage, size_t s)
{
  const blended_factor *f = &b->held.factors[stage];
  const blended_basis *basis = &b->bases[stage];
  size_t const d = b->dimension, rank = basis->rank, rows = b->group_count * d;
  dense_times_transposed(rows, rank, d, f->responses + s * rows * rank, rank, b->rotations + s * rows * d, b->z);
  for (size_t k = 0; k < rank * d; k++) {
    b->z[k] = f->z[k] + b->scale * b->z[k];
  }
  dense_times(rank, rank, d, f->root, b->z, b->u);
  memset(b->coefficients, 0, b->joint_count * d * sizeof(double));
  for (size_t i = 0; i < basis->atom_count; i++) {
    dense_times(1, rank, d, basis->basis + i * rank, b->u, b->coefficients + basis->atoms[i] * d);
  }
}
