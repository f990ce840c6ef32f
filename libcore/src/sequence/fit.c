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

/** How many windows, all of one size but for the last, which ends with the frames. */
static size_t count_windows(size_t frames, size_t size, size_t overlap)
{
  return size == 0 || size >= frames ? 1 : (frames - overlap + size - overlap - 1) / (size - overlap);
}

static exm_status fit_windows(const exm_sequence *sequence, const exm_sequence_fit_settings *settings, double limit,
                              const progress *report, signals *fitted, window_errors *errors)
{
  size_t const n = sequence->frame_count;
  size_t const overlap = settings->window_overlap ? settings->window_overlap : settings->window_size / 4;
  size_t const count = count_windows(n, settings->window_size, overlap), size = count > 1 ? settings->window_size : n;
  double const rest = fitted->shape.rest;
  fitted->windows = ARENA_NEW(&fitted->memory, window, count);
  if (!fitted->windows) {
    return status_no_memory("the sequence");
  }
  for (size_t i = 0; i < count; i++) {
    window_errors own = {0};
    /* The last window goes back as far as it takes to be of the size of the others. */
    size_t const wanted = i * (size - overlap), first = wanted + size > n ? n - size : wanted;
    double const share = 1 / (double)count;
    progress const part = progress_part(report, (double)i / (double)count, (double)(i + 1) / (double)count);
    progress const fitting = progress_part(&part, 0, settings->cure_saddles ? 0.2 : 1);
    progress const curing = progress_part(&part, 0.2, 1);
    window_request const request = {.fitted = fitted,
                                    .first_frame = first,
                                    .count = size,
                                    .timed_count = size,
                                    .pins = &settings->pins,
                                    .site_count = settings->site_count,
                                    .control_count = settings->control_point_count,
                                    .pose_limit = share * fmax(POSE_SHARE * limit - rest, 0),
                                    .limit = share * fmax(limit - rest, 0)};
    TRY(window_fit(&request, &fitting, &fitted->windows[i], &own));
    fitted->window_count++;
    if (settings->cure_saddles) {
      TRY(window_cure(&request, &curing, &fitted->windows[i], &own));
    }
    errors->pose += own.pose;
    errors->time += own.time;
    errors->stress += own.stress;
    errors->distances += own.distances;
  }
  return EXM_OK;
}

static exm_status fit(exm_sequence *sequence, const exm_sequence_fit_settings *settings, const progress *report,
                      signals *fitted, window_errors *errors)
{
  progress const shaping = progress_part(report, 0, 0.5), posing = progress_part(report, 0.5, 1);
  fitted->is_cyclic = settings->cyclic;
  fitted->diagonal = sequence->reference->report.diagonal;
  double const limit = as_squares(sequence, fitted->diagonal, settings->tolerance);
  TRY(fit_shape(sequence, settings, limit, &shaping, fitted));
  return fit_windows(sequence, settings, limit, &posing, fitted, errors);
}

/** Saddles and acceleration, in the report. */
static exm_status judge(const signals *fitted, exm_sequence_fit_report *found)
{
  for (size_t i = 0; i < fitted->window_count; i++) {
    window_unrest unrest;
    TRY(window_judge(&fitted->windows[i], &unrest));
    found->saddle_count += unrest.saddle_count;
    found->acceleration = fmax(found->acceleration, fitted->unit * unrest.acceleration / fitted->diagonal);
  }
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
