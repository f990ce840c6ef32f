/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The whole optimisation [AMRAP, 5.5]: blend and pose with rotations held, then rotations with the pose held. */
#include <math.h>
#include <string.h>

#include "base/simd.h"
#include "deform/amrap/amrap.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/* EXM_DESCENT_AUTO turns to guarded steps where this many iterations in a row brought the pose no closer to a fixed
 * point. The objective is no sign: it is measured with rotations that the next step changes, and rises on good
 * iterations too. */
enum { STAGNATION = 25 };

void amrap_set_targets(amrap *a, const double *c)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, bound = r->constraint_count;
  if (a->has_energies && memcmp(a->c, c, bound * d * sizeof(double)) == 0) {
    return;
  }
  a->has_energies = 0;
  memcpy(a->c, c, bound * d * sizeof(double));
  reduced_hold(r, a->c, a->carried, a->Fxc);
}

/** out[k][j] += sum over rows of shapes[.][j] y[.][k], three columns, four rows at a time. */
SIMD_CLONES static void moments_three(size_t rows, size_t width, const double *shapes, const double *y, double *out)
{
  double *x0 = out, *x1 = out + width, *x2 = out + 2 * width;
  size_t i = 0;
  for (; i + 4 <= rows; i += 4) {
    const double *r0 = shapes + i * width, *r1 = r0 + width, *r2 = r1 + width, *r3 = r2 + width, *v = y + 3 * i;
    for (size_t j = 0; j < width; j++) {
      x0[j] += r0[j] * v[0] + r1[j] * v[3] + (r2[j] * v[6] + r3[j] * v[9]);
      x1[j] += r0[j] * v[1] + r1[j] * v[4] + (r2[j] * v[7] + r3[j] * v[10]);
      x2[j] += r0[j] * v[2] + r1[j] * v[5] + (r2[j] * v[8] + r3[j] * v[11]);
    }
  }
  for (; i < rows; i++) {
    const double *row = shapes + i * width, *v = y + 3 * i;
    for (size_t j = 0; j < width; j++) {
      x0[j] += row[j] * v[0];
      x1[j] += row[j] * v[1];
      x2[j] += row[j] * v[2];
    }
  }
}

void amrap_moments(const amrap *a, size_t g, const double *Y, double *out)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, width = r->exemplar_count * d;
  size_t const first = r->shape_offsets[g], rows = r->shape_offsets[g + 1] - first;
  memset(out, 0, d * width * sizeof(double));
  if (d == 3) {
    moments_three(rows, width, r->shapes + first * width, Y + first * d, out);
    return;
  }
  for (size_t i = first; i < first + rows; i++) {
    for (size_t k = 0; k < d; k++) {
      dense_axpy(width, Y[i * d + k], r->shapes + i * width, out + k * width);
    }
  }
}

void amrap_fit_rotations(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, count = r->group_count * S;
  for (size_t g = 0; g < r->group_count; g++) {
    double *fit = a->fit + g * S * d * d;
    amrap_moments(a, g, a->y, a->moments);
    for (size_t j = 0; j < S * d; j++) {
      for (size_t k = 0; k < d; k++) {
        fit[j * d + k] = a->moments[k * S * d + j];
      }
    }
  }
  rotation_fit(d, count, a->fit, a->rotations);
}

double amrap_elastic_energy(const amrap *a, const double *u, const double *y, const double *X)
{
  double energy = reduced_rest_energy(&a->reduced, u, a->c, a->carried);
  for (size_t i = 0; i < a->reduced.shape_rows * a->reduced.dimension; i++) {
    energy += (y[i] - X[i]) * (y[i] - X[i]) / 2;
  }
  return energy;
}

double amrap_objective(const amrap *a, const amrap_options *options, double *elastic)
{
  const reduced_mesh *r = &a->reduced;
  double energy = amrap_elastic_energy(a, a->u, a->y, a->X), cost = 0;
  for (size_t i = 0; i < r->group_count * r->exemplar_count; i++) {
    cost += a->B[i] * sqrt(a->D[i]);
  }
  if (elastic) {
    *elastic = energy;
  }
  return sqrt(energy) + options->lambda * cost;
}

void amrap_blend_average(const amrap *a, double *average)
{
  size_t const S = a->reduced.exemplar_count;
  memset(average, 0, S * sizeof(double));
  for (size_t g = 0; g < a->reduced.group_count; g++) {
    dense_axpy(S, a->group_shares[g], a->B + g * S, average);
  }
}

/** Begin at the exemplar closest to the handles, turned as its own solution is. The rotations of every exemplar are
 * those of its own solution, which depend on the handles continuously; the program that follows is convex. */
