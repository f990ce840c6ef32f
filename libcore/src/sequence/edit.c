/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edits of the time signal's curve [SEQ, 4.1]. Each builds a new time signal and then puts it in place. */
#include <string.h>

#include "sequence/sequence.h"

/** The span in whose middle a control point between index - 1 and index has its knot: the centre of a control point is
 *  the middle knot of its support. Near the ends of the curve it is the closest span that there is. */
static size_t middle_span(const bspline *curve, size_t index)
{
  size_t const spans = bspline_span_count(curve->control_count, curve->is_cyclic);
  size_t const span = index < 2 ? 0 : index - 2;
  return span < spans ? span : spans - 1;
}

/** Spans of zero length cannot be split: the nearest one that can. */
static size_t splittable_span(const bspline *curve, size_t span)
{
  size_t const spans = bspline_span_count(curve->control_count, curve->is_cyclic);
  for (size_t away = 0; away < spans; away++) {
    if (span + away < spans && bspline_span(curve, span + away) > 0) {
      return span + away;
    }
    if (span >= away && bspline_span(curve, span - away) > 0) {
      return span - away;
    }
  }
  return span;
}

/** Frames on a curve one of whose spans was split at `place`. */
static void split_places(const time_signal *from, curve_place place, time_signal *to)
{
  memcpy(to->steps, from->steps, from->frame_count * sizeof *to->steps);
  for (size_t i = 0; i < from->frame_count; i++) {
    curve_place p = from->places[i];
    if (p.span == place.span && p.offset >= place.offset) {
      p = (curve_place){p.span + 1, p.offset - place.offset};
    } else if (p.span > place.span) {
      p.span++;
    }
    to->places[i] = p;
  }
}

exm_status window_insert_control_point(window *w, size_t index, const double *point)
{
  const bspline *curve = &w->time.curve;
  size_t const k = curve->control_count, span = splittable_span(curve, middle_span(curve, index));
  curve_place const place = {span, bspline_span(curve, span) / 2};
  time_signal fresh;
  TRY(time_signal_allocate(k + 1, curve->is_cyclic, w->time.frame_count, &fresh));
  bspline_insert_knot(curve, place, &fresh.curve);
  if (point) { /* the same knots, but a polygon that is the old one with a new corner */
    memcpy(fresh.curve.points, curve->points, index * sizeof *curve->points);
    memcpy(fresh.curve.points[index], point, sizeof *curve->points);
    memcpy(fresh.curve.points + index + 1, curve->points + index, (k - index) * sizeof *curve->points);
  }
  split_places(&w->time, place, &fresh);
  time_signal_release(&w->time);
  w->time = fresh;
  return EXM_OK;
}

exm_status window_delete_control_point(window *w, size_t index)
{
  const bspline *curve = &w->time.curve;
  size_t const k = curve->control_count, spans = bspline_span_count(k, curve->is_cyclic);
  size_t const wanted = index < 2 ? 0 : index - 2, span = wanted + 1 < spans ? wanted : spans - 2;
  size_t const kept = span + (curve->is_cyclic ? 0 : 2); /* the interval that swallows the next one */
  double const length = bspline_span(curve, span);
  time_signal fresh;
  TRY(time_signal_allocate(k - 1, curve->is_cyclic, w->time.frame_count, &fresh));
  memcpy(fresh.curve.points, curve->points, index * sizeof *curve->points);
  memcpy(fresh.curve.points + index, curve->points + index + 1, (k - 1 - index) * sizeof *curve->points);
  memcpy(fresh.curve.intervals, curve->intervals, (kept + 1) * sizeof(double));
  fresh.curve.intervals[kept] += curve->intervals[kept + 1];
  memcpy(fresh.curve.intervals + kept + 1, curve->intervals + kept + 2,
         (bspline_interval_count(k, curve->is_cyclic) - kept - 2) * sizeof(double));
  memcpy(fresh.steps, w->time.steps, w->time.frame_count * sizeof(double));
  for (size_t i = 0; i < w->time.frame_count; i++) {
    curve_place const p = w->time.places[i];
    fresh.places[i] = p.span <= span       ? p
                      : p.span == span + 1 ? (curve_place){span, p.offset + length}
                                           : (curve_place){p.span - 1, p.offset};
  }
  time_signal_release(&w->time);
  w->time = fresh;
  return EXM_OK;
}
