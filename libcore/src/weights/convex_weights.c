/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Weights of one vertex: minimise |sum_b w_b y_b - p|^2 over w >= 0, sum w = 1, with few w_b that are not 0; y_b is
 * where bone b takes the vertex, in all poses. Bones are taken in one by one, that of the steepest descent first; a
 * bone whose weight would become negative goes out again. Nothing is accepted that does not lower the error. */
#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "weights/decomposition.h"

/* Weights below this are none. */
static double const LEAST_WEIGHT = 1e-4;
enum { MOST = DECOMPOSITION_INFLUENCES, BORDERED = MOST + 1 };

/** Solves the bordered system of a support of `count`: minimiser of 1/2 w'Gw - g'w with sum w = 1; 0 where singular. */
static int solve_bordered(size_t count, double G[MOST][MOST], const double *g, double *w)
{
  size_t const n = count + 1;
  double A[BORDERED][BORDERED + 1];
  double trace = 0;
  for (size_t i = 0; i < count; i++) {
    trace += G[i][i];
  }
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < n; j++) {
      A[i][j] = i < count && j < count ? G[i][j] : (i == j ? 0 : trace);
    }
    A[i][n] = i < count ? g[i] : trace;
  }
  for (size_t i = 0; i < count; i++) {
    A[i][i] += 1e-10 * trace;
  }
  for (size_t c = 0; c < n; c++) {
    size_t pivot = c;
    for (size_t r = c + 1; r < n; r++) {
      pivot = fabs(A[r][c]) > fabs(A[pivot][c]) ? r : pivot;
    }
    if (!(fabs(A[pivot][c]) > 1e-14 * trace)) {
      return 0;
    }
    for (size_t k = 0; k <= n; k++) {
      double const kept = A[c][k];
      A[c][k] = A[pivot][k];
      A[pivot][k] = kept;
    }
    for (size_t r = 0; r < n; r++) {
      double const factor = r == c ? 0 : A[r][c] / A[c][c];
      for (size_t k = c; k <= n && factor != 0; k++) {
        A[r][k] -= factor * A[c][k];
      }
    }
  }
  for (size_t i = 0; i < count; i++) {
    w[i] = A[i][n] / A[i][i];
  }
  return 1;
}

typedef struct support {
  size_t count;
  uint32_t bones[MOST];
  double weights[MOST];
} support;

/** The vertex as bones move it: misses [bones][3 S] y_b - p. */
typedef struct vertex_problem {
  size_t bone_count, length;
  const double *misses;
} vertex_problem;

static void residual_of(const vertex_problem *p, const support *s, double *out)
{
  memset(out, 0, p->length * sizeof(double));
  for (size_t i = 0; i < s->count; i++) {
    dense_axpy(p->length, s->weights[i], p->misses + s->bones[i] * p->length, out);
  }
}

/** The best weights on a support, and on what is left of it where some would be negative. Since weights sum to one,
 *  sum w y - p = sum w (y - p): a quadratic form in the misses, without a linear term. */
static void settle(const vertex_problem *p, support *s)
{
  double G[MOST][MOST];
  double const zero[MOST] = {0};
  for (;;) {
    for (size_t i = 0; i < s->count; i++) {
      for (size_t j = 0; j < s->count; j++) {
        G[i][j] = dense_dot(p->length, p->misses + s->bones[i] * p->length, p->misses + s->bones[j] * p->length);
      }
    }
    if (s->count == 1 || !solve_bordered(s->count, G, zero, s->weights)) {
      s->count = 1;
      s->weights[0] = 1;
      return;
    }
    size_t worst = 0;
    for (size_t i = 1; i < s->count; i++) {
      worst = s->weights[i] < s->weights[worst] ? i : worst;
    }
    if (s->weights[worst] >= LEAST_WEIGHT) {
      return;
    }
    s->count--;
    s->bones[worst] = s->bones[s->count];
  }
}

/** Error of a support; residual [length] is filled in. */
static double error_of(const vertex_problem *p, const support *s, double *residual)
{
  residual_of(p, s, residual);
  return dense_dot(p->length, residual, residual);
}

