/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/* The least scale in the frame: a pose that is best turned inside out has none. */
static double const LEAST_SCALE = 1e-3;

/** alpha of eq. 16 at the minimum over T as well: a, b, c as <R, y>, <R, G R> and tr V'LV. */
static double find_scale(double a, double b, double c, int has_scale)
{
  double const stiffness = c - b;
  if (!has_scale) {
    return 1;
  }
  /* Nothing resists a change of scale where the constraints leave it open. */
  return stiffness > 1e-12 * c ? fmax(a / stiffness, LEAST_SCALE) : 1;
}

static double energy_of(double lost, double a, double b, double c, double scale)
{
  return fmax(0.5 * (lost - 2 * scale * a + scale * scale * (c - b)), 0);
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
    double const along = dense_dot(rank * d, b->reached, f->z), met = dense_dot(rank * d, b->reached, b->reached);
    b->scale = find_scale(along, met, own, options->has_scale);
    energy = energy_of(f->lost, along, met, own, b->scale);
    record(report, energy);
    report->iterations++;
    dense_times(rows, rank, d, f->responses, b->reached, b->turned);
    memcpy(b->fits, f->y, rows * d * sizeof(double));
    dense_axpy(rows * d, b->scale, b->turned, b->fits);
    rotation_fit(d, S * b->group_count, b->fits, b->rotations);
    if (has_settled(before, energy, options->tolerance)) {
      report->converged++;
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
  double const own = b->energy->own[s];
  double energy = INFINITY;
  for (int32_t i = 0; i < iterations; i++) {
    double const before = energy;
    if (i > 0) {
      rotation_fit(d, b->group_count, fits, R);
    }
    dense_times(rows, rows, d, G, R, turned);
    double const along = dense_dot(rows * d, R, y), met = dense_dot(rows * d, R, turned);
    b->scale = find_scale(along, met, own, options->has_scale);
    energy = energy_of(f->lost, along, met, own, b->scale);
    record(report, energy);
    report->iterations++;
    memcpy(fits, y, rows * d * sizeof(double));
    dense_axpy(rows * d, b->scale, turned, fits);
    if (has_settled(before, energy, options->tolerance)) {
      report->converged++;
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
