/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"
#include "weights/bounded_biharmonic.h"
#include "weights/decomposition.h"
#include "weights/eigenfunctions.h"
#include "weights/handles.h"

exm_status exm_weights_bounded_biharmonic(const exm_mesh *m, const exm_handles *handles, exm_progress callback,
                                          void *user, float *weights)
{
  progress const whole = {.callback = callback, .user = user, .begin = 0, .end = 1};
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(handles, "handles"));
  TRY(check_pointer(weights, "weights"));
  TRY(handles_check_vertices(m, handles));
  return weights_bounded_biharmonic(m, handles, &whole, weights);
}

exm_status exm_weights_eigenfunctions(const exm_mesh *m, size_t count, exm_progress callback, void *user,
                                      double *values, double *functions)
{
  progress const whole = {.callback = callback, .user = user, .begin = 0, .end = 1};
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(values, "values"));
  TRY(check_pointer(functions, "functions"));
  if (count < 1 || count > m->vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "count is %zu, not 1 to the %zu vertices", count, m->vertex_count);
  }
  return weights_eigenfunctions(m, count, &whole, values, functions);
}

/* ------------------------------------------------------------------------------------------------------------ bones */

void exm_decompose_settings_init(exm_decompose_settings *settings)
{
  if (settings) {
    *settings = (exm_decompose_settings){
        .struct_size = sizeof *settings, .tolerance = 0.01, .bone_limit = 40, .influences = 4, .iterations = 20};
  }
}

void exm_decompose_report_init(exm_decompose_report *report)
{
  if (report) {
    *report = (exm_decompose_report){.struct_size = sizeof *report};
  }
}

static exm_status check_decompose_settings(const exm_decompose_settings *s, size_t vertex_count, size_t capacity)
{
  size_t const most = s->bone_count > 0 ? s->bone_count : s->bone_limit;
  if (most < 1 || most > vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.%s is %zu, not 1 to the %zu vertices",
                      s->bone_count > 0 ? "bone_count" : "bone_limit", most, vertex_count);
  }
  if (capacity < most) {
    return status_set(EXM_ERROR_ARGUMENT, "capacity is %zu, but there may be %zu bones", capacity, most);
  }
  if (!(s->tolerance >= 0) || !isfinite(s->tolerance)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.tolerance is %g, not 0 or more", s->tolerance);
  }
  if (s->influences < 1 || s->influences > DECOMPOSITION_INFLUENCES) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.influences is %d, not 1 to %d", s->influences,
                      DECOMPOSITION_INFLUENCES);
  }
  if (s->iterations < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.iterations is %d, not 0 or more", s->iterations);
  }
  return EXM_OK;
}

/* labels, where asked for, have to be copied while the decomposition is there. */
static void write_bones(const decomposition *d, size_t capacity, float *weights, double *transforms, uint32_t *labels)
{
  size_t const V = d->reference->vertex_count;
  memset(weights, 0, capacity * V * sizeof *weights);
  for (size_t v = 0; v < V; v++) {
    for (size_t i = 0; i < d->counts[v]; i++) {
      size_t const at = v * d->influence_limit + i;
      weights[d->bones[at] * V + v] = (float)d->weights[at];
    }
  }
  for (size_t b = 0; b < capacity && transforms; b++) {
    for (size_t s = 0; s < d->pose_count; s++) {
      double *to = transforms + (s * capacity + b) * 12;
      memset(to, 0, 12 * sizeof(double));
      for (size_t k = 0; k < 3 && b < d->bone_count; k++) {
        memcpy(to + 4 * k, d->transforms[b * d->pose_count + s].turn + 3 * k, 3 * sizeof(double));
        to[4 * k + 3] = d->transforms[b * d->pose_count + s].shift[k];
      }
    }
  }
  if (labels) {
    memcpy(labels, d->labels, V * sizeof *labels);
  }
}

static exm_status decompose(arena *scratch, const exm_decompose_settings *settings, const progress *whole,
                            const exm_mesh *m, const float *exemplars, size_t exemplar_count, decomposition *d,
                            exm_decompose_report *found)
{
  size_t const most = settings->bone_count > 0 ? settings->bone_count : settings->bone_limit;
  progress const clustering = progress_part(whole, 0, 0.5), alternating = progress_part(whole, 0.5, 1);
  TRY(decomposition_create(scratch, m, exemplars, exemplar_count, most, (size_t)settings->influences, d));
  TRY(decomposition_cluster(d, settings->bone_count, settings->tolerance * m->report.diagonal, &clustering));
  found->begin_error = decomposition_error(d, NULL);
  TRY(decomposition_alternate(d, settings->iterations, &alternating, &found->iterations));
  found->error = decomposition_error(d, &found->max_error);
  found->bone_count = d->bone_count;
  return EXM_OK;
}

// NOLINTNEXTLINE(readability-function-size): each array that the caller may want is an argument, as everywhere here
exm_status exm_weights_decompose(const exm_mesh *m, const float *exemplars, size_t exemplar_count,
                                 const exm_decompose_settings *settings, exm_progress callback, void *user,
                                 size_t capacity, float *weights, double *transforms, uint32_t *labels,
                                 exm_decompose_report *report)
{
  progress const whole = {.callback = callback, .user = user, .begin = 0, .end = 1};
  exm_decompose_settings own;
  exm_decompose_report found;
  arena scratch = {0};
  decomposition d;
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(exemplars, "exemplars"));
  TRY(check_pointer(weights, "weights"));
  TRY(report_check(report, "report"));
  exm_decompose_settings_init(&own);
  exm_decompose_report_init(&found);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(check_decompose_settings(&own, m->vertex_count, capacity));
  TRY(check_exemplars(exemplars, exemplar_count, m->vertex_count));
  exm_status status = decompose(&scratch, &own, &whole, m, exemplars, exemplar_count, &d, &found);
  if (status == EXM_OK) {
    write_bones(&d, capacity, weights, transforms, labels);
    status = report_write(report, &found, sizeof found, "report");
  }
  arena_release(&scratch);
  return status;
}
