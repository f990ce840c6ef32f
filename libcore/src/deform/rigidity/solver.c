/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/solver.h"

#include <math.h>
#include <string.h>

#include "deform/rigidity/fit.h"

/* Vertices that one thread takes at a time; sums are added piece by piece, in order, whatever the threads. */
enum { PIECE = 512, DEPTH = 5 };

/* Energies are differences of numbers of the size of the rest energy: closer to each other than this share of it they
 * are equal. */
static double const ROUNDING = 1e-13;

exm_status solver_create(arena *owner, size_t vertex_count, rigidity_solver *out)
{
  size_t const V = vertex_count, pieces = (V + PIECE - 1) / PIECE;
  rigidity_solver s = {.moments = ARENA_NEW(owner, row12, V),
                       .sums = ARENA_NEW(owner, row12, V),
                       .scratch = ARENA_NEW(owner, row12, V),
                       .image = ARENA_NEW(owner, double, 3 * V),
                       .partial = ARENA_NEW(owner, double, pieces)};
  rigidity_state *const states[] = {&s.now, &s.next};
  int is_there = s.moments && s.sums && s.scratch && s.image && s.partial;
  for (int i = 0; i < 2; i++) {
    states[i]->positions = ARENA_NEW(owner, double, 3 * V);
    states[i]->rotations = ARENA_NEW(owner, row12, V);
    states[i]->gains = ARENA_NEW(owner, double, V);
    is_there = is_there && states[i]->positions && states[i]->rotations && states[i]->gains;
  }
  if (!is_there) {
    return status_no_memory("the deformer");
  }
  s.thread_count = 1;
  TRY(anderson_create(owner, 3 * V, DEPTH, &s.mixing));
  *out = s;
  return EXM_OK;
}

static size_t piece_count(const rigidity_problem *problem)
{
  return (problem->s->around.vertex_count + PIECE - 1) / PIECE;
}

static size_t piece_end(const rigidity_problem *problem, size_t piece)
{
  size_t const V = problem->s->around.vertex_count;
  return (piece + 1) * PIECE < V ? (piece + 1) * PIECE : V;
}

void solver_identity(const rigidity_problem *problem, row12 *rotations, row12 *disc_rotations)
{
  double const identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  for (size_t v = 0; v < problem->s->around.vertex_count; v++) {
    memcpy(&rotations[v], identity, sizeof identity);
  }
  for (size_t d = 0; d < problem->h->disc_count; d++) {
    memcpy(&disc_rotations[d], identity, sizeof identity);
  }
}

/* -------------------------------------------------------------------------------------------------------- local step
 */

/* Adds up what discs gain. */
static double fit_discs(const rigidity_solver *solver, const rigidity_problem *problem, row12 *rotations)
{
  const held *h = problem->h;
  double total = 0;
  for (size_t d = 0; d < h->disc_count; d++) {
    row12 sum = {0};
    double gain;
    for (uint32_t i = h->disc_offsets[d]; i < h->disc_offsets[d + 1]; i++) {
      for (int part = 0; part < 3; part++) {
        four_axpy(&sum.part[part], problem->system->disc_weights[i], &solver->moments[h->disc_vertices[i]].part[part]);
      }
    }
    fit_rotations(&sum, 0, 1, &rotations[d], &gain);
    total += gain;
  }
  return total;
}

void solver_fit(rigidity_solver *solver, const rigidity_problem *problem, rigidity_state *state)
{
  size_t const pieces = piece_count(problem);
  int const threads = solver->thread_count;
  row12 *sums = problem->balls->is_identity ? solver->moments : solver->sums;
  double gain = 0, energy = 0;
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
  for (size_t i = 0; i < pieces; i++) {
    solver->partial[i] = spokes_moments(problem->s, i * PIECE, piece_end(problem, i), state->positions,
                                        problem->system->multiplicity, solver->moments);
  }
  if (!problem->balls->is_identity) {
    set_sums_apply(problem->balls, threads, solver->moments, sums);
  }
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
  for (size_t i = 0; i < pieces; i++) {
    fit_rotations(sums, i * PIECE, piece_end(problem, i), state->rotations, state->gains);
    for (size_t v = i * PIECE; v < piece_end(problem, i); v++) {
      solver->partial[i] += problem->system->multiplicity[v] * problem->s->rest[v] - 2 * state->gains[v];
    }
  }
  for (size_t i = 0; i < pieces; i++) {
    energy += solver->partial[i];
  }
  gain = fit_discs(solver, problem, state->disc_rotations);
  energy -= 2 * gain;
  state->energy = energy < 0 ? 0 : energy; /* where it is not a number it stays none */
}

