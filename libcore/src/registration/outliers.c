/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/outliers.h"

#include <math.h>
#include <string.h>

/* With fewer landmarks none is one too many. */
enum { LEAST = 6 };
/* Leaving out a right one takes its share of the energy off; a wrong one is most of it. */
static double const TELLING = 0.35;

/** The energy of the pose without row `without` among those that count. */
static exm_status energy_without(registration *r, const landmark_rows *rows,
                                 const exm_registration_fit_settings *settings, const double *weights, size_t without,
                                 double *own, double *energy)
{
  exm_blended_outcome outcome;
  memcpy(own, weights, rows->count * sizeof *own);
  own[without] = 0;
  TRY(blended_deformer_weigh_rows(r->deformer, 0, rows->count, own));
  TRY(landmark_pose(r, rows, settings, &outcome));
  *energy = outcome.final_energy / (outcome.scale * outcome.scale);
  return EXM_OK;
}

/** The one whose absence helps most; *runner_up is what the next best one's absence leaves. */
static exm_status find_worst(registration *r, const landmark_rows *rows, const exm_registration_fit_settings *settings,
                             const double *weights, double *own, size_t *worst, double *least, double *runner_up)
{
  *least = *runner_up = INFINITY;
  *worst = 0;
  for (size_t i = 0; i < rows->count; i++) {
    double energy = INFINITY;
    if (!(weights[i] > 0)) {
      continue;
    }
    TRY(energy_without(r, rows, settings, weights, i, own, &energy));
    if (energy < *least) {
      *runner_up = *least;
      *least = energy;
      *worst = i;
    } else {
      *runner_up = fmin(*runner_up, energy);
    }
  }
  return EXM_OK;
}

exm_status outliers_find(registration *r, const landmark_rows *rows, const exm_registration_fit_settings *settings,
                         double energy, double *weights, size_t *rejected)
{
  arena scratch = {0};
  double *own = ARENA_NEW(&scratch, double, rows->count);
  exm_status status = own ? EXM_OK : status_no_memory("the landmarks");
  memcpy(weights, rows->weights, rows->count * sizeof *weights);
  *rejected = 0;
  for (int is_done = 0; !is_done && status == EXM_OK;) {
    size_t worst = 0;
    double least = 0, runner_up = 0;
    is_done = 1;
    if (rows->count - *rejected < LEAST || 6 * (*rejected + 1) > rows->count) {
      break;
    }
    status = find_worst(r, rows, settings, weights, own, &worst, &least, &runner_up);
    if (status == EXM_OK && least < TELLING * energy && least < TELLING * runner_up) {
      weights[worst] = 0;
      ++*rejected;
      energy = least;
      is_done = 0;
    }
  }
  arena_release(&scratch);
  return status;
}
