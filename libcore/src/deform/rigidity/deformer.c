/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/deformer.h"

#include <math.h>
#include <omp.h>
#include <string.h>

enum {
  MOST_THREADS = 8,
  WORTH_A_THREAD = 20000, /* vertices: with fewer, threads wait for each other for longer than they work */
  LARGE = 5000            /* vertices: stateless solves begin coarse */
};

static rigidity_problem problem_of(rigidity_deformer *deformer)
{
  return (rigidity_problem){.s = &deformer->edges,
                            .components = deformer->reference.components,
                            .balls = &deformer->reach.balls,
                            .h = &deformer->handles,
                            .system = &deformer->system};
}

static int choose_threads(const rigidity_deformer *deformer, int wanted)
{
  size_t const most = deformer->base.info.vertex_count / WORTH_A_THREAD + 1;
  int const processors = omp_get_max_threads() < MOST_THREADS ? omp_get_max_threads() : MOST_THREADS;
  int const chosen = wanted > 0 ? wanted : processors;
  return (size_t)chosen < most ? chosen : (int)most;
}

int rigidity_deformer_is_large(const rigidity_deformer *deformer)
{
  return deformer->base.info.vertex_count >= LARGE;
}

exm_status rigidity_deformer_coarsen(rigidity_deformer *deformer)
{
  coarse_source const fine = {.s = &deformer->edges,
                              .positions = (const double(*)[3])deformer->reference.positions,
                              .radii = deformer->reach.radii,
                              .h = &deformer->handles};
  if (!deformer->has_coarse) {
    TRY(coarse_create(&fine, &deformer->coarse));
    deformer->has_coarse = 1;
  }
  return EXM_OK;
}

static int wants_coarse(const rigidity_deformer *deformer, int coarse)
{
  return coarse > 0 || (coarse < 0 && rigidity_deformer_is_large(deformer));
}

static void turn_discs(const rigidity_problem *problem, rigidity_state *state)
{
  for (size_t d = 0; d < problem->h->disc_count; d++) {
    state->disc_rotations[d] = state->rotations[problem->h->disc_vertices[problem->h->disc_offsets[d]]];
  }
}

/* The identity, or what a coarser mesh says. */
static exm_status begin_stateless(rigidity_deformer *deformer, const rigidity_problem *problem, const double *targets,
                                  int coarse)
{
  rigidity_state *next = &deformer->solver.next;
  solver_identity(problem, next->rotations, next->disc_rotations);
  if (!wants_coarse(deformer, coarse)) {
    return EXM_OK;
  }
  TRY(rigidity_deformer_coarsen(deformer));
  if (deformer->coarse) {
    TRY(coarse_start(deformer->coarse, targets, deformer->base.info.vertex_count, next->rotations));
    deformer->is_coarse_there = 1;
    turn_discs(problem, next);
  }
  return EXM_OK;
}

/* The last rotations, turned as the coarser mesh turns on its way from the last targets to these. */
static exm_status begin_warm(rigidity_deformer *deformer, const rigidity_problem *problem, const double *targets,
                             int coarse)
{
  size_t const V = deformer->base.info.vertex_count;
  const rigidity_state *now = &deformer->solver.now;
  rigidity_state *next = &deformer->solver.next;
  const held *h = problem->h;
  int const has_moved = h->has_targets && memcmp(targets, h->targets, 12 * h->handle_count * sizeof *targets) != 0;
  int is_coarse = has_moved && wants_coarse(deformer, coarse);
  if (is_coarse) {
    TRY(rigidity_deformer_coarsen(deformer));
    is_coarse = deformer->coarse != NULL;
  }
  if (is_coarse && !deformer->is_coarse_there) {
    TRY(coarse_start(deformer->coarse, h->targets, V, next->rotations));
    deformer->is_coarse_there = 1;
  }
  memcpy(next->rotations, now->rotations, V * sizeof *next->rotations);
  memcpy(next->disc_rotations, now->disc_rotations, h->disc_count * sizeof *next->disc_rotations);
  if (is_coarse) {
    TRY(coarse_advance(deformer->coarse, targets, V, next->rotations));
    turn_discs(problem, next);
  } else {
    deformer->is_coarse_there &= !has_moved;
  }
  return EXM_OK;
}

/* Rotations to begin with, in solver.next: the last result stays until there is another. */
static exm_status begin(rigidity_deformer *deformer, const rigidity_problem *problem, const double *targets,
                        const rigidity_start *start)
{
  size_t const V = deformer->base.info.vertex_count;
  rigidity_state *next = &deformer->solver.next;
  if (start->kind == EXM_START_WARM && deformer->base.has_result) {
    return begin_warm(deformer, problem, targets, start->coarse);
  }
  deformer->is_coarse_there = 0;
  if (start->kind == EXM_START_POSITIONS) {
    for (size_t i = 0; i < 3 * V; i++) {
      next->positions[i] = (double)start->positions[i];
    }
    solver_fit(&deformer->solver, problem, next);
    return EXM_OK;
  }
  return begin_stateless(deformer, problem, targets, start->coarse);
}