/* ------------------------------------------------------------------------------------------------------- global step
 */

static exm_status place(rigidity_solver *solver, const rigidity_problem *problem, const rigidity_state *state,
                        const double *targets, double *positions)
{
  const held *h = problem->h;
  size_t const pieces = piece_count(problem);
  int const threads = solver->thread_count;
  row12 *sums = solver->sums;
  set_sums_apply_transposed(problem->balls, threads, state->rotations, solver->scratch, sums);
  for (size_t d = 0; d < h->disc_count; d++) {
    for (uint32_t i = h->disc_offsets[d]; i < h->disc_offsets[d + 1]; i++) {
      for (int part = 0; part < 3; part++) {
        four_axpy(&sums[h->disc_vertices[i]].part[part], problem->system->disc_weights[i],
                  &state->disc_rotations[d].part[part]);
      }
    }
  }
#pragma omp parallel for num_threads(threads) schedule(static) if (threads > 1)
  for (size_t i = 0; i < pieces; i++) {
    spokes_forces(problem->s, i * PIECE, piece_end(problem, i), sums, positions);
  }
  return system_solve(problem->system, h, problem->components, targets, positions);
}

/* --------------------------------------------------------------------------------------------------------- iteration
 */

static void record(exm_solve_report *report, double energy)
{
  if (report->history && report->history_count < report->history_capacity) {
    report->history[report->history_count++] = energy;
  }
  report->iterations++;
}

static void swap(rigidity_solver *solver)
{
  rigidity_state const other = solver->now;
  solver->now = solver->next;
  solver->next = other;
}

/* next: positions after solver->now, and their energy. A mixed step that has more energy than there was is given up for
 * the plain one, which has not. Sets *is_mixed. */
static exm_status step(rigidity_solver *solver, const rigidity_problem *problem, const double *targets, int *is_mixed)
{
  rigidity_state *now = &solver->now, *next = &solver->next;
  size_t const bytes = 3 * problem->s->around.vertex_count * sizeof(double);
  int const wants_mixed = *is_mixed;
  *is_mixed = 0;
  TRY(place(solver, problem, now, targets, solver->image));
  if (wants_mixed) {
    memcpy(next->positions, now->positions, bytes);
    anderson_mix(&solver->mixing, solver->image, next->positions);
    if (solver->mixing.count > 0) {
      solver_fit(solver, problem, next);
      if (next->energy <= now->energy) {
        *is_mixed = 1;
        return EXM_OK;
      }
      anderson_reset(&solver->mixing);
    }
  }
  memcpy(next->positions, solver->image, bytes);
  solver_fit(solver, problem, next);
  return EXM_OK;
}

exm_status solver_run(rigidity_solver *solver, const rigidity_problem *problem, const double *targets,
                      const rigidity_options *options, exm_solve_report *report)
{
  double rest = 0;
  for (size_t v = 0; v < problem->s->around.vertex_count; v++) {
    rest += problem->system->multiplicity[v] * problem->s->rest[v];
  }
  TRY(place(solver, problem, &solver->next, targets, solver->image));
  memcpy(solver->next.positions, solver->image, 3 * problem->s->around.vertex_count * sizeof(double));
  solver_fit(solver, problem, &solver->next);
  anderson_reset(&solver->mixing);
  int is_mixed = 0;
  for (;;) {
    double const before = solver->now.energy, after = solver->next.energy;
    int const is_first = report->iterations == 0;
    if (is_first && !isfinite(after)) {
      return status_set(EXM_ERROR_NUMERIC, "targets: the deformation they ask for is too large for numbers to hold");
    }
    int const is_stuck = !is_first && !(after <= before); /* only rounding moves it */
    if (!is_stuck) {
      swap(solver);
      record(report, after);
    }
    int const is_small = !is_first && before - after <= options->tolerance * before;
    if (is_stuck || after <= ROUNDING * rest || (options->tolerance > 0 && is_small && !is_mixed)) {
      report->converged = options->tolerance > 0;
      break;
    }
    if (report->iterations >= options->iterations) {
      break;
    }
    /* A mixed step may gain little and open the way for more: it is a plain one that says whether this is the end. */
    is_mixed = options->has_acceleration && !(options->tolerance > 0 && is_small);
    TRY(step(solver, problem, targets, &is_mixed));
  }
  report->objective = report->elastic_energy = solver->now.energy;
  return EXM_OK;
}
