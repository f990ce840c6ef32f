/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"
#include "base/clock.h"
#include "deform/rigidity/deformer.h"
#include "deform/rigidity/learn.h"

void exm_rigidity_bind_settings_init(exm_rigidity_bind_settings *settings)
{
  if (settings) {
    *settings = (exm_rigidity_bind_settings){.struct_size = sizeof *settings, .radius = 1, .handle_size = 0.03};
  }
}

void exm_rigidity_solve_settings_init(exm_rigidity_solve_settings *settings)
{
  if (settings) {
    *settings = (exm_rigidity_solve_settings){.struct_size = sizeof *settings,
                                              .start = EXM_START_STATELESS,
                                              .tolerance = 1e-3,
                                              .iterations = 0,
                                              .acceleration = 1,
                                              .coarse_start = -1,
                                              .thread_count = 0};
  }
}

void exm_rigidity_learn_settings_init(exm_rigidity_learn_settings *settings)
{
  if (settings) {
    *settings =
        (exm_rigidity_learn_settings){.struct_size = sizeof *settings, .radius_min = 1, .radius_max = 6, .omega = 0.3};
  }
}

static exm_status check_radii(const int32_t *radii, int32_t radius, const char *where, size_t vertex_count)
{
  if (!radii && (radius < 1 || radius > EXM_RADIUS_MAX)) {
    return status_set(EXM_ERROR_ARGUMENT, "%sradius is %d, not between 1 and %d", where, radius, EXM_RADIUS_MAX);
  }
  for (size_t v = 0; v < vertex_count && radii; v++) {
    if (radii[v] < 1 || radii[v] > EXM_RADIUS_MAX) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, v,
                           "%sradii: that of vertex %zu is %d, not between 1 and %d", where, v, radii[v],
                           EXM_RADIUS_MAX);
    }
  }
  return EXM_OK;
}

exm_status exm_rigidity_create(const exm_mesh *reference, const exm_handles *handles,
                               const exm_rigidity_bind_settings *settings, exm_progress callback, void *user,
                               exm_deformer **out)
{
  exm_rigidity_bind_settings own;
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(reference, "mesh"));
  TRY(check_pointer(handles, "handles"));
  exm_rigidity_bind_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(check_radii(own.radii, own.radius, "settings.", reference->vertex_count));
  if (!(own.handle_size >= 0) || own.handle_size > 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.handle_size is %g, not between 0 and 1", own.handle_size);
  }
  rigidity_request const request = {.reference = reference,
                                    .handles = handles,
                                    .radii = own.radii,
                                    .radius = own.radius,
                                    .disc_size = own.handle_size,
                                    .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  return rigidity_deformer_bind(&request, out);
}

static rigidity_deformer *rigidity_of(exm_deformer *deformer)
{
  return (rigidity_deformer *)deformer;
}

static const rigidity_deformer *rigidity_const(const exm_deformer *deformer)
{
  return (const rigidity_deformer *)deformer;
}

exm_status exm_rigidity_set_radii(exm_deformer *deformer, const int32_t *radii, int32_t radius, exm_progress callback,
                                  void *user)
{
  progress const report = {.callback = callback, .user = user, .begin = 0, .end = 1};
  TRY(check_kind(deformer, EXM_DEFORMER_RIGIDITY));
  TRY(check_radii(radii, radius, "", deformer->info.vertex_count));
  return rigidity_deformer_set_radii(rigidity_of(deformer), radii, radius, &report);
}

exm_status exm_rigidity_set_handles(exm_deformer *deformer, const exm_handles *handles, exm_progress callback,
                                    void *user)
{
  progress const report = {.callback = callback, .user = user, .begin = 0, .end = 1};
  TRY(check_kind(deformer, EXM_DEFORMER_RIGIDITY));
  TRY(check_pointer(handles, "handles"));
  return rigidity_deformer_set_handles(rigidity_of(deformer), handles, &report);
}

exm_status exm_rigidity_get_radii(const exm_deformer *deformer, int32_t *radii)
{
  TRY(check_kind(deformer, EXM_DEFORMER_RIGIDITY));
  TRY(check_pointer(radii, "radii"));
  memcpy(radii, rigidity_const(deformer)->reach.radii, deformer->info.vertex_count * sizeof *radii);
  return EXM_OK;
}

static exm_status check_start(const exm_rigidity_solve_settings *settings, size_t vertex_count)
{
  if (settings->start < EXM_START_STATELESS || settings->start > EXM_START_POSITIONS) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.start is %d, not one of exm_start", settings->start);
  }
  if (settings->start != EXM_START_POSITIONS) {
    return EXM_OK;
  }
  TRY(check_pointer(settings->positions, "settings.positions"));
  for (size_t i = 0; i < 3 * vertex_count; i++) {
    if (!isfinite(settings->positions[i])) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, i / 3,
                           "settings.positions: vertex %zu has a coordinate that is not finite", i / 3);
    }
  }
  return EXM_OK;
}

