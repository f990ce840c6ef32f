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
  size_t const barrier = capacity < CONE_BARRIER_MAXIMUM ? capacity : CONE_BARRIER_MAXIMUM;
  work.inner = ARENA_NEW(owner, double, capacity);
  work.schur = ARENA_NEW(owner, double, barrier *barrier);
  work.response = ARENA_NEW(owner, double, barrier *barrier);
  if (!work.residual || !work.gradient || !work.direction || !work.reduced || !work.slope_q || !work.slope_l ||
      !work.free_of || !work.pivot_of || !work.is_free || !work.inner || !work.schur || !work.response) {
    return status_no_memory("the cone program");
  }
  *out = work;
  return EXM_OK;
}

/* The root is smoothed to sqrt(q + (SMOOTHING * scale)^2). Where exemplars can meet the handles exactly, q = 0
 * is a ridge along which l alone decides: without smoothing the gradient there is rounding over rounding. Smoothing
 * raises f by less than that share of its scale. */
static double const SMOOTHING = 1e-9;
/* A gap, relative to the scale, that faces should not end with. */
static double const STUCK = 1e-6;
/* The barrier falls by this factor; entries below DUST are cleared at its end. */
static double const BARRIER_FACTOR = 0.2, DUST = 1e-7;
enum { BARRIER_STEPS = 80 };

/** f at B and what belongs to it: the residual QB - p and the gradient. */
typedef struct cone_point {
  double quadratic, root, value, gap;
  double size;   /* of the terms that cancel in q */
  double scale;  /* of f */
  double smooth; /* what the root adds to q */
} cone_point;

static cone_point evaluate(const cone_program *program, cone_workspace *work, const double *B, double smoothing)
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
  point.scale = program->scale > 0 ? program->scale : sqrt(point.size);
  point.smooth = smoothing * smoothing * point.scale * point.scale + DBL_MIN;
  point.quadratic = fmax(curvature / 2 - linear + program->k, 0);
  point.root = sqrt(point.quadratic + point.smooth);
  point.value = point.root + cost;
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
  double const lowest = fmax(point.quadratic - descent / 2, 0) + point.smooth;
  double const room = 1 - 2 * steepness;
  double t = 2e3 * (point.root + point.scale);
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

/** The point of each block's simplex closest to trial: max(trial - t, 0), t found by leaving out what it makes negative
 * until nothing is (Michelot 1986). */
static void project_blocks(const cone_program *program, double *trial)
{
  for (size_t b = 0; b < program->block_count; b++) {
    size_t const first = program->offsets[b], last = program->offsets[b + 1];
    double threshold = -DBL_MAX;
    size_t kept = last - first + 1, before;
    do {
      double sum = 0;
      before = kept;
      kept = 0;
      for (size_t i = first; i < last; i++) {
        sum += trial[i] > threshold ? trial[i] : 0;
        kept += trial[i] > threshold;
      }
      threshold = (sum - 1) / (double)kept;
    } while (kept < before);
    for (size_t i = first; i < last; i++) {
      trial[i] = trial[i] > threshold ? trial[i] - threshold : 0;
    }
  }
}

/** The whole of work->direction, projected: takes all that blocks off the face at once, where f falls by it. */
static int step_projected(const cone_program *program, cone_workspace *work, double *B, cone_point *point)
{
  double *trial = work->inner;
  for (size_t i = 0; i < program->count; i++) {
    trial[i] = work->is_free[i] ? B[i] + work->direction[i] : -DBL_MAX;
  }
  project_blocks(program, trial);
  cone_point const next = evaluate(program, work, trial, SMOOTHING);
  if (!(next.value < point->value)) {
    *point = evaluate(program, work, B, SMOOTHING);
    return 0;
  }
  for (size_t i = 0; i < program->count; i++) {
    B[i] = trial[i];
    work->is_free[i] = trial[i] > 0;
  }
  *point = next;
  return 1;
}

static size_t count_blocking(const cone_program *program, const cone_workspace *work, const double *B)
{
  size_t count = 0;
  for (size_t i = 0; i < program->count; i++) {
    count += B[i] + work->direction[i] < 0;
  }
  return count;
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
    if (count_blocking(program, work, B) > 1 && step_projected(program, work, B, point)) {
      continue;
    }
    double const share = step_to_boundary(program, work, B);
    *point = evaluate(program, work, B, SMOOTHING);
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

/** Correct x = H^-1 g, in work->direction, so that each block of it sums to zero: x - H^-1 E' (E H^-1 E')^-1 E x. The
 * factor of H is in work->reduced. */
static int keep_sums(const cone_program *program, cone_workspace *work)
{
  size_t const n = program->count, blocks = program->block_count;
  double *schur = work->schur, *response = work->response;
  for (size_t b = 0; b < blocks; b++) {
    double *column = response + b * n;
    memset(column, 0, n * sizeof(double));
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      column[i] = 1;
    }
    dense_cholesky_forward(n, work->reduced, column);
  }
  for (size_t a = 0; a < blocks; a++) {
    for (size_t b = 0; b <= a; b++) {
      schur[a * blocks + b] = dense_dot(n, response + a * n, response + b * n);
    }
    work->slope_l[a] = 0;
    for (size_t i = program->offsets[a]; i < program->offsets[a + 1]; i++) {
      work->slope_l[a] += work->direction[i];
    }
  }
  if (!dense_cholesky(blocks, schur)) {
    return 0;
  }
  dense_cholesky_forward(blocks, schur, work->slope_l);
  dense_cholesky_backward(blocks, schur, work->slope_l);
  memset(work->slope_q, 0, n * sizeof(double));
  for (size_t b = 0; b < blocks; b++) {
    dense_axpy(n, work->slope_l[b], response + b * n, work->slope_q);
  }
  dense_cholesky_backward(n, work->reduced, work->slope_q);
  dense_axpy(n, -1, work->slope_q, work->direction);
  return 1;
}

