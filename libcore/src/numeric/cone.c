/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/cone.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* More faces than this are never needed in practice (a cold start visits about a dozen); a cap all the same. */
enum { FACE_CAP = 200 };

exm_status cone_workspace_create(arena *owner, size_t capacity, cone_workspace *out)
{
  cone_workspace work = {.capacity = capacity};
  work.residual = ARENA_NEW(owner, double, capacity);
  work.gradient = ARENA_NEW(owner, double, capacity);
  work.direction = ARENA_NEW(owner, double, capacity);
  work.reduced = ARENA_NEW(owner, double, capacity *capacity);
  work.slope_q = ARENA_NEW(owner, double, capacity);
  work.slope_l = ARENA_NEW(owner, double, capacity);
  work.free_of = ARENA_NEW(owner, size_t, capacity);
  work.pivot_of = ARENA_NEW(owner, size_t, capacity);
  work.is_free = ARENA_NEW(owner, unsigned char, capacity);
  work.is_barred = ARENA_NEW(owner, unsigned char, capacity);
  if (!work.residual || !work.gradient || !work.direction || !work.reduced || !work.slope_q || !work.slope_l ||
      !work.free_of || !work.pivot_of || !work.is_free || !work.is_barred) {
    return status_no_memory("the cone program");
  }
  *out = work;
  return EXM_OK;
}

/** f at B and what belongs to it: the residual QB - p and the gradient. */
typedef struct cone_point {
  double quadratic, root, value, gap;
  double size; /* of the terms that cancel in q: what rounding is relative to */
} cone_point;

static cone_point evaluate(const cone_program *program, cone_workspace *work, const double *B)
{
  cone_point point = {0};
  double curvature = 0, linear = 0, cost = 0;
  for (size_t i = 0; i < program->count; i++) {
    work->residual[i] = -program->p[i];
  }
  for (size_t j = 0; j < program->count; j++) {
    if (B[j] != 0) {
      dense_axpy(program->count, B[j], program->Q + j * program->count, work->residual);
    }
  }
  for (size_t i = 0; i < program->count; i++) {
    curvature += B[i] * (work->residual[i] + program->p[i]);
    linear += B[i] * program->p[i];
    cost += B[i] * program->l[i];
  }
  point.size = fabs(curvature) / 2 + fabs(linear) + program->k;
  /* q is a difference of terms of this size: below its rounding it is zero. The floor keeps the gradient finite where
   * an exemplar is met exactly. */
  double const floor = 4 * DBL_EPSILON * point.size;
  point.quadratic = fmax(curvature / 2 - linear + program->k, 0);
  point.root = sqrt(fmax(point.quadratic, floor));
  point.value = sqrt(point.quadratic) + cost;
  if (point.root == 0) {
    point.root = DBL_MIN;
  }
  for (size_t i = 0; i < program->count; i++) {
    work->gradient[i] = work->residual[i] / (2 * point.root) + program->l[i];
  }
  for (size_t b = 0; b < program->block_count; b++) {
    double lowest = DBL_MAX, mean = 0;
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      lowest = fmin(lowest, work->gradient[i]);
      mean += B[i] * work->gradient[i];
    }
    point.gap += mean - lowest;
  }
  return point;
}

/** Free the unknown of steepest descent in each block that has one outside the support, or in the steepest block only.
 *  Returns how many were freed. */
static size_t free_descents(const cone_program *program, cone_workspace *work, const double *B, int only_steepest)
{
  size_t freed = 0, steepest = SIZE_MAX;
  double best = 0;
  for (size_t b = 0; b < program->block_count; b++) {
    size_t lowest = program->offsets[b];
    double mean = 0;
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      mean += B[i] * work->gradient[i];
      if (work->gradient[i] < work->gradient[lowest]) {
        lowest = i;
      }
    }
    double const descent = mean - work->gradient[lowest];
    if (B[lowest] > 0 || descent <= 0) {
      continue;
    }
    if (!only_steepest) {
      work->is_free[lowest] = 1;
      freed++;
    } else if (descent > best) {
      best = descent;
      steepest = lowest;
    }
  }
  if (steepest != SIZE_MAX) {
    work->is_free[steepest] = 1;
    freed = 1;
  }
  return freed;
}

/** Coordinates of the face: in each block all free unknowns but the largest, which takes up the difference. */
static size_t face_coordinates(const cone_program *program, cone_workspace *work, const double *B)
{
  size_t coordinates = 0;
  for (size_t b = 0; b < program->block_count; b++) {
    size_t pivot = program->offsets[b];
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      if (B[i] > B[pivot]) {
        pivot = i;
      }
    }
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      if (work->is_free[i] && i != pivot) {
        work->free_of[coordinates] = i;
        work->pivot_of[coordinates] = pivot;
        coordinates++;
      }
    }
  }
  return coordinates;
}

static void reduced_hessian(const cone_program *program, cone_workspace *work, size_t coordinates)
{
  double trace = 0;
  for (size_t i = 0; i < coordinates; i++) {
    const double *free_row = program->Q + work->free_of[i] * program->count;
    const double *pivot_row = program->Q + work->pivot_of[i] * program->count;
    double *row = work->reduced + i * coordinates;
    for (size_t j = 0; j <= i; j++) {
      size_t const f = work->free_of[j], v = work->pivot_of[j];
      row[j] = free_row[f] - free_row[v] - pivot_row[f] + pivot_row[v];
    }
    trace += row[i];
  }
  /* Exemplars that agree in a region give equal columns: the shift makes their share of the blend unique. */
  double const shift = 1e-11 * trace / (double)coordinates + DBL_MIN;
  for (size_t i = 0; i < coordinates; i++) {
    work->reduced[i * coordinates + i] += shift;
  }
}

