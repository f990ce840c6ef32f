/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/sequence.h"

#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/sequence.h"
#include "api/structs.h"
#include "base/clock.h"

void exm_sequence_fit_settings_init(exm_sequence_fit_settings *settings)
{
  if (settings) {
    *settings = (exm_sequence_fit_settings){.struct_size = sizeof *settings, .tolerance = 1e-3};
  }
}

void exm_sequence_fit_report_init(exm_sequence_fit_report *report)
{
  if (report) {
    *report = (exm_sequence_fit_report){.struct_size = sizeof *report};
  }
}

void exm_sequence_info_init(exm_sequence_info *info)
{
  if (info) {
    *info = (exm_sequence_info){.struct_size = sizeof *info};
  }
}

void exm_sequence_file_report_init(exm_sequence_file_report *report)
{
  if (report) {
    *report = (exm_sequence_file_report){.struct_size = sizeof *report};
  }
}

exm_status exm_sequence_create(const exm_mesh *reference, int32_t kind, exm_sequence **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(reference, "mesh"));
  return sequence_create(reference, kind, out);
}

void exm_sequence_destroy(exm_sequence *sequence)
{
  sequence_destroy(sequence);
}

static exm_status check_triangles(const exm_sequence *sequence, const uint32_t *triangles, size_t triangle_count)
{
  const mesh *m = sequence->reference;
  if (triangle_count != m->triangle_count) {
    return status_set(EXM_ERROR_TOPOLOGY, "frame %zu has %zu triangles, but the mesh has %zu", sequence->frame_count,
                      triangle_count, m->triangle_count);
  }
  for (size_t f = 0; f < triangle_count; f++) {
    if (memcmp(triangles + 3 * f, m->triangles[f], sizeof *m->triangles) != 0) {
      return status_set_at(EXM_ERROR_TOPOLOGY, EXM_ELEMENT_FACE, f,
                           "frame %zu: triangle %zu has other corners than in the mesh", sequence->frame_count, f);
    }
  }
  return EXM_OK;
}

exm_status exm_sequence_add_frame(exm_sequence *sequence, const float *positions, size_t vertex_count,
                                  const uint32_t *triangles, size_t triangle_count)
{
  TRY(check_pointer(sequence, "sequence"));
  TRY(check_pointer(positions, "positions"));
  if (vertex_count != sequence->reference->vertex_count) {
    return status_set(EXM_ERROR_TOPOLOGY, "frame %zu has %zu vertices, but the mesh has %zu", sequence->frame_count,
                      vertex_count, sequence->reference->vertex_count);
  }
  if (triangles) {
    TRY(check_triangles(sequence, triangles, triangle_count));
  }
  for (size_t i = 0; i < 3 * vertex_count; i++) {
    if (!isfinite(positions[i])) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, i / 3,
                           "frame %zu has a coordinate that is not finite at vertex %zu", sequence->frame_count, i / 3);
    }
  }
  return sequence_add_frame(sequence, positions);
}

exm_status exm_sequence_drop_frames(exm_sequence *sequence)
{
  TRY(check_fitted(sequence));
  sequence_drop_frames(sequence);
  return EXM_OK;
}

exm_status check_fitted(const exm_sequence *sequence)
{
  TRY(check_pointer(sequence, "sequence"));
  return sequence->fitted ? EXM_OK : status_set(EXM_ERROR_ARGUMENT, "sequence has not been fitted yet");
}

exm_status exm_sequence_get_info(const exm_sequence *sequence, exm_sequence_info *info)
{
  TRY(check_pointer(sequence, "sequence"));
  TRY(check_pointer(info, "info"));
  exm_sequence_info found = {.struct_size = sizeof found,
                             .vertex_count = sequence->reference->vertex_count,
                             .triangle_count = sequence->reference->triangle_count,
                             .held_frame_count = sequence->frame_count,
                             .dimension = sequence->space.dimension,
                             .shape_space = sequence->kind,
                             .is_fitted = sequence->fitted != NULL};
  if (sequence->fitted) {
    found.cyclic = sequence->fitted->is_cyclic;
    found.window_count = sequence->fitted->window_count;
    found.frame_count = signals_frame_count(sequence->fitted);
    found.component_count = sequence->fitted->shape.component_count;
  }
  return report_write(info, &found, sizeof found, "info");
}