static void start_from_exemplars(amrap *a, double lambda)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, G = r->group_count;
  size_t closest = 0;
  double least = INFINITY;
  for (size_t s = 0; s < S; s++) {
    double distance = 0;
    for (size_t g = 0; g < G; g++) {
      distance += a->D[g * S + s];
      memcpy(a->rotations + (g * S + s) * d * d, a->single_rotations + (s * G + g) * d * d, d * d * sizeof(double));
    }
    /* Without lambda many blends are equally good; those found from one exemplar vary with the handles continuously. */
    if (distance < least && lambda > 0) {
      least = distance;
      closest = s;
    }
  }
  memset(a->B, 0, G * S * sizeof(double));
  for (size_t g = 0; g < G; g++) {
    a->B[g * S + closest] = 1;
  }
}

/** How far the pose is from the one its rotations were fitted to, relative to the mesh. */
static double change_of(const amrap *a)
{
  double sum = 0;
  for (size_t i = 0; i < a->reduced.rank * a->reduced.dimension; i++) {
    sum += (a->u[i] - a->mixed_u[i]) * (a->u[i] - a->mixed_u[i]);
  }
  return sqrt(sum) / a->reduced.size;
}

static int wants_history(const exm_solve_report *report)
{
  return report->history && report->history_count < report->history_capacity;
}

static void record(exm_solve_report *report, double objective)
{
  report->iterations++;
  if (wants_history(report)) {
    report->history[report->history_count++] = objective;
  }
}

/** Guarded iterations until the cap, a stationary point, or no more change. */
static void descend_guarded(amrap *a, const amrap_options *options, exm_solve_report *report, cone_result *result)
{
  double mu = 0;
  amrap_fit_rotations(a);
  amrap_blend_shapes(a);
  double objective = amrap_objective(a, options, NULL);
  while (report->iterations < options->iterations) {
    memcpy(a->mixed_u, a->u, a->reduced.rank * a->reduced.dimension * sizeof(double));
    int const moved = amrap_guarded_step(a, options, &mu, &objective, result);
    record(report, objective);
    if (!moved || change_of(a) <= options->tolerance) {
      report->converged = 1;
      return;
    }
  }
}

/** The proxies of pose u. */
static void proxies(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  reduced_to_shapes(r, r->dimension, a->u, a->carried, a->y);
  dense_axpy(r->shape_rows * r->dimension, 1, a->Fxc, a->y);
}

/** The plain alternation as a fixed point of the pose u, with Anderson mixing: rotations are fitted to a pose mixed
 * from the last few. */
static void descend_plain(amrap *a, const amrap_options *options, exm_solve_report *report, cone_result *result)
{
  size_t const size = a->reduced.rank * a->reduced.dimension;
  double closest = INFINITY;
  int stagnant = 0;
  anderson_reset(&a->mixing);
  while (report->iterations < options->iterations) {
    amrap_solve_blend(a, options, NULL, result);
    record(report, wants_history(report) ? amrap_objective(a, options, NULL) : 0);
    double const change = report->iterations > 1 ? change_of(a) : INFINITY;
    if (!options->has_rotations || change <= options->tolerance) {
      report->converged = 1;
      return;
    }
    stagnant = change < closest ? 0 : stagnant + 1;
    closest = fmin(closest, change);
    if (options->descent == EXM_DESCENT_AUTO && stagnant >= STAGNATION) {
      descend_guarded(a, options, report, result);
      return;
    }
    if (report->iterations == options->iterations) {
      return;
    }
    if (report->iterations > 1 && options->tolerance > 0) {
      anderson_mix(&a->mixing, a->u, a->mixed_u);
      memcpy(a->u, a->mixed_u, size * sizeof(double));
      proxies(a);
    } else {
      memcpy(a->mixed_u, a->u, size * sizeof(double));
    }
    amrap_fit_rotations(a);
  }
}

exm_status amrap_alternate(amrap *a, const amrap_options *options, exm_solve_report *report)
{
  cone_result result = {0};
  int const is_warm = options->is_warm && a->has_solution;
  /* D belongs to the handles [5.2]: while they stay where they are, a warm solve goes on with the same objective. */
  if (!is_warm || !a->has_energies || a->energies_had_rotations != options->has_rotations) {
    amrap_solve_exemplars(a, options, !is_warm);
    a->has_energies = 1;
    a->energies_had_rotations = options->has_rotations;
  }
  if (!is_warm || !options->has_rotations) {
    start_from_exemplars(a, options->lambda);
  } else {
    amrap_fit_rotations(a);
  }
  if (options->descent == EXM_DESCENT_TRUST_REGION && options->has_rotations) {
    if (!is_warm) {
      amrap_solve_blend(a, options, NULL, &result);
    }
    descend_guarded(a, options, report, &result);
  } else {
    descend_plain(a, options, report, &result);
  }
  report->objective = amrap_objective(a, options, &report->elastic_energy);
  report->optimality_gap = result.gap;
  if (!isfinite(report->objective)) {
    a->has_solution = 0;
    return status_set(EXM_ERROR_NUMERIC, "the solve broke down: the objective is not finite");
  }
  a->has_solution = 1;
  return EXM_OK;
}