/** Spread reduced coordinates over B's unknowns. */
static void expand(const cone_program *program, cone_workspace *work, size_t coordinates, const double *reduced)
{
  memset(work->direction, 0, program->count * sizeof(double));
  for (size_t i = 0; i < coordinates; i++) {
    work->direction[work->free_of[i]] += reduced[i];
    work->direction[work->pivot_of[i]] -= reduced[i];
  }
}

/** The step from B to the minimiser of f on the face, in work->direction; 0 where the face's Hessian is not definite.
 *
 *  With A the Hessian, w = a + t v, a = -A^-1 grad q, v = -A^-1 grad l: stationarity asks for t = 2 sqrt(q(w)), and
 *  q(w) = q(a) + t^2/2 v'Av, hence q(w) (1 - 2 v'Av) = q(a). Where 2 v'Av >= 1, f falls forever along v. */
static int face_step(const cone_program *program, cone_workspace *work, size_t coordinates, cone_point point)
{
  reduced_hessian(program, work, coordinates);
  if (!dense_cholesky(coordinates, work->reduced)) {
    return 0;
  }
  double descent = 0, steepness = 0;
  for (size_t i = 0; i < coordinates; i++) {
    size_t const f = work->free_of[i], v = work->pivot_of[i];
    work->slope_q[i] = work->direction[i] = -(work->residual[f] - work->residual[v]);
    work->slope_l[i] = -(program->l[f] - program->l[v]);
  }
  dense_cholesky_forward(coordinates, work->reduced, work->slope_q);
  dense_cholesky_forward(coordinates, work->reduced, work->slope_l);
  for (size_t i = 0; i < coordinates; i++) {
    descent += work->slope_q[i] * work->slope_q[i];
    steepness += work->slope_l[i] * work->slope_l[i];
  }
  double const lowest = fmax(point.quadratic - descent / 2, 0);
  double const room = 1 - 2 * steepness;
  double t = 2e3 * (point.root + sqrt(point.size));
  if (room > 0) {
    t = fmin(t, 2 * sqrt(lowest / room));
  }
  for (size_t i = 0; i < coordinates; i++) {
    work->slope_q[i] += t * work->slope_l[i];
  }
  dense_cholesky_backward(coordinates, work->reduced, work->slope_q);
  expand(program, work, coordinates, work->slope_q);
  return 1;
}

/** Go along work->direction as far as B stays non-negative; what blocks leaves the face. Returns the share gone. */
static double step_to_boundary(const cone_program *program, cone_workspace *work, double *B)
{
  double share = 1;
  size_t blocking = SIZE_MAX;
  for (size_t i = 0; i < program->count; i++) {
    if (work->direction[i] < 0 && B[i] + share * work->direction[i] < 0) {
      share = B[i] / -work->direction[i];
      blocking = i;
    }
  }
  for (size_t i = 0; i < program->count; i++) {
    B[i] = fmax(B[i] + share * work->direction[i], 0);
  }
  if (blocking != SIZE_MAX) {
    B[blocking] = 0;
    work->is_free[blocking] = 0;
  }
  return share;
}

/** Minimise over the current face, dropping what blocks, until a face's own minimiser is reached. */
static void descend(const cone_program *program, cone_workspace *work, double *B, cone_point *point,
                    cone_result *result)
{
  for (size_t pass = 0; pass <= program->count; pass++) {
    size_t const coordinates = face_coordinates(program, work, B);
    if (coordinates == 0 || result->factorings >= FACE_CAP) {
      return;
    }
    result->factorings++;
    if (!face_step(program, work, coordinates, *point)) {
      return;
    }
    double const share = step_to_boundary(program, work, B);
    *point = evaluate(program, work, B);
    if (share >= 1) {
      return;
    }
  }
}

static void normalise_blocks(const cone_program *program, double *B)
{
  for (size_t b = 0; b < program->block_count; b++) {
    double sum = 0;
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      sum += B[i];
    }
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      B[i] /= sum;
    }
  }
}

void cone_solve(const cone_program *program, cone_workspace *work, double tolerance, double *B, cone_result *result)
{
  *result = (cone_result){0};
  cone_point point = evaluate(program, work, B);
  int only_steepest = 0;
  while (point.gap > tolerance * sqrt(point.size) && result->factorings < FACE_CAP) {
    double const before = point.value;
    for (size_t i = 0; i < program->count; i++) {
      work->is_free[i] = B[i] > 0;
    }
    free_descents(program, work, B, only_steepest);
    descend(program, work, B, &point, result);
    /* Several unknowns freed at once can block one another; one alone cannot. */
    int const stalled = point.value >= before - 1e-14 * fabs(before);
    if (stalled && only_steepest) {
      break;
    }
    only_steepest = stalled;
  }
  normalise_blocks(program, B);
  result->value = point.value;
  result->quadratic = point.quadratic;
  result->gap = point.gap;
}
