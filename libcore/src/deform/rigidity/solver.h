/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Local and global steps [Rigidity, 3.2] with Anderson acceleration [Peng et al., "Anderson acceleration for geometry
 * optimization and physics simulation", SIGGRAPH 2018]: a mixed step is taken only where it has less energy. */
#ifndef EXM_DEFORM_RIGIDITY_SOLVER_H
#define EXM_DEFORM_RIGIDITY_SOLVER_H

#include "deform/rigidity/system.h"
#include "numeric/anderson.h"

/** What is solved, none of it owned. */
typedef struct rigidity_problem {
  const spokes *s;
  const uint32_t *components; /* [V] */
  const set_sums *balls;
  const held *h;
  rigidity_system *system;
} rigidity_problem;

typedef struct rigidity_state {
  double *positions; /* [V][3] */
  row12 *rotations;  /* [V] transposed: row12 b holds the column b of R */
  double *gains;     /* [V] tr R_k' S_k */
  row12 *disc_rotations;
  double energy;
} rigidity_state;

typedef struct rigidity_solver {
  rigidity_state now, next;
  row12 *moments, *sums, *scratch; /* [V]: C_i; S_k or T_i; scratch */
  double *image;                   /* [V][3] */
  double *partial;                 /* sums over pieces of the vertices */
  anderson mixing;
  int thread_count;
} rigidity_solver;

typedef struct rigidity_options {
  double tolerance;
  int iterations, has_acceleration, thread_count;
} rigidity_options;

/** Without room for the rotations of discs, which come with the problem. */
exm_status solver_create(arena *owner, size_t vertex_count, rigidity_solver *out);

/** The identity everywhere. */
void solver_identity(const rigidity_problem *problem, row12 *rotations, row12 *disc_rotations);

/** The local step: best rotations of a state's positions, and its energy. */
void solver_fit(rigidity_solver *solver, const rigidity_problem *problem, rigidity_state *state);

/**
 * Minimise, from the rotations in solver->next; the result is in solver->now. Where the first step fails, the only one
 * that can, solver->now has not changed.
 */
exm_status solver_run(rigidity_solver *solver, const rigidity_problem *problem, const double *targets,
                      const rigidity_options *options, exm_solve_report *report);

#endif