static exm_status check_solve_settings(const exm_rigidity_solve_settings *settings, size_t vertex_count)
{
  TRY(check_start(settings, vertex_count));
  if (!(settings->tolerance >= 0) || !isfinite(settings->tolerance)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.tolerance is %g, not 0 or more", settings->tolerance);
  }
  if (settings->iterations < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.iterations is %d, not 0 or more", settings->iterations);
  }
  if (settings->acceleration != 0 && settings->acceleration != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.acceleration is %d, not 0 or 1", settings->acceleration);
  }
  if (settings->coarse_start < -1 || settings->coarse_start > 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.coarse_start is %d, not -1, 0 or 1", settings->coarse_start);
  }
  if (settings->thread_count < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.thread_count is %d, not 0 or more", settings->thread_count);
  }
  return EXM_OK;
}

static int32_t chosen_iterations(const exm_rigidity_solve_settings *settings)
{
  return settings->tolerance > 0 ? 1000 : 10;
}

exm_status exm_rigidity_solve(exm_deformer *deformer, const double *targets,
                              const exm_rigidity_solve_settings *settings, exm_solve_report *report)
{
  double const start = clock_seconds();
  exm_rigidity_solve_settings own;
  exm_solve_report found;
  TRY(check_kind(deformer, EXM_DEFORMER_RIGIDITY));
  TRY(check_pointer(targets, "targets"));
  exm_rigidity_solve_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(check_solve_settings(&own, deformer->info.vertex_count));
  TRY(check_targets(deformer, targets));
  TRY(report_begin(&found, report));
  rigidity_start const from = {.kind = (exm_start)own.start, .positions = own.positions, .coarse = own.coarse_start};
  rigidity_options const options = {.tolerance = own.tolerance,
                                    .iterations = own.iterations ? own.iterations : chosen_iterations(&own),
                                    .has_acceleration = own.acceleration,
                                    .thread_count = own.thread_count};
  TRY(rigidity_deformer_solve(rigidity_of(deformer), targets, &from, &options, &found));
  found.seconds = clock_seconds() - start;
  TRY(report_write(report, &found, sizeof found, "report"));
  if (own.tolerance > 0 && !found.converged) {
    return status_set(EXM_WARNING_NOT_CONVERGED, "stopped after %d iterations, before the tolerance of %g was met",
                      found.iterations, own.tolerance);
  }
  return EXM_OK;
}

static exm_status check_result(const exm_deformer *deformer)
{
  TRY(check_kind(deformer, EXM_DEFORMER_RIGIDITY));
  return deformer->has_result ? EXM_OK : status_set(EXM_ERROR_ARGUMENT, "deformer has not been solved yet");
}

exm_status exm_rigidity_rotations(const exm_deformer *deformer, double *rotations)
{
  TRY(check_result(deformer));
  TRY(check_pointer(rotations, "rotations"));
  rigidity_deformer_rotations(rigidity_const(deformer), rotations);
  return EXM_OK;
}

exm_status exm_rigidity_energies(const exm_deformer *deformer, double *energies)
{
  TRY(check_result(deformer));
  TRY(check_pointer(energies, "energies"));
  return rigidity_deformer_energies(rigidity_const(deformer), energies);
}

static exm_status check_learn_settings(const exm_rigidity_learn_settings *settings)
{
  if (settings->radius_min < 1 || settings->radius_min > EXM_RADIUS_MAX) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.radius_min is %d, not between 1 and %d", settings->radius_min,
                      EXM_RADIUS_MAX);
  }
  if (settings->radius_max < settings->radius_min || settings->radius_max > EXM_RADIUS_MAX) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.radius_max is %d, not between radius_min, %d, and %d",
                      settings->radius_max, settings->radius_min, EXM_RADIUS_MAX);
  }
  if (!(settings->omega >= 0) || !isfinite(settings->omega)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.omega is %g, not 0 or more", settings->omega);
  }
  return EXM_OK;
}

exm_status exm_rigidity_learn(const exm_mesh *reference, const float *poses, size_t pose_count,
                              const exm_rigidity_learn_settings *settings, exm_progress callback, void *user,
                              int32_t *radii, double *energies)
{
  exm_rigidity_learn_settings own;
  TRY(check_pointer(reference, "mesh"));
  TRY(check_pointer(poses, "poses"));
  TRY(check_pointer(radii, "radii"));
  exm_rigidity_learn_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(check_learn_settings(&own));
  TRY(check_poses(poses, pose_count, reference->vertex_count));
  learn_request const request = {.reference = reference,
                                 .poses = poses,
                                 .pose_count = pose_count,
                                 .radius_min = own.radius_min,
                                 .radius_max = own.radius_max,
                                 .omega = own.omega,
                                 .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  return rigidity_learn(&request, radii, energies);
}
