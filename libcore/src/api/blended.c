/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"
#include "base/clock.h"
#include "deform/blended/deformer.h"

void exm_blended_bind_settings_init(exm_blended_bind_settings *settings)
{
  if (settings) {
    *settings = (exm_blended_bind_settings){.struct_size = sizeof *settings,
                                            .dictionary = EXM_DICTIONARY_EIGENFUNCTIONS,
                                            .start_eigenfunction_count = 4,
                                            .eigenfunction_count = 15,
                                            .atoms_kept = 0.5,
                                            .smoothness = 1e-6,
                                            .constraint_weight = 30};
  }
}

void exm_blended_solve_settings_init(exm_blended_solve_settings *settings)
{
  if (settings) {
    *settings = (exm_blended_solve_settings){.struct_size = sizeof *settings,
                                             .sparsity = 0.01,
                                             .begin = EXM_BEGIN_SPARSE,
                                             .scale = EXM_SCALE_BALANCED,
                                             .start = EXM_START_STATELESS,
                                             .average_iterations = 8,
                                             .minimal_iterations = 8,
                                             .final_iterations = 0};
  }
}

void exm_blended_outcome_init(exm_blended_outcome *outcome)
{
  if (outcome) {
    *outcome = (exm_blended_outcome){.struct_size = sizeof *outcome};
  }
}

void exm_blended_info_init(exm_blended_info *info)
{
  if (info) {
    *info = (exm_blended_info){.struct_size = sizeof *info};
  }
}

static exm_status check_energies(double constraint_weight, double smoothness)
{
  if (!(constraint_weight > 0) || !isfinite(constraint_weight)) {
    return status_set(EXM_ERROR_ARGUMENT, "constraint_weight is %g, not above 0", constraint_weight);
  }
  if (!(smoothness >= 0) || !isfinite(smoothness)) {
    return status_set(EXM_ERROR_ARGUMENT, "smoothness is %g, not 0 or more", smoothness);
  }
  return EXM_OK;
}

static exm_status check_counts(const exm_blended_bind_settings *s, size_t vertex_count)
{
  const struct {
    const char *name;
    size_t value;
  } counts[] = {{"eigenfunction_count", s->eigenfunction_count},
                {"bone_count", s->bone_count},
                {"cluster_count", s->cluster_count}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
    if (counts[i].value > vertex_count) {
      return status_set(EXM_ERROR_ARGUMENT, "settings.%s is %zu, more than the %zu vertices", counts[i].name,
                        counts[i].value, vertex_count);
    }
  }
  if (s->start_eigenfunction_count < 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.start_eigenfunction_count is 0, not 1 or more");
  }
  if (s->eigenfunction_count < s->start_eigenfunction_count) {
    return status_set(EXM_ERROR_ARGUMENT,
                      "settings.eigenfunction_count is %zu, less than settings.start_eigenfunction_count, %zu",
                      s->eigenfunction_count, s->start_eigenfunction_count);
  }
  return EXM_OK;
}

exm_status check_blended_settings(const exm_blended_bind_settings *s, size_t vertex_count, size_t exemplar_count)
{
  if (s->dictionary != EXM_DICTIONARY_EIGENFUNCTIONS && s->dictionary != EXM_DICTIONARY_SKELETON) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.dictionary is %d, not one of exm_dictionary", s->dictionary);
  }
  if (s->dimension != 0 && s->dimension != 2 && s->dimension != 3) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.dimension is %d, not 0, 2 or 3", s->dimension);
  }
  TRY(check_counts(s, vertex_count));
  if (!(s->atoms_kept > 0 && s->atoms_kept <= 1)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.atoms_kept is %g, not above 0 and up to 1", s->atoms_kept);
  }
  if (s->dictionary_exemplar_count > exemplar_count || s->compared_exemplar_count > exemplar_count) {
    int const is_dictionary = s->dictionary_exemplar_count > exemplar_count;
    return status_set(EXM_ERROR_ARGUMENT, "settings.%s_exemplar_count is %zu, more than the %zu exemplars",
                      is_dictionary ? "dictionary" : "compared",
                      is_dictionary ? s->dictionary_exemplar_count : s->compared_exemplar_count, exemplar_count);
  }
  if (s->weights && s->bone_count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.weights are given, but settings.bone_count is 0");
  }
  return check_energies(s->constraint_weight, s->smoothness);
}

