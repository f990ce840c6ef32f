/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The stages of [Blended, 5]. The minimal stage chooses among exemplars anyway, so it also starts from each of them as
 * it lies on the constraints: what the average smoothes away is not lost, and an exemplar's own constraints give it
 * back. */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/** Rotations of exemplar s as it lies on the constraints, seen from the frame: turn' turn_s, transposed. */
static void lay_down(blended *b, size_t s)
{
  size_t const d = b->dimension, square = d * d;
  double relative[9];
  for (size_t i = 0; i < d; i++) {
    for (size_t j = 0; j < d; j++) {
      relative[i * d + j] = 0;
      for (size_t k = 0; k < d; k++) {
        relative[i * d + j] += b->frames[s].turn[k * d + i] * b->frame.turn[k * d + j];
      }
    }
  }
  for (size_t g = 0; g < b->group_count; g++) {
    memcpy(b->rotations + (s * b->group_count + g) * square, relative, square * sizeof(double));
  }
}

typedef struct contest {
  size_t winner;
  double energy, scale;
  size_t history[2];
} contest;

/** One start of the minimal stage for exemplar s; the best start and exemplar so far is kept in b->best. */
static void compete(blended *b, size_t s, const blended_options *options, exm_solve_report *report, contest *c)
{
  size_t const size = b->group_count * b->dimension * b->dimension, from = report->history_count;
  double const energy = blended_minimal(b, BLENDED_FIRST, s, options->minimal_iterations, options, report);
  if (energy < c->energy) {
    *c = (contest){.winner = s, .energy = energy, .scale = b->scale, .history = {from, report->history_count}};
    rotation_fit(b->dimension, b->group_count, b->fits + s * size, b->best);
  }
}

/** Eq. 12 in the first dictionary: every exemplar from the average's rotations, and from where it lies. */
static contest choose(blended *b, const blended_options *options, exm_solve_report *report)
{
  size_t const size = b->group_count * b->dimension * b->dimension;
  contest c = {.energy = INFINITY, .scale = 1};
  for (size_t s = 0; s < b->compared_count; s++) {
    compete(b, s, options, report, &c);
    lay_down(b, s);
    compete(b, s, options, report, &c);
  }
  b->exemplar = c.winner;
  memcpy(b->rotations + c.winner * size, b->best, size * sizeof(double));
  return c;
}

/** E_sc of eq. 7 for the pose in b->u, against the chosen exemplar. */
static double elastic_energy(const blended *b)
{
  const blended_basis *basis = &b->bases[BLENDED_LAST];
  size_t const d = b->dimension, rank = basis->rank, rows = b->group_count * d;
  const double *R = b->rotations + b->exemplar * rows * d;
  double energy = b->scale * b->scale * b->energy->own[b->exemplar];
  for (size_t i = 0; i < rank; i++) {
    double along[3] = {0};
    dense_times_transposed(rank, d, 1, b->u, d, basis->elastic + i * rank, along);
    energy += dense_dot(d, along, b->u + i * d);
  }
  for (size_t i = 0; i < rows; i++) {
    double fitted[3];
    dense_times_transposed(rank, d, 1, b->u, d, basis->proxies + (b->exemplar * rows + i) * rank, fitted);
    energy -= 2 * b->scale * dense_dot(d, fitted, R + i * d);
  }
  return fmax(0.5 * energy, 0);
}

static void last_stage(blended *b, const blended_options *options, exm_solve_report *report,
                       exm_blended_outcome *outcome)
{
  size_t const s = b->exemplar;
  blended_hold(b, BLENDED_LAST, s, s + 1);
  outcome->final_history[0] = report->history_count;
  report->converged = 0; /* what counts is the last stage */
  outcome->final_energy = blended_minimal(b, BLENDED_LAST, s, options->final_iterations, options, report);
  outcome->final_history[1] = report->history_count;
  blended_pose(b, BLENDED_LAST, s);
  report->elastic_energy = elastic_energy(b);
}

exm_status blended_solve(blended *b, const blended_options *options, exm_solve_report *report,
                         exm_blended_outcome *outcome)
{
  if (!options->is_warm || !b->has_solution) {
    blended_set_frame(b, options->scale != EXM_SCALE_HELD);
    blended_hold(b, BLENDED_FIRST, 0, b->compared_count);
    b->scale = 1;
    TRY(blended_begin(b, options, &outcome->begin_atom_count));
    outcome->average_history[0] = report->history_count;
    outcome->average_energy = blended_average(b, options, report);
    outcome->average_history[1] = report->history_count;
    contest const c = choose(b, options, report);
    outcome->minimal_energy = c.energy;
    memcpy(outcome->minimal_history, c.history, sizeof c.history);
  }
  last_stage(b, options, report, outcome);
  outcome->exemplar = b->exemplar;
  outcome->scale = b->scale * b->frame.scale;
  b->has_solution = 1;
  return EXM_OK;
}
