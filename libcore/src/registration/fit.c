/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The stages of a fit, and what is kept of it. */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "linalg/dense.h"
#include "registration/finish.h"
#include "registration/icp.h"
#include "registration/outliers.h"
#include "registration/result.h"

/* Shares of the progress bar. */
static double const AFTER_START = 0.1, AFTER_ICP = 0.8, AFTER_FINISH = 0.95;

/* Discs are drawn anew where they change the scale that they were drawn for by more than this share. */
enum { PASSES = 2 };
static double const SCALE_TOLERANCE = 0.03;

/** The deformer's pose in the last stage's coordinates: its coefficients are basis times u, and u follows because the
 *  basis is orthonormal in the energy and masses. */
static void take_pose(const registration *r, const exm_blended_outcome *outcome, registered_pose *pose)
{
  const blended *b = &r->deformer->solver;
  pose->frame = b->frame;
  pose->exemplar = outcome->exemplar;
  pose->scale = outcome->scale / b->frame.scale;
  memcpy(pose->u, b->u, registration_basis(r)->rank * 3 * sizeof(double));
}

/** The landmarks with those that contradict the rest at weight 0. rows: as points, held and posed. */
static exm_status reject(arena *owner, registration *r, const fit_request *request, const landmark_rows *rows,
                         double energy, exm_landmarks *used, exm_registration_fit_report *report)
{
  double *of_rows = ARENA_NEW(owner, double, rows->count), *weights = ARENA_NEW(owner, double, used->count);
  if (!of_rows || !weights) {
    return status_no_memory("the landmarks");
  }
  TRY(outliers_find(r, rows, &request->settings, energy, of_rows, &report->rejected_count));
  for (size_t i = 0, row = 0; i < used->count; i++) {
    int const counts = !used->weights || used->weights[i] > 0;
    weights[i] = counts ? of_rows[row++] : 0;
  }
  used->weights = weights;
  return EXM_OK;
}

/** The pose that meets the landmarks: first as points, which tells the scale and which of them are wrong, then as discs
 *  of that scale. */
static exm_status start(arena *owner, registration *r, const fit_request *request, landmark_rows *rows,
                        registered_pose *pose, exm_registration_fit_report *report)
{
  exm_blended_outcome outcome;
  exm_landmarks used = request->landmarks;
  if (request->settings.start == EXM_START_WARM && r->last.positions) {
    double *u = pose->u;
    *pose = r->last.pose;
    pose->u = u;
    memcpy(u, r->last.pose.u, registration_basis(r)->rank * 3 * sizeof(double));
    return landmark_discs(owner, r, request, &used, pose->scale * pose->frame.scale, rows);
  }
  TRY(landmark_points(owner, &used, rows));
  TRY(landmark_hold(r, rows));
  TRY(landmark_pose(r, rows, &request->settings, &outcome));
  if (request->settings.reject_landmarks) {
    double const energy = outcome.final_energy / (outcome.scale * outcome.scale);
    TRY(reject(owner, r, request, rows, energy, &used, report));
  }
  if (report->rejected_count > 0) {
    TRY(landmark_points(owner, &used, rows));
    TRY(landmark_hold(r, rows));
    TRY(landmark_pose(r, rows, &request->settings, &outcome));
  }
  double scale = 0;
  for (int pass = 0; pass < PASSES && fabs(outcome.scale / scale - 1) > SCALE_TOLERANCE; pass++) {
    scale = outcome.scale;
    TRY(landmark_discs(owner, r, request, &used, scale, rows));
    TRY(landmark_hold(r, rows));
    TRY(landmark_pose(r, rows, &request->settings, &outcome));
  }
  take_pose(r, &outcome, pose);
  return EXM_OK;
}

static exm_status run(registration *r, const fit_request *request, arena *scratch, registered_fit *fit, shape *surface,
                      exm_registration_fit_report *report)
{
  double const begin = clock_seconds();
  landmark_rows rows = {0};
  icp iteration;
  progress const icp_part = progress_part(&request->report, AFTER_START, AFTER_ICP);
  progress const finish_part = progress_part(&request->report, AFTER_ICP, AFTER_FINISH);
  fit->pose.u = ARENA_NEW(&fit->memory, double, registration_basis(r)->rank * 3);
  if (!fit->pose.u) {
    return status_no_memory("the fit");
  }
  TRY(start(scratch, r, request, &rows, &fit->pose, report));
  TRY(shape_create(scratch, r, surface));
  TRY(shape_pose(surface, &fit->pose));
  r->shown = surface->shown;
  TRY(progress_report(&request->report, AFTER_START, "meeting the landmarks"));
  TRY(icp_create(scratch, r, request, &rows, surface, &iteration));
  iteration.pose = fit->pose;
  double const started = clock_seconds();
  TRY(icp_run(&iteration, &icp_part));
  fit->pose = iteration.pose;
  double const iterated = clock_seconds();
  report->scale = fit->pose.scale * fit->pose.frame.scale;
  report->exemplar = fit->pose.exemplar;
  report->iterations = iteration.iterations;
  report->converged = iteration.converged;
  report->energy = iteration.energy;
  TRY(result_judge(surface, request, report));
  if (request->settings.finish) {
    TRY(finish_shape(surface, request, report->scale, &finish_part));
  }
  double const finished = clock_seconds();
  TRY(result_fill(surface, request, report, fit));
  TRY(progress_report(&request->report, 1, "matching"));
  report->start_seconds = started - begin;
  report->icp_seconds = iterated - started;
  report->finish_seconds = finished - iterated;
  report->match_seconds = clock_seconds() - finished;
  report->seconds = clock_seconds() - begin;
  return EXM_OK;
}

exm_status registration_fit(registration *r, const fit_request *request, exm_registration_fit_report *report)
{
  arena scratch = {0};
  registered_fit fit = {0};
  shape surface = {0};
  exm_status const status = run(r, request, &scratch, &fit, &surface, report);
  r->shown = NULL;
  shape_release(&surface);
  arena_release(&scratch);
  if (status < 0) {
    arena_release(&fit.memory);
    return status;
  }
  arena_release(&r->last.memory);
  r->last = fit;
  return result_warn(report);
}