/** Newton's step for f - mu sum log B with the sums of the blocks kept, into work->direction. The Hessian of the root
 * is Q / (2 s) - r r' / (4 s^3). Returns the squared Newton decrement, or -1 where the step could not be had. */
static double barrier_step(const cone_program *program, cone_workspace *work, cone_point point, const double *B,
                           double mu)
{
  size_t const n = program->count;
  double decrement = 0;
  for (size_t i = 0; i < n; i++) {
    double const *Q = program->Q + i * n;
    double const scaled = work->residual[i] / (4 * point.root * point.root * point.root);
    for (size_t j = 0; j <= i; j++) {
      work->reduced[i * n + j] = Q[j] / (2 * point.root) - scaled * work->residual[j];
    }
    work->reduced[i * n + i] += mu / (B[i] * B[i]);
    work->direction[i] = -(work->gradient[i] - mu / B[i]);
  }
  if (!dense_cholesky(n, work->reduced)) {
    return -1;
  }
  dense_cholesky_forward(n, work->reduced, work->direction);
  dense_cholesky_backward(n, work->reduced, work->direction);
  if (!keep_sums(program, work)) {
    return -1;
  }
  for (size_t i = 0; i < n; i++) {
    decrement -= work->direction[i] * (work->gradient[i] - mu / B[i]);
  }
  return decrement;
}

static double barrier_value(const cone_program *program, cone_point point, const double *B, double mu)
{
  double value = point.value;
  for (size_t i = 0; i < program->count; i++) {
    value -= mu * log(B[i]);
  }
  return value;
}

/** Go along work->direction, staying inside, until the barrier function falls. */
static int barrier_search(const cone_program *program, cone_workspace *work, double mu, double smoothing,
                          double decrement, double *B, cone_point *point)
{
  double share = 1;
  for (size_t i = 0; i < program->count; i++) {
    if (work->direction[i] < 0) {
      share = fmin(share, -0.95 * B[i] / work->direction[i]);
    }
  }
  double const before = barrier_value(program, *point, B, mu);
  for (int halving = 0; halving < 30; halving++, share /= 2) {
    for (size_t i = 0; i < program->count; i++) {
      work->slope_q[i] = B[i] + share * work->direction[i];
    }
    cone_point const next = evaluate(program, work, work->slope_q, smoothing);
    if (barrier_value(program, next, work->slope_q, mu) <= before - 1e-4 * share * decrement) {
      memcpy(B, work->slope_q, program->count * sizeof(double));
      *point = next;
      return 1;
    }
  }
  *point = evaluate(program, work, B, smoothing);
  return 0;
}

/** Follow the central path from an interior point, root's smoothing and barrier falling together. B in and out. */
static cone_point follow_path(const cone_program *program, cone_workspace *work, double tolerance, double *B)
{
  size_t const n = program->count;
  cone_point point = evaluate(program, work, B, 1e-2);
  double mu = fmax(point.gap, 1e-3 * point.scale) / (double)n;
  double const last = tolerance * point.scale / (double)n;
  for (int step = 0; step < BARRIER_STEPS && mu > last; step++) {
    double const smoothing = fmax(SMOOTHING, fmin(1e-2, mu * (double)n / point.scale));
    point = evaluate(program, work, B, smoothing);
    double const decrement = barrier_step(program, work, point, B, mu);
    if (decrement < 0 || (decrement > mu && !barrier_search(program, work, mu, smoothing, decrement, B, &point)) ||
        decrement <= mu) {
      mu *= BARRIER_FACTOR;
    }
  }
  return evaluate(program, work, B, SMOOTHING);
}

/** From where faces got stuck: the interior solution, cleared of its dust, where that is better. */
static void solve_inside(const cone_program *program, cone_workspace *work, double tolerance, double *B,
                         cone_point *best)
{
  double *inner = work->inner;
  for (size_t b = 0; b < program->block_count; b++) {
    size_t const size = program->offsets[b + 1] - program->offsets[b];
    for (size_t i = program->offsets[b]; i < program->offsets[b + 1]; i++) {
      inner[i] = 0.7 * B[i] + 0.3 / (double)size;
    }
  }
  cone_point const point = follow_path(program, work, tolerance, inner);
  if (point.value >= best->value) {
    best->gap = fmin(best->gap, fmax(best->value - point.value, 0) + point.gap);
    return;
  }
  memcpy(B, inner, program->count * sizeof(double));
  for (size_t i = 0; i < program->count; i++) {
    B[i] = B[i] < DUST ? 0 : B[i];
  }
  normalise_blocks(program, B);
  cone_point cleared = evaluate(program, work, B, SMOOTHING);
  if (cleared.value > point.value + tolerance * point.scale) {
    memcpy(B, inner, program->count * sizeof(double));
    cleared = point;
  }
  cleared.gap = fmin(cleared.gap, fmax(cleared.value - point.value, 0) + point.gap);
  *best = cleared;
}

void cone_solve(const cone_program *program, cone_workspace *work, double tolerance, double *B, cone_result *result)
{
  *result = (cone_result){0};
  cone_point point = evaluate(program, work, B, SMOOTHING);
  int only_steepest = 0;
  while (point.gap > tolerance * point.scale && result->factorings < FACE_CAP) {
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
  if (point.gap > STUCK * point.scale && program->count <= CONE_BARRIER_MAXIMUM) {
    solve_inside(program, work, tolerance, B, &point);
  }
  normalise_blocks(program, B);
  result->value = point.value - point.root + sqrt(point.quadratic);
  result->quadratic = point.quadratic;
  result->gap = point.gap;
}