exm_status exm_blended_create(const exm_mesh *reference, const float *exemplars, size_t exemplar_count,
                              const exm_handles *handles, const exm_blended_bind_settings *settings,
                              exm_progress callback, void *user, exm_deformer **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(reference, "mesh"));
  TRY(check_pointer(exemplars, "exemplars"));
  TRY(check_pointer(handles, "handles"));
  blended_request request = {.reference = reference,
                             .exemplars = exemplars,
                             .exemplar_count = exemplar_count,
                             .handles = handles,
                             .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  exm_blended_bind_settings_init(&request.settings);
  TRY(settings_read(&request.settings, sizeof request.settings, settings, "settings"));
  TRY(check_exemplars(exemplars, exemplar_count, reference->vertex_count));
  TRY(check_blended_settings(&request.settings, reference->vertex_count, exemplar_count));
  return blended_deformer_bind(&request, out);
}

static blended_deformer *blended_of(exm_deformer *deformer)
{
  return (blended_deformer *)deformer;
}

static const blended_deformer *blended_const(const exm_deformer *deformer)
{
  return (const blended_deformer *)deformer;
}

static size_t added_rows(const blended_deformer *deformer)
{
  return deformer->solver.held.row_count - deformer->solver.held.handle_row_count;
}

/* ------------------------------------------------------------------------------------------------------------ solve */

static exm_status check_solve_settings(const exm_blended_solve_settings *s)
{
  if (!(s->sparsity >= 0) || !isfinite(s->sparsity)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.sparsity is %g, not 0 or more", s->sparsity);
  }
  if (s->begin != EXM_BEGIN_SPARSE && s->begin != EXM_BEGIN_PLAIN) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.begin is %d, not one of exm_blended_begin", s->begin);
  }
  if (s->scale < EXM_SCALE_HELD || s->scale > EXM_SCALE_LEAST_SQUARES) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.scale is %d, not one of exm_scale", s->scale);
  }
  if (s->start != EXM_START_STATELESS && s->start != EXM_START_WARM) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.start is %d, not one of exm_start", s->start);
  }
  if (s->average_iterations < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.average_iterations is %d, not 0 or more", s->average_iterations);
  }
  if (s->minimal_iterations < 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.minimal_iterations is %d, not 1 or more", s->minimal_iterations);
  }
  if (s->final_iterations < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.final_iterations is %d, not 0 or more", s->final_iterations);
  }
  if (!(s->tolerance >= 0) || !isfinite(s->tolerance)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.tolerance is %g, not 0 or more", s->tolerance);
  }
  return EXM_OK;
}

/* Of handles whose weight is 0 nothing is looked at. */
static exm_status check_blended_targets(const blended_deformer *deformer, const double *targets)
{
  for (size_t h = 0; h < deformer->base.info.handle_count; h++) {
    int32_t const kind = deformer->base.handle_kinds[h];
    for (size_t i = 0; i < 12 && kind != EXM_HANDLE_FREE && deformer->handle_weights[h] > 0; i++) {
      if ((i % 4 == 3 || kind == EXM_HANDLE_ORIENTED) && !isfinite(targets[h * 12 + i])) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_HANDLE, h,
                             "targets: row %zu, column %zu of handle %zu is not finite", i / 4, i % 4, h);
      }
    }
  }
  return EXM_OK;
}