static int is_in(const support *s, size_t bone)
{
  for (size_t i = 0; i < s->count; i++) {
    if (s->bones[i] == bone) {
      return 1;
    }
  }
  return 0;
}

/** residual: scratch [2][length]. */
static void weigh_vertex(const vertex_problem *p, size_t influence_limit, double *residual, support *out)
{
  support best = {.count = 1, .weights = {1}};
  double *tried = residual + p->length;
  double least = INFINITY;
  for (size_t b = 0; b < p->bone_count; b++) {
    double const miss = dense_dot(p->length, p->misses + b * p->length, p->misses + b * p->length);
    if (miss < least) {
      least = miss;
      best.bones[0] = (uint32_t)b;
    }
  }
  least = error_of(p, &best, residual);
  while (best.count < influence_limit && least > 0) {
    double steepest = least;
    size_t next = p->bone_count;
    for (size_t b = 0; b < p->bone_count; b++) {
      double const slope = dense_dot(p->length, residual, p->misses + b * p->length);
      if (slope < steepest && !is_in(&best, b)) {
        steepest = slope;
        next = b;
      }
    }
    if (next == p->bone_count) {
      break;
    }
    support wider = best;
    wider.bones[wider.count++] = (uint32_t)next;
    settle(p, &wider);
    double const error = error_of(p, &wider, tried);
    if (!(error < least * (1 - 1e-6))) {
      break;
    }
    best = wider;
    least = error;
    memcpy(residual, tried, p->length * sizeof(double));
  }
  *out = best;
}

/** The old weights with the new transforms, if they are better still: then no round makes the error larger. */
static void keep_better(const decomposition *d, const vertex_problem *p, size_t v, double *residual, support *found)
{
  support old = {.count = d->counts[v]};
  for (size_t i = 0; i < old.count; i++) {
    old.bones[i] = d->bones[v * d->influence_limit + i];
    old.weights[i] = d->weights[v * d->influence_limit + i];
  }
  if (old.count > 0) {
    support improved = old;
    settle(p, &improved);
    double const found_error = error_of(p, found, residual), old_error = error_of(p, &old, residual);
    double const improved_error = error_of(p, &improved, residual);
    *found = improved_error < found_error && improved_error <= old_error ? improved
             : old_error < found_error                                   ? old
                                                                         : *found;
  }
}

exm_status decomposition_weigh(decomposition *d)
{
  size_t const V = d->reference->vertex_count, S = d->pose_count, length = 3 * S;
  arena scratch = {0};
  double *misses = ARENA_NEW(&scratch, double, d->bone_count *length);
  double *residual = ARENA_NEW(&scratch, double, 2 * length);
  exm_status const status = misses && residual ? EXM_OK : status_no_memory("the decomposition");
  vertex_problem const problem = {.bone_count = d->bone_count, .length = length, .misses = misses};
  for (size_t v = 0; v < V && status == EXM_OK; v++) {
    const double *x = d->reference->positions[v];
    for (size_t b = 0; b < d->bone_count; b++) {
      for (size_t s = 0; s < S; s++) {
        const bone_transform *t = &d->transforms[b * S + s];
        const float *p = d->poses + (s * V + v) * 3;
        for (size_t k = 0; k < 3; k++) {
          misses[b * length + 3 * s + k] = t->turn[3 * k] * x[0] + t->turn[3 * k + 1] * x[1] +
                                           t->turn[3 * k + 2] * x[2] + t->shift[k] - (double)p[k];
        }
      }
    }
    support found;
    weigh_vertex(&problem, d->influence_limit, residual, &found);
    keep_better(d, &problem, v, residual, &found);
    d->counts[v] = (unsigned char)found.count;
    for (size_t i = 0; i < found.count; i++) {
      d->bones[v * d->influence_limit + i] = found.bones[i];
      d->weights[v * d->influence_limit + i] = found.weights[i];
    }
  }
  arena_release(&scratch);
  return status;
}