/* Largest distance of a held handle's centre from its target. Fixed vertices are where they are told to be: their
 * handle's centre is off by as much as the affine frame and rounding make of it, which is nothing. */
static double residual(const rigidity_deformer *deformer, const double *targets)
{
  const held *h = &deformer->handles;
  double worst = 0, wanted[3];
  for (size_t q = 0; q < h->patch_count; q++) {
    const held_patch *patch = &h->patches[q];
    double square = 0;
    held_place(h, patch->handle, patch->arm, targets, wanted);
    for (size_t k = 0; k < 3; k++) {
      double mean = 0;
      for (uint32_t i = patch->begin; i < patch->end; i++) {
        mean += deformer->solver.now.positions[3 * (size_t)h->patch_vertices[i] + k] / (patch->end - patch->begin);
      }
      square += (mean - wanted[k]) * (mean - wanted[k]);
    }
    worst = fmax(worst, sqrt(square));
  }
  return worst;
}

exm_status rigidity_deformer_solve(rigidity_deformer *deformer, const double *targets, const rigidity_start *start,
                                   const rigidity_options *options, exm_solve_report *report)
{
  rigidity_problem const problem = problem_of(deformer);
  deformer->solver.thread_count = choose_threads(deformer, options->thread_count);
  exm_status status = begin(deformer, &problem, targets, start);
  if (status == EXM_OK) {
    status = solver_run(&deformer->solver, &problem, targets, options, report);
  }
  if (status < 0) {
    deformer->is_coarse_there = 0; /* the levels may have gone ahead */
    return status;
  }
  memcpy(deformer->handles.targets, targets, 12 * problem.h->handle_count * sizeof *targets);
  deformer->handles.has_targets = 1;
  deformer->base.has_result = 1;
  report->constraint_residual = residual(deformer, targets);
  return EXM_OK;
}

void rigidity_deformer_rotations(const rigidity_deformer *deformer, double *rotations)
{
  double row[12];
  for (size_t v = 0; v < deformer->base.info.vertex_count; v++) {
    memcpy(row, &deformer->solver.now.rotations[v], sizeof row);
    for (size_t e = 0; e < 9; e++) {
      rotations[9 * v + e] = row[e % 3 * 4 + e / 3];
    }
  }
}

/* Vertices' own shares go through the sums over balls, as for the rotations. */
exm_status rigidity_deformer_energies(const rigidity_deformer *deformer, double *energies)
{
  size_t const V = deformer->base.info.vertex_count;
  const set_sums *balls = &deformer->reach.balls;
  arena scratch = {0};
  row12 *own = ARENA_NEW(&scratch, row12, V), *sums = ARENA_NEW(&scratch, row12, V);
  double *ones = ARENA_NEW(&scratch, double, V);
  exm_status const status = own && sums && ones ? EXM_OK : status_no_memory("the energies");
  for (size_t v = 0; v < V && status == EXM_OK; v++) {
    ones[v] = 1;
    double const stretch = spokes_moments(&deformer->edges, v, v + 1, deformer->solver.now.positions, ones, own);
    own[v] = (row12){0};
    ((double *)&own[v])[0] = stretch + deformer->edges.rest[v];
  }
  if (status == EXM_OK) {
    set_sums_apply(balls, deformer->solver.thread_count, own, sums);
  }
  for (size_t v = 0; v < V && status == EXM_OK; v++) {
    energies[v] = fmax(0, ((const double *)&sums[v])[0] - 2 * deformer->solver.now.gains[v]);
  }
  arena_release(&scratch);
  return status;
}

static const rigidity_deformer *const_of(const exm_deformer *deformer)
{
  return (const rigidity_deformer *)deformer;
}

/* Its one exemplar is the reference. */
static void handle_pose(const exm_deformer *base, size_t exemplar, double *targets)
{
  const held *h = &const_of(base)->handles;
  (void)exemplar;
  for (size_t i = 0; i < 12 * h->handle_count; i++) {
    size_t const row = i % 12 / 4, column = i % 4;
    targets[i] = column == 3 ? h->centres[i / 12][row] : row == column;
  }
}

static void positions(const exm_deformer *deformer, int thread_count, float *out)
{
  (void)thread_count; /* it is a copy */
  for (size_t i = 0; i < 3 * deformer->info.vertex_count; i++) {
    out[i] = (float)const_of(deformer)->solver.now.positions[i];
  }
}

static void positions_f64(const exm_deformer *deformer, double *out)
{
  memcpy(out, const_of(deformer)->solver.now.positions, 3 * deformer->info.vertex_count * sizeof *out);
}

static void release(exm_deformer *base)
{
  rigidity_deformer *deformer = (rigidity_deformer *)base;
  coarse_destroy(deformer->coarse);
  system_destroy(&deformer->system);
  held_destroy(&deformer->handles);
  arena_release(&deformer->reach.memory);
}

const deformer_methods rigidity_methods = {
    .handle_pose = handle_pose, .positions = positions, .positions_f64 = positions_f64, .release = release};
