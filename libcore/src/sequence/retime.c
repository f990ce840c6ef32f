/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edits of the time signal's frames: other times [SEQ, 4.2], and a stretch played again [SEQ, 4.1]. */
#include <math.h>
#include <string.h>

#include "sequence/sequence.h"

/** Length of the curve's parameter from one place to a later one; a closed curve may pass its beginning once. */
static double length_between(const bspline *curve, curve_place from, curve_place to)
{
  size_t const spans = bspline_span_count(curve->control_count, curve->is_cyclic);
  if (from.span == to.span && from.offset <= to.offset) {
    return to.offset - from.offset;
  }
  double length = bspline_span(curve, from.span) - from.offset + to.offset;
  for (size_t s = (from.span + 1) % spans; s != to.span; s = (s + 1) % spans) {
    length += bspline_span(curve, s);
  }
  return length;
}

exm_status window_resample(window *w, size_t count, const double *times)
{
  const bspline *curve = &w->time.curve;
  size_t const k = curve->control_count;
  time_signal fresh;
  TRY(time_signal_allocate(k, curve->is_cyclic, count, &fresh));
  memcpy(fresh.curve.points, curve->points, k * sizeof *curve->points);
  memcpy(fresh.curve.intervals, curve->intervals, bspline_interval_count(k, curve->is_cyclic) * sizeof(double));
  for (size_t i = 0; i < count; i++) {
    fresh.places[i] = time_signal_place(&w->time, times[i], NULL);
  }
  for (size_t i = 0; i < count; i++) {
    int const goes_on = i + 1 < count || curve->is_cyclic;
    fresh.steps[i] = goes_on ? length_between(curve, fresh.places[i], fresh.places[(i + 1) % count]) : 0;
  }
  time_signal_release(&w->time);
  w->time = fresh;
  return EXM_OK;
}

/** Where in the old curve the new one's control point or span number i comes from: up to `last` it is the same, then
 *  `period` of them `times` over again, then the rest. */
static size_t source_of(size_t i, size_t last, size_t period, size_t times)
{
  if (i <= last) {
    return i;
  }
  return i > last + times * period ? i - times * period : last + 1 - period + (i - last - 1) % period;
}

/** Copies of the frames of the spans that are played again; gives how many frames there are then. With `to` NULL they
 *  are only counted. */
static size_t repeat_frames(const time_signal *from, size_t last, size_t period, size_t times, time_signal *to)
{
  size_t const n = from->frame_count;
  size_t count = 0;
  for (size_t round = 0; round <= times; round++) {
    for (size_t i = 0; i < n; i++) {
      size_t const span = from->places[i].span;
      int const is_early = span <= last, is_repeated = is_early && span + period > last;
      if (round == 0 ? !is_early : round < times ? !is_repeated : is_early && !is_repeated) {
        continue;
      }
      if (to) {
        to->places[count] = (curve_place){span + round * period, from->places[i].offset};
        to->steps[count] = from->steps[i];
      }
      count++;
    }
  }
  return count;
}

exm_status window_loop(window *w, size_t first, size_t last, size_t times)
{
  const bspline *curve = &w->time.curve;
  size_t const k = curve->control_count, period = last - first, added = times * period;
  size_t const outer = curve->is_cyclic ? 0 : 2; /* intervals before the first span */
  time_signal fresh;
  size_t const frames = repeat_frames(&w->time, last, period, times, NULL);
  TRY(time_signal_allocate(k + added, curve->is_cyclic, frames, &fresh));
  for (size_t i = 0; i < k + added; i++) {
    memcpy(fresh.curve.points[i], curve->points[source_of(i, last, period, times)], sizeof *curve->points);
  }
  memcpy(fresh.curve.intervals, curve->intervals, outer * sizeof(double));
  for (size_t i = outer; i < bspline_interval_count(k + added, curve->is_cyclic); i++) {
    fresh.curve.intervals[i] = curve->intervals[outer + source_of(i - outer, last, period, times)];
  }
  repeat_frames(&w->time, last, period, times, &fresh);
  for (size_t i = 0; i + 1 < frames; i++) { /* at the seams the way goes on to another frame than it did */
    if (fresh.places[i].span <= last + added && fresh.places[i + 1].span > last) {
      fresh.steps[i] = length_between(&fresh.curve, fresh.places[i], fresh.places[i + 1]);
    }
  }
  time_signal_release(&w->time);
  w->time = fresh;
  return EXM_OK;
}
