/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The cone program over simplices [AMRAP, eq. 20 with the coefficients eliminated]
 *
 *     minimise  f(B) = sqrt(q(B)) + l'B,   q(B) = 1/2 B'QB - p'B + k >= 0,
 *     subject to  B >= 0  and  sum of B over each block = 1,
 *
 * by a primal active-set method that needs no outer loop for the square root: on a face, the minimiser of f lies on the
 * line  a + t v  (a minimises q, v is steepest for l in the metric of Q) at a t known in closed form. Every step
 * decreases f, so the method ends; the Frank-Wolfe gap certifies the result.
 *
 * Where q vanishes on a whole set (few handles that several blends of exemplars can meet exactly), faces see only
 * noise: moving within the set takes all blocks at once. Such programs are handed to a barrier method, which has no
 * faces. */
#ifndef EXM_NUMERIC_CONE_H
#define EXM_NUMERIC_CONE_H

#include "base/memory.h"
#include "base/status.h"

typedef struct cone_program {
  size_t count;          /* unknowns */
  size_t block_count;    /* simplices */
  const size_t *offsets; /* [block_count + 1] block b owns unknowns offsets[b] .. offsets[b + 1], at least one */
  const double *Q;       /* [count][count] symmetric, positive semidefinite to rounding */
  const double *p;       /* [count] */
  const double *l;       /* [count] >= 0 */
  double k;
  double scale; /* what f is small relative to; 0: found from the terms of q */
} cone_program;

typedef struct cone_result {
  double value;      /* f */
  double quadratic;  /* q, floored at 0 */
  double gap;        /* f is above its optimum by at most this */
  size_t factorings; /* faces visited */
} cone_result;

/* Programs of more unknowns than this do without the interior method. */
enum { CONE_BARRIER_MAXIMUM = 256 };

/** Room for programs of up to a number of unknowns; lives in an arena. */
typedef struct cone_workspace {
  size_t capacity;
  double *residual; /* Q B - p */
  double *gradient;
  double *direction; /* in B */
  double *reduced;   /* the face's Hessian and its factor */
  double *slope_q, *slope_l;
  size_t *free_of; /* unknown behind each reduced coordinate */
  size_t *pivot_of;
  unsigned char *is_free;
  /* For the barrier method: an interior point, the blocks' Schur complement and what it is made of. */
  double *inner, *schur, *response;
} cone_workspace;

exm_status cone_workspace_create(arena *owner, size_t capacity, cone_workspace *out);

/**
 * B  [count] in: where to start, feasible; out: the solution, feasible to rounding
 *
 * Stops at a gap of `tolerance` times the scale. Never fails: the best point found is returned with its
 * gap.
 */
void cone_solve(const cone_program *program, cone_workspace *work, double tolerance, double *B, cone_result *result);

#endif