/* ------------------------------------------------------------------------------------------------------------- fit */

static exm_status check_count(size_t count, size_t least, const char *name, const char *what)
{
  if (count != 0 && count < least) {
    return status_set(EXM_ERROR_ARGUMENT, "%s is %zu, but %s needs %zu at least (0 leaves it to the tolerance)", name,
                      count, what, least);
  }
  return EXM_OK;
}

static exm_status check_pins(const exm_pins *pins, size_t frame_count)
{
  if (pins->count == 0) {
    return EXM_OK;
  }
  TRY(check_pointer(pins->frames, "pins.frames"));
  TRY(check_pointer(pins->positions, "pins.positions"));
  for (size_t i = 0; i < pins->count; i++) {
    if (pins->frames[i] >= frame_count) {
      return status_set(EXM_ERROR_ARGUMENT, "pins.frames[%zu] is %u, but there are %zu frames", i, pins->frames[i],
                        frame_count);
    }
    if (!isfinite(pins->positions[2 * i]) || !isfinite(pins->positions[2 * i + 1])) {
      return status_set(EXM_ERROR_ARGUMENT, "pins.positions[%zu] is not finite", i);
    }
    for (size_t j = 0; j < i; j++) {
      if (pins->frames[i] == pins->frames[j]) {
        return status_set(EXM_ERROR_ARGUMENT, "pins.frames[%zu] and [%zu] are both frame %u", j, i, pins->frames[i]);
      }
    }
  }
  return EXM_OK;
}

static exm_status check_window_size(const exm_sequence_fit_settings *settings)
{
  size_t const size = settings->window_size, overlap = settings->window_overlap;
  if (size == 0) {
    return EXM_OK;
  }
  if (size < 8 || size > INT32_MAX) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.window_size is %zu, not 8 or more (or 0)", size);
  }
  if (overlap != 0 && (overlap < 2 || overlap > size / 2)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.window_overlap is %zu, not between 2 and %zu", overlap, size / 2);
  }
  if (settings->cyclic) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.window_size is %zu, but a cyclic sequence has one window", size);
  }
  return EXM_OK;
}

static exm_status check_settings(const exm_sequence *sequence, const exm_sequence_fit_settings *settings)
{
  size_t const frame_count = sequence->frame_count;
  TRY(check_count(settings->control_point_count, 4, "settings.control_point_count", "a cubic curve"));
  TRY(check_count(settings->site_count, 3, "settings.site_count", "a plane"));
  if (!(settings->tolerance > 0) || !isfinite(settings->tolerance)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.tolerance is %g, not more than 0", settings->tolerance);
  }
  if (settings->cyclic != 0 && settings->cyclic != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.cyclic is %d, not 0 or 1", settings->cyclic);
  }
  if (settings->cure_saddles != 0 && settings->cure_saddles != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.cure_saddles is %d, not 0 or 1", settings->cure_saddles);
  }
  TRY(check_window_size(settings));
  size_t const least = settings->cyclic ? 4 : 3;
  if (frame_count < least) {
    return status_set(EXM_ERROR_ARGUMENT, "the sequence has %zu frame%s: %s needs %zu at least", frame_count,
                      frame_count == 1 ? "" : "s", settings->cyclic ? "a cyclic one" : "a fit", least);
  }
  if (settings->examples && settings->example_count < 2) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.example_count is %zu, not 2 or more", settings->example_count);
  }
  if (settings->examples) {
    TRY(check_shapes(settings->examples, settings->example_count, sequence->reference->vertex_count,
                     "settings.examples", "example"));
  }
  return check_pins(&settings->pins, frame_count);
}

exm_status exm_sequence_fit(exm_sequence *sequence, const exm_sequence_fit_settings *settings, exm_progress callback,
                            void *user, exm_sequence_fit_report *report)
{
  double const start = clock_seconds();
  progress const whole = {.callback = callback, .user = user, .begin = 0, .end = 1};
  exm_sequence_fit_settings own;
  exm_sequence_fit_report found = {.struct_size = sizeof found};
  TRY(check_pointer(sequence, "sequence"));
  exm_sequence_fit_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  TRY(report_check(report, "report"));
  TRY(check_settings(sequence, &own));
  TRY(sequence_fit(sequence, &own, &whole, &found));
  found.seconds = clock_seconds() - start;
  return report_write(report, &found, sizeof found, "report");
}

