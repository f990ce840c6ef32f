/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/time_signal.h"

#include <math.h>
#include <string.h>

#include "numeric/monotone.h"

/* A step of the parameter is no smaller than this share of the mean: frames that repeat each other are a halt of the
 * curve, but knots must not coincide. */
static double const SMALLEST_STEP = 1e-3;

exm_status time_signal_allocate(size_t control_count, int is_cyclic, size_t frame_count, time_signal *out)
{
  time_signal signal = {.frame_count = frame_count};
  signal.curve.control_count = control_count;
  signal.curve.is_cyclic = is_cyclic;
  signal.curve.points = arena_array(&signal.memory, control_count, sizeof *signal.curve.points);
  signal.curve.intervals = ARENA_NEW(&signal.memory, double, bspline_interval_count(control_count, is_cyclic));
  signal.places = ARENA_NEW(&signal.memory, curve_place, frame_count);
  signal.steps = ARENA_NEW(&signal.memory, double, frame_count);
  if (!signal.curve.points || !signal.curve.intervals || !signal.places || !signal.steps) {
    arena_release(&signal.memory);
    return status_no_memory("the time signal");
  }
  *out = signal;
  return EXM_OK;
}

void time_signal_release(time_signal *signal)
{
  arena_release(&signal->memory);
  *signal = (time_signal){0};
}

/** Centripetal steps [Lee 1989]: the root of the distance. */
static void choose_steps(const double (*points)[2], time_signal *signal)
{
  size_t const n = signal->frame_count, count = signal->curve.is_cyclic ? n : n - 1;
  double sum = 0;
  for (size_t i = 0; i < count; i++) {
    const double *from = points[i], *to = points[(i + 1) % n];
    signal->steps[i] = sqrt(hypot(to[0] - from[0], to[1] - from[1]));
    sum += signal->steps[i];
  }
  double const mean = sum > 0 ? sum / (double)count : 1;
  for (size_t i = 0; i < count; i++) {
    signal->steps[i] = sum > 0 ? fmax(signal->steps[i], SMALLEST_STEP * mean) : mean;
  }
}

exm_status time_signal_fit(size_t frame_count, const double (*points)[2], size_t control_count, int is_cyclic,
                           time_signal *out)
{
  time_signal signal;
  arena scratch = {0};
  TRY(time_signal_allocate(control_count, is_cyclic, frame_count, &signal));
  double *parameters = ARENA_NEW(&scratch, double, frame_count + 1);
  exm_status status = parameters ? EXM_OK : status_no_memory("the time signal");
  if (status >= 0) {
    choose_steps(points, &signal);
    for (size_t i = 0; i < frame_count; i++) {
      parameters[i + 1] = parameters[i] + signal.steps[i];
    }
    bspline_choose_knots(control_count, is_cyclic, frame_count, parameters, signal.curve.intervals, signal.places);
    status = bspline_fit(&signal.curve, frame_count, signal.places, points);
  }
  arena_release(&scratch);
  if (status < 0) {
    time_signal_release(&signal);
    return status;
  }
  *out = signal;
  return EXM_OK;
}

/** Frames at equal steps over the whole curve. */
static void place_evenly(time_signal *signal)
{
  size_t const spans = bspline_span_count(signal->curve.control_count, signal->curve.is_cyclic);
  size_t const n = signal->frame_count, count = signal->curve.is_cyclic ? n : n - 1;
  double length = 0;
  for (size_t s = 0; s < spans; s++) {
    length += bspline_span(&signal->curve, s);
  }
  for (size_t i = 0; i < n; i++) {
    signal->steps[i] = i < count ? length / (double)count : 0;
    signal->places[i] = bspline_walk(&signal->curve, (curve_place){0, 0}, length * (double)i / (double)count);
  }
}

exm_status time_signal_draw(size_t control_count, const double (*points)[2], const double *knots, int is_cyclic,
                            size_t frame_count, time_signal *out)
{
  time_signal signal;
  TRY(time_signal_allocate(control_count, is_cyclic, frame_count, &signal));
  memcpy(signal.curve.points, points, control_count * sizeof *points);
  for (size_t i = 0; i < bspline_interval_count(control_count, is_cyclic); i++) {
    signal.curve.intervals[i] = knots ? knots[i + 1] - knots[i] : 1;
  }
  place_evenly(&signal);
  *out = signal;
  return EXM_OK;
}

/** Step from frame i + away, or -1 where the frames end. */
static double step_near(const time_signal *signal, size_t i, int away)
{
  size_t const n = signal->frame_count;
  if (signal->curve.is_cyclic) {
    return signal->steps[(i + 2 * n + (size_t)(away + 2) - 2) % n];
  }
  size_t const shifted = i + (size_t)(away + 2);
  return shifted < 2 || shifted - 2 + 1 >= n ? -1 : signal->steps[shifted - 2];
}

static double slope_at(const time_signal *signal, size_t i, int away)
{
  double const steps[4] = {step_near(signal, i, away - 2), step_near(signal, i, away - 1), step_near(signal, i, away),
                           step_near(signal, i, away + 1)};
  return monotone_slope(steps);
}

/** The frame at or before a time, and the part of the way to the next one. */
static size_t split_time(const time_signal *signal, double time, double *part)
{
  double const n = (double)signal->frame_count;
  if (signal->curve.is_cyclic) {
    time -= n * floor(time / n);
    time = time < n ? time : 0; /* a tiny negative time wraps to n itself */
  } else {
    time = fmin(fmax(time, 0), n - 1);
  }
  *part = time - floor(time);
  return (size_t)time;
}

curve_place time_signal_place(const time_signal *signal, double time, double *speed)
{
  double part = 0, rate = 0;
  size_t const i = split_time(signal, time, &part);
  double const step = signal->steps[i];
  double const begin = slope_at(signal, i, 0), end = step_near(signal, i, 0) < 0 ? 0 : slope_at(signal, i, 1);
  double const advance = part > 0 ? monotone_value(step, begin, end, part, &rate) : 0;
  if (speed) {
    int const is_held = !signal->curve.is_cyclic && (time < 0 || time > (double)(signal->frame_count - 1));
    *speed = is_held ? 0 : part > 0 ? rate : begin;
  }
  return part > 0 ? bspline_walk(&signal->curve, signal->places[i], advance) : signal->places[i];
}

void time_signal_evaluate(const time_signal *signal, double time, double point[2], double derivative[2])
{
  double speed = 0;
  curve_place const place = time_signal_place(signal, time, &speed);
  bspline_evaluate(&signal->curve, place, point, derivative);
  for (int k = 0; derivative && k < 2; k++) {
    derivative[k] *= speed;
  }
}

void time_signal_knots(const time_signal *signal, double *knots)
{
  size_t const count = bspline_interval_count(signal->curve.control_count, signal->curve.is_cyclic);
  const double *intervals = signal->curve.intervals;
  knots[0] = signal->curve.is_cyclic ? 0 : -(intervals[0] + intervals[1]);
  for (size_t i = 0; i < count; i++) {
    knots[i + 1] = !signal->curve.is_cyclic && i == 1 ? 0 : knots[i] + intervals[i];
  }
}

void time_signal_parameters(const time_signal *signal, double *parameters)
{
  double before = 0;
  for (size_t i = 0, span = 0; i < signal->frame_count; i++) {
    for (; span < signal->places[i].span; span++) {
      before += bspline_span(&signal->curve, span);
    }
    for (; span > signal->places[i].span; span--) { /* a closed curve begins anew, or a frame goes back */
      before -= bspline_span(&signal->curve, span - 1);
    }
    parameters[i] = before + signal->places[i].offset;
  }
}