static exm_status check_row_targets(const blended_deformer *deformer, const double *row_targets)
{
  size_t const rows = added_rows(deformer), first = deformer->solver.held.handle_row_count;
  if (rows > 0 && !row_targets) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.row_targets is NULL, but %zu rows were added", rows);
  }
  for (size_t i = 0; i < 3 * rows; i++) {
    if (deformer->solver.held.weights[first + i / 3] > 0 && !isfinite(row_targets[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "settings.row_targets: coordinate %zu of row %zu is not finite", i % 3,
                        i / 3);
    }
  }
  return EXM_OK;
}

exm_status exm_blended_solve(exm_deformer *deformer, const double *targets, const exm_blended_solve_settings *settings,
                             exm_solve_report *report)
{
  double const start = clock_seconds();
  exm_blended_solve_settings own;
  exm_solve_report found;
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(targets, "targets"));
  exm_blended_solve_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(check_solve_settings(&own));
  TRY(check_blended_targets(blended_of(deformer), targets));
  TRY(check_row_targets(blended_of(deformer), own.row_targets));
  TRY(report_begin(&found, report));
  int const is_warm = own.start == EXM_START_WARM;
  blended_options const options = {.sparsity = own.sparsity,
                                   .tolerance = own.tolerance,
                                   .is_plain = own.begin == EXM_BEGIN_PLAIN,
                                   .scale = own.scale,
                                   .is_warm = is_warm,
                                   .average_iterations = own.average_iterations,
                                   .minimal_iterations = own.minimal_iterations,
                                   .final_iterations = own.final_iterations ? own.final_iterations
                                                       : is_warm            ? 2
                                                                            : 12};
  exm_status const status = blended_deformer_solve(blended_of(deformer), targets, own.row_targets, &options, &found);
  TRY(status);
  found.seconds = clock_seconds() - start;
  TRY(report_write(report, &found, sizeof found, "report"));
  if (status == EXM_OK && own.tolerance > 0 && !found.converged) {
    return status_set(EXM_WARNING_NOT_CONVERGED, "the last stage ended after %d iterations, before the tolerance of %g",
                      options.final_iterations, own.tolerance);
  }
  return status;
}

exm_status exm_blended_get_outcome(const exm_deformer *deformer, exm_blended_outcome *outcome)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(outcome, "outcome"));
  if (!deformer->has_result) {
    return status_set(EXM_ERROR_ARGUMENT, "deformer has not solved anything yet");
  }
  return report_write(outcome, &blended_const(deformer)->outcome, sizeof *outcome, "outcome");
}

exm_status exm_blended_get_info(const exm_deformer *deformer, exm_blended_info *info)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(info, "info"));
  exm_blended_info found = blended_const(deformer)->info;
  found.row_count = added_rows(blended_const(deformer));
  return report_write(info, &found, sizeof found, "info");
}

exm_status exm_blended_weights(const exm_deformer *deformer, float *weights)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(weights, "weights"));
  memcpy(weights, blended_const(deformer)->functions,
         blended_const(deformer)->skin_count * deformer->info.vertex_count * sizeof(float));
  return EXM_OK;
}

exm_status exm_blended_clusters(const exm_deformer *deformer, uint32_t *clusters)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(clusters, "clusters"));
  memcpy(clusters, blended_const(deformer)->clusters, deformer->info.vertex_count * sizeof *clusters);
  return EXM_OK;
}

exm_status exm_blended_result_pose(const exm_deformer *deformer, double *targets)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(targets, "targets"));
  if (!deformer->has_result) {
    return status_set(EXM_ERROR_ARGUMENT, "deformer has not solved anything yet");
  }
  blended_deformer_result_pose(blended_const(deformer), targets);
  return EXM_OK;
}

exm_status exm_blended_set_energies(exm_deformer *deformer, double constraint_weight, double smoothness)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_energies(constraint_weight, smoothness));
  blended *solver = &blended_of(deformer)->solver;
  return constraint_weight == solver->beta_lc && smoothness == solver->beta_sm
             ? EXM_OK
             : blended_set_energies(solver, constraint_weight, smoothness);
}