exm_status exm_sequence_place(exm_sequence *sequence, const exm_pins *pins, int32_t iterations,
                              exm_sequence_fit_report *report)
{
  double const start = clock_seconds();
  exm_sequence_fit_report found = {.struct_size = sizeof found};
  TRY(check_fitted(sequence));
  if (sequence->fitted->window_count > 1) {
    return status_set(EXM_ERROR_ARGUMENT, "sequence has %zu windows: frames can be placed in one",
                      sequence->fitted->window_count);
  }
  TRY(check_pointer(pins, "pins"));
  TRY(check_pins(pins, sequence->fitted->shape.row_count));
  if (iterations < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "iterations is %d, not 0 or more", iterations);
  }
  TRY(report_check(report, "report"));
  TRY(sequence_place(sequence, pins, iterations, &found));
  found.seconds = clock_seconds() - start;
  return report_write(report, &found, sizeof found, "report");
}

/* -------------------------------------------------------------------------------------------------------- sampling */

static exm_status check_time(double time)
{
  return isfinite(time) ? EXM_OK : status_set(EXM_ERROR_ARGUMENT, "time is %g, not finite", time);
}

exm_status exm_sequence_evaluate(exm_sequence *sequence, double time, float *positions)
{
  TRY(check_fitted(sequence));
  TRY(check_time(time));
  TRY(check_pointer(positions, "positions"));
  return sequence_evaluate(sequence, time, positions);
}

exm_status exm_sequence_evaluate_f64(exm_sequence *sequence, double time, double *positions)
{
  TRY(check_fitted(sequence));
  TRY(check_time(time));
  TRY(check_pointer(positions, "positions"));
  return sequence_evaluate_f64(sequence, time, positions);
}

exm_status exm_sequence_derivative(exm_sequence *sequence, double time, int32_t order, double *derivative)
{
  TRY(check_fitted(sequence));
  TRY(check_time(time));
  TRY(check_pointer(derivative, "derivative"));
  if (order != 1 && order != 2) {
    return status_set(EXM_ERROR_ARGUMENT, "order is %d, not 1 or 2", order);
  }
  return sequence_derivative(sequence, time, order, derivative);
}

exm_status exm_sequence_pose(exm_sequence *sequence, size_t w, const double *point, float *positions)
{
  TRY(check_window(sequence, w));
  TRY(check_pointer(point, "point"));
  TRY(check_pointer(positions, "positions"));
  TRY(check_points(point, 1, "point"));
  return sequence_pose(sequence, w, point, positions);
}

exm_status exm_sequence_measure(exm_sequence *sequence, double *rms, double *largest)
{
  TRY(check_fitted(sequence));
  if (sequence->frame_count == 0 || sequence->frame_count != signals_frame_count(sequence->fitted)) {
    return status_set(EXM_ERROR_ARGUMENT, "the sequence holds %zu frames, but its time signal has %zu",
                      sequence->frame_count, signals_frame_count(sequence->fitted));
  }
  return sequence_measure(sequence, rms, largest);
}

/* ----------------------------------------------------------------------------------------------------------- files */

exm_status exm_sequence_save(const exm_sequence *sequence, const char *path, exm_sequence_file_report *report)
{
  exm_sequence_file_report found = {.struct_size = sizeof found};
  TRY(check_fitted(sequence));
  TRY(check_pointer(path, "path"));
  TRY(report_check(report, "report"));
  TRY(sequence_save(sequence, path, &found));
  return report_write(report, &found, sizeof found, "report");
}

exm_status exm_sequence_load(const char *path, exm_sequence_file_report *report, exm_sequence **out)
{
  exm_sequence_file_report found = {.struct_size = sizeof found};
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(path, "path"));
  TRY(report_check(report, "report"));
  TRY(sequence_load(path, &found, out));
  return report_write(report, &found, sizeof found, "report");
}
