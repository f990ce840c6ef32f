/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"
#include "base/clock.h"
#include "deform/amrap/deformer.h"

void exm_amrap_bind_settings_init(exm_amrap_bind_settings *settings)
{
  if (settings) {
    *settings = (exm_amrap_bind_settings){.struct_size = sizeof *settings};
  }
}

void exm_amrap_solve_settings_init(exm_amrap_solve_settings *settings)
{
  if (settings) {
    *settings = (exm_amrap_solve_settings){.struct_size = sizeof *settings,
                                           .lambda = 0.5,
                                           .blend = EXM_BLEND_LOCAL,
                                           .rotations = 1,
                                           .start = EXM_START_STATELESS,
                                           .descent = EXM_DESCENT_AUTO,
                                           .iterations = 0,
                                           .tolerance = 0};
  }
}

static exm_status check_bind_settings(const exm_amrap_bind_settings *settings, size_t vertex_count)
{
  if (settings->dimension != 0 && settings->dimension != 2 && settings->dimension != 3) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.dimension is %d, not 0, 2 or 3", settings->dimension);
  }
  if (settings->edge_group_count > vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.edge_group_count is %zu, more than the %zu vertices",
                      settings->edge_group_count, vertex_count);
  }
  return EXM_OK;
}

exm_status exm_amrap_create(const exm_mesh *reference, const float *exemplars, size_t exemplar_count,
                            const exm_handles *handles, const exm_amrap_bind_settings *settings, exm_progress callback,
                            void *user, exm_deformer **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(reference, "mesh"));
  TRY(check_pointer(exemplars, "exemplars"));
  TRY(check_pointer(handles, "handles"));
  amrap_request request = {.reference = reference,
                           .exemplars = exemplars,
                           .exemplar_count = exemplar_count,
                           .handles = handles,
                           .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  exm_amrap_bind_settings_init(&request.settings);
  TRY(settings_read(&request.settings, sizeof request.settings, settings, "settings"));
  TRY(check_bind_settings(&request.settings, reference->vertex_count));
  TRY(check_exemplars(exemplars, exemplar_count, reference->vertex_count));
  if (handles->count < 2) {
    return status_set(EXM_ERROR_ARGUMENT, "handles.count is %zu: AMRAP needs two at least", handles->count);
  }
  return amrap_deformer_bind(&request, out);
}

static exm_status check_solve_settings(const exm_amrap_solve_settings *settings)
{
  if (!(settings->lambda >= 0) || !isfinite(settings->lambda)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.lambda is %g, not 0 or more", settings->lambda);
  }
  if (settings->blend != EXM_BLEND_LOCAL && settings->blend != EXM_BLEND_GLOBAL) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.blend is %d, not one of exm_blend", settings->blend);
  }
  if (settings->rotations != 0 && settings->rotations != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.rotations is %d, not 0 or 1", settings->rotations);
  }
  if (settings->start != EXM_START_STATELESS && settings->start != EXM_START_WARM) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.start is %d, not one of exm_start", settings->start);
  }
  if (settings->descent < EXM_DESCENT_AUTO || settings->descent > EXM_DESCENT_TRUST_REGION) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.descent is %d, not one of exm_descent", settings->descent);
  }
  if (settings->iterations < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.iterations is %d, not 0 or more", settings->iterations);
  }
  if (!(settings->tolerance >= 0) || !isfinite(settings->tolerance)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.tolerance is %g, not 0 or more", settings->tolerance);
  }
  return EXM_OK;
}

/* A drag has a millisecond, and the next frame goes on, as in the paper. From nothing, ten iterations are within a
 * percent of the lowest objective; to a tolerance, acceleration needs a few dozen. */
static int32_t chosen_iterations(const exm_amrap_solve_settings *settings)
{
  if (settings->tolerance > 0) {
    return 200;
  }
  return settings->start == EXM_START_WARM ? 1 : 5;
}

static amrap_deformer *amrap_of(exm_deformer *deformer)
{
  return (amrap_deformer *)deformer;
}

static const amrap_deformer *amrap_const(const exm_deformer *deformer)
{
  return (const amrap_deformer *)deformer;
}

exm_status exm_amrap_solve(exm_deformer *deformer, const double *targets, const exm_amrap_solve_settings *settings,
                           exm_solve_report *report)
{
  double const start = clock_seconds();
  exm_amrap_solve_settings own;
  exm_solve_report found;
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(targets, "targets"));
  exm_amrap_solve_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(check_solve_settings(&own));
  TRY(check_targets(deformer, targets));
  TRY(report_begin(&found, report));
  amrap_options const options = {.lambda = own.lambda,
                                 .is_global = own.blend == EXM_BLEND_GLOBAL,
                                 .has_rotations = own.rotations,
                                 .is_warm = own.start == EXM_START_WARM,
                                 .descent = (exm_descent)own.descent,
                                 .iterations = own.iterations ? own.iterations : chosen_iterations(&own),
                                 .tolerance = own.tolerance};
  TRY(amrap_deformer_solve(amrap_of(deformer), targets, &options, &found));
  found.seconds = clock_seconds() - start;
  TRY(report_write(report, &found, sizeof found, "report"));
  if (own.tolerance > 0 && !found.converged) {
    return status_set(EXM_WARNING_NOT_CONVERGED, "stopped after %d iterations, before the tolerance of %g was met",
                      found.iterations, own.tolerance);
  }
  return EXM_OK;
}

exm_status exm_amrap_blend_weights(const exm_deformer *deformer, double *blend)
{
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(blend, "blend"));
  memcpy(blend, amrap_const(deformer)->solver.B,
         deformer->info.edge_group_count * deformer->info.exemplar_count * sizeof(double));
  return EXM_OK;
}

exm_status exm_amrap_blend_average(const exm_deformer *deformer, double *average)
{
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(average, "average"));
  amrap_blend_average(&amrap_const(deformer)->solver, average);
  return EXM_OK;
}

exm_status exm_amrap_edge_groups(const exm_deformer *deformer, uint32_t *groups)
{
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(groups, "groups"));
  memcpy(groups, amrap_const(deformer)->groups, deformer->info.vertex_count * sizeof *groups);
  return EXM_OK;
}

exm_status exm_amrap_rotations(const exm_deformer *deformer, double *rotations)
{
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(rotations, "rotations"));
  amrap_deformer_rotations(amrap_const(deformer), rotations);
  return EXM_OK;
}

exm_status exm_amrap_exemplar_energies(const exm_deformer *deformer, double *energies)
{
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(energies, "energies"));
  amrap_deformer_exemplar_energies(amrap_const(deformer), energies);
  return EXM_OK;
}

exm_status exm_amrap_exemplar_positions(const exm_deformer *deformer, size_t exemplar, double *positions)
{
  TRY(check_kind(deformer, EXM_DEFORMER_AMRAP));
  TRY(check_pointer(positions, "positions"));
  TRY(check_exemplar(deformer, exemplar));
  return amrap_deformer_exemplar_positions(amrap_const(deformer), exemplar, positions);
}
