/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Iterations that cannot increase the objective [AMRAP, appendix A].
 *
 * Between the two steps of the plain alternation the rotations follow the pose, which the blend step does not foresee:
 * it minimises eq. 20 for the old ones. Where that raises the objective, its first-order effect is added, and the step
 * is shortened until the objective falls. Only 1/2 |X|^2 depends on the rotations to first order (eq. 25-27): the term
 * <y, X> is stationary, because the rotations maximise it.
 *
 * Instead of a radius we shorten steps by a damping mu: each damped step is the trust-region step of some radius, and
 * the program keeps its form. Ten times the damping after a failure, a tenth after a success, as in the paper. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "deform/amrap/amrap.h"
#include "linalg/dense.h"

enum { ATTEMPTS = 14 };
static double const DAMPING_STEP = 10, DAMPING_FIRST = 1e-2;

/** n -> K^-1 n for K = tr(P) I - P, symmetric 3x3, by cofactors; 0 where K is singular (the rotation is not unique). */
static int solve_turn(const double P[9], const double n[3], double m[3])
{
  double const trace = P[0] + P[4] + P[8];
  double const a = trace - P[0], b = -(P[1] + P[3]) / 2, c = -(P[2] + P[6]) / 2, d = trace - P[4],
               e = -(P[5] + P[7]) / 2, f = trace - P[8];
  double const A = d * f - e * e, B = c * e - b * f, C = b * e - c * d;
  double const det = a * A + b * B + c * C;
  if (fabs(det) < 1e-12 * fabs(trace * trace * trace) + DBL_MIN) {
    return 0;
  }
  m[0] = (A * n[0] + B * n[1] + C * n[2]) / det;
  m[1] = (B * n[0] + (a * f - c * c) * n[1] + (b * c - a * e) * n[2]) / det;
  m[2] = (C * n[0] + (b * c - a * e) * n[1] + (a * d - b * b) * n[2]) / det;
  return 1;
}

static void multiply_transposed(size_t d, const double *A, const double *B, double *out)
{
  for (size_t i = 0; i < d; i++) {
    for (size_t j = 0; j < d; j++) {
      out[i * d + j] = 0;
      for (size_t k = 0; k < d; k++) {
        out[i * d + j] += A[k * d + i] * B[k * d + j];
      }
    }
  }
}

/** Derivative of <Gamma, R> by the matrix F that R was fitted to, without a singular value decomposition: with
 *  P = R'F and dR = R [w], the skew part of R'dF is (tr(P) I - P) w. */
static int rotation_adjoint(size_t d, const double *R, const double *F, const double *gamma, double *out)
{
  double P[9] = {0}, N[9] = {0}, skew[9] = {0};
  multiply_transposed(d, R, F, P);
  multiply_transposed(d, R, gamma, N);
  if (d == 2) {
    double const trace = P[0] + P[3];
    if (fabs(trace) < DBL_MIN) {
      return 0;
    }
    double const m = (N[2] - N[1]) / trace;
    skew[1] = -m;
    skew[2] = m;
  } else {
    double const n[3] = {N[7] - N[5], N[2] - N[6], N[3] - N[1]};
    double m[3];
    if (!solve_turn(P, n, m)) {
      return 0;
    }
    double const filled[9] = {0, -m[2], m[1], m[2], 0, -m[0], -m[1], m[0], 0};
    memcpy(skew, filled, sizeof skew);
  }
  for (size_t i = 0; i < d; i++) {
    for (size_t j = 0; j < d; j++) {
      out[i * d + j] = 0;
      for (size_t k = 0; k < d; k++) {
        out[i * d + j] += R[i * d + k] * skew[k * d + j];
      }
    }
  }
  return 1;
}

void amrap_rotation_slope(amrap *a, double *slope)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count;
  double gamma[9], by_fit[9];
  memset(a->turned_G, 0, r->shape_rows * d * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t s = 0; s < S; s++) {
      double const weight = a->B[g * S + s];
      if (weight == 0) {
        continue;
      }
      memset(gamma, 0, sizeof gamma);
      for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
        for (size_t j = 0; j < d; j++) {
          dense_axpy(d, weight * r->shapes[(i * S + s) * d + j], a->X + i * d, gamma + j * d);
        }
      }
      size_t const at = (g * S + s) * d * d;
      if (!rotation_adjoint(d, a->rotations + at, a->fit + at, gamma, by_fit)) {
        continue;
      }
      for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
        for (size_t j = 0; j < d; j++) {
          dense_axpy(d, r->shapes[(i * S + s) * d + j], by_fit + j * d, a->turned_G + i * d);
        }
      }
    }
  }
  reduced_to_basis(r, d, a->turned_G, a->carried, slope);
}

/** The state that a refused step goes back to. */
static void save(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  memcpy(a->saved_u, a->u, r->rank * r->dimension * sizeof(double));
  memcpy(a->saved_B, a->B, r->group_count * r->exemplar_count * sizeof(double));
}

/** u and B back, and what follows from them. */
static void restore(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension;
  memcpy(a->u, a->saved_u, r->rank * d * sizeof(double));
  memcpy(a->B, a->saved_B, r->group_count * r->exemplar_count * sizeof(double));
  reduced_to_shapes(r, d, a->u, a->carried, a->y);
  dense_axpy(r->shape_rows * d, 1, a->Fxc, a->y);
  amrap_fit_rotations(a);
  amrap_blend_shapes(a);
}

int amrap_guarded_step(amrap *a, const amrap_options *options, double *mu, double *objective, cone_result *result)
{
  save(a);
  amrap_rotation_slope(a, a->slope);
  for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
    amrap_damping const damping = {.mu = *mu, .u0 = a->saved_u, .B0 = a->saved_B, .slope = a->slope};
    amrap_solve_blend(a, options, &damping, result);
    amrap_fit_rotations(a);
    amrap_blend_shapes(a);
    double const value = amrap_objective(a, options, NULL);
    if (value < *objective) {
      *objective = value;
      *mu = *mu > DAMPING_FIRST ? *mu / DAMPING_STEP : 0;
      return 1;
    }
    *mu = fmax(*mu * DAMPING_STEP, DAMPING_FIRST);
    restore(a);
  }
  return 0;
}
