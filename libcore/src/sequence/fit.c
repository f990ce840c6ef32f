/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>

#include "sequence/shape_signal.h"

/* Shares of the permitted sum of squares that are used up after the shape signal and after the pose signal: what one
 * leaves over is the next one's to use. */
static double const SHAPE_SHARE = 1.0 / 3, POSE_SHARE = 2.0 / 3;

/** What a sum of squares of coordinates is as an RMS distance over the diagonal. */
static double as_share(const exm_sequence *sequence, const signals *fitted, double squares)
{
  double const count = (double)fitted->shape.row_count * (double)sequence->reference->vertex_count;
  return sqrt(fmax(squares, 0) / count) / fitted->diagonal;
}

static double as_squares(const exm_sequence *sequence, double diagonal, double share)
{
  double const count = (double)sequence->frame_count * (double)sequence->reference->vertex_count;
  double const rms = share * diagonal;
  return rms * rms * count;
}

double plane_unit(const exm_sequence *sequence)
{
  return 1 / sqrt((double)sequence->reference->vertex_count);
}

static exm_status fit_shape(exm_sequence *sequence, const exm_sequence_fit_settings *settings, double limit,
                            const progress *report, signals *fitted)
{
  shape_request const request = {.space = &sequence->space,
                                 .frame_count = sequence->frame_count,
                                 .frames = (const float *const *)sequence->frames,
                                 .examples = settings->examples,
                                 .example_count = settings->example_count,
                                 .component_count = settings->component_count,
                                 .limit = SHAPE_SHARE * limit};
  TRY(shape_signal_fit(&fitted->memory, &request, report, &fitted->shape));
  /* Frames that are one and the same to rounding have nothing to place or to fit. */
  if (!(as_share(sequence, fitted, fitted->shape.total) > 1e-9)) {
    return status_set(EXM_ERROR_ARGUMENT, "all %zu frames have one and the same shape: there is nothing to fit",
                      sequence->frame_count);
  }
  fitted->unit = plane_unit(sequence);
  return EXM_OK;
}

static void fill_report(const exm_sequence *sequence, const signals *fitted, const window_errors *errors,
                        exm_sequence_fit_report *found)
{
  double const rest = fitted->shape.rest;
  found->component_count = fitted->shape.component_count;
  found->site_count = found->control_point_count = 0;
  for (size_t w = 0; w < fitted->window_count; w++) {
    found->site_count += fitted->windows[w].plate.site_count;
    found->control_point_count += fitted->windows[w].time.curve.control_count;
  }
  found->diagonal = fitted->diagonal;
  found->shape_error = as_share(sequence, fitted, rest);
  found->pose_error = as_share(sequence, fitted, rest + errors->pose);
  found->error = as_share(sequence, fitted, rest + errors->time);
  found->stress = errors->distances > 0 ? sqrt(errors->stress / errors->distances) : 0;
}

static exm_status fit(exm_sequence *sequence, const exm_sequence_fit_settings *settings, const progress *report,
                      signals *fitted, window_errors *errors)
{
  progress const shaping = progress_part(report, 0, 0.5), posing = progress_part(report, 0.5, 1);
  fitted->is_cyclic = settings->cyclic;
  fitted->diagonal = sequence->reference->report.diagonal;
  double const limit = as_squares(sequence, fitted->diagonal, settings->tolerance);
  TRY(fit_shape(sequence, settings, limit, &shaping, fitted));
  double const rest = fitted->shape.rest;
  window_request const request = {.fitted = fitted,
                                  .first_frame = 0,
                                  .count = sequence->frame_count,
                                  .timed_count = sequence->frame_count,
                                  .pins = &settings->pins,
                                  .site_count = settings->site_count,
                                  .control_count = settings->control_point_count,
                                  .pose_limit = fmax(POSE_SHARE * limit - rest, 0),
                                  .limit = fmax(limit - rest, 0)};
  fitted->windows = ARENA_NEW(&fitted->memory, window, 1);
  if (!fitted->windows) {
    return status_no_memory("the sequence");
  }
  progress const fitting = progress_part(&posing, 0, settings->cure_saddles ? 0.2 : 1);
  progress const curing = progress_part(&posing, 0.2, 1);
  TRY(window_fit(&request, &fitting, fitted->windows, errors));
  fitted->window_count = 1;
  if (settings->cure_saddles) {
    TRY(window_cure(&request, &curing, fitted->windows, errors));
  }
  return EXM_OK;
}

/** Saddles and acceleration, in the report. */
static exm_status judge(const signals *fitted, exm_sequence_fit_report *found)
{
  window_unrest unrest;
  TRY(window_judge(&fitted->windows[0], &unrest));
  found->saddle_count = unrest.saddle_count;
  found->acceleration = fitted->unit * unrest.acceleration / fitted->diagonal;
  return EXM_OK;
}

exm_status sequence_fit(exm_sequence *sequence, const exm_sequence_fit_settings *settings, const progress *report,
                        exm_sequence_fit_report *found)
{
  window_errors errors = {0};
  signals *fitted = calloc(1, sizeof *fitted);
  if (!fitted) {
    return status_no_memory("the sequence");
  }
  exm_status status = fit(sequence, settings, report, fitted, &errors);
  if (status >= 0) {
    fill_report(sequence, fitted, &errors, found);
    status = judge(fitted, found);
  }
  if (status >= 0) {
    status = sequence_adopt(sequence, fitted);
  }
  if (status < 0) {
    signals_release(fitted);
    return status;
  }
  return EXM_OK;
}

exm_status sequence_place(exm_sequence *sequence, const exm_pins *pins, int32_t iterations,
                          exm_sequence_fit_report *found)
{
  signals *fitted = sequence->fitted;
  window *old = &fitted->windows[0], fresh;
  window_errors errors = {0};
  size_t const fitted_controls = old->time.curve.control_count;
  window_request const request = {.fitted = fitted,
                                  .first_frame = old->first_frame,
                                  .count = old->fitted_count,
                                  .timed_count = old->timed_count,
                                  .pins = pins,
                                  .start = (const double(*)[2])old->positions,
                                  .iterations = (size_t)iterations,
                                  .site_count = old->plate.site_count,
                                  .control_count = fitted_controls};
  TRY(window_fit(&request, NULL, &fresh, &errors));
  window_release(old);
  *old = fresh;
  fill_report(sequence, fitted, &errors, found);
  return EXM_OK;
}
