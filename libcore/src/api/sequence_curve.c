/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The pose plane and the curve in it. */
#include <math.h>
#include <string.h>

#include "api/sequence.h"
#include "api/structs.h"
#include "sequence/sequence.h"

void exm_sequence_window_init(exm_sequence_window *out)
{
  if (out) {
    *out = (exm_sequence_window){.struct_size = sizeof *out};
  }
}

exm_status check_window(const exm_sequence *sequence, size_t w)
{
  TRY(check_fitted(sequence));
  if (w >= sequence->fitted->window_count) {
    return status_set(EXM_ERROR_ARGUMENT, "window is %zu, but the sequence has %zu", w, sequence->fitted->window_count);
  }
  return EXM_OK;
}

exm_status check_points(const double *points, size_t count, const char *name)
{
  for (size_t i = 0; i < 2 * count; i++) {
    if (!isfinite(points[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "%s: number %zu of point %zu is not finite", name, i % 2, i / 2);
    }
  }
  return EXM_OK;
}

exm_status exm_sequence_get_window(const exm_sequence *sequence, size_t w, exm_sequence_window *out)
{
  TRY(check_window(sequence, w));
  TRY(check_pointer(out, "out"));
  const window *from = &sequence->fitted->windows[w];
  size_t const k = from->time.curve.control_count;
  exm_sequence_window const found = {.struct_size = sizeof found,
                                     .first_frame = from->first_frame,
                                     .frame_count = from->time.frame_count,
                                     .control_point_count = k,
                                     .knot_count = bspline_interval_count(k, from->time.curve.is_cyclic) + 1,
                                     .site_count = from->plate.site_count,
                                     .fitted_frame_count = from->fitted_count};
  return report_write(out, &found, sizeof found, "out");
}

exm_status exm_sequence_curve(const exm_sequence *sequence, size_t w, double time, double *point)
{
  TRY(check_window(sequence, w));
  TRY(check_pointer(point, "point"));
  if (!isfinite(time)) {
    return status_set(EXM_ERROR_ARGUMENT, "time is %g, not finite", time);
  }
  const window *from = &sequence->fitted->windows[w];
  time_signal_evaluate(&from->time, time - (double)from->first_frame, point, NULL);
  return EXM_OK;
}

exm_status exm_sequence_get_frames(const exm_sequence *sequence, size_t w, double *positions, double *parameters,
                                   int32_t *pinned)
{
  TRY(check_window(sequence, w));
  const window *from = &sequence->fitted->windows[w];
  if (positions) {
    memcpy(positions, from->positions, from->fitted_count * sizeof *from->positions);
  }
  if (parameters) {
    time_signal_parameters(&from->time, parameters);
  }
  for (size_t i = 0; pinned && i < from->fitted_count; i++) {
    pinned[i] = from->pinned[i];
  }
  return EXM_OK;
}

exm_status exm_sequence_get_sites(const exm_sequence *sequence, size_t w, uint32_t *sites)
{
  TRY(check_window(sequence, w));
  TRY(check_pointer(sites, "sites"));
  const window *from = &sequence->fitted->windows[w];
  memcpy(sites, from->sites, from->plate.site_count * sizeof *sites);
  return EXM_OK;
}

exm_status exm_sequence_get_curve(const exm_sequence *sequence, size_t w, double *points, double *knots)
{
  TRY(check_window(sequence, w));
  const window *from = &sequence->fitted->windows[w];
  if (points) {
    memcpy(points, from->time.curve.points, from->time.curve.control_count * sizeof *from->time.curve.points);
  }
  if (knots) {
    time_signal_knots(&from->time, knots);
  }
  return EXM_OK;
}

/* ----------------------------------------------------------------------------------------------------------- edits */

exm_status exm_sequence_move_control_points(exm_sequence *sequence, size_t w, size_t first, size_t count,
                                            const double *points)
{
  TRY(check_window(sequence, w));
  TRY(check_pointer(points, "points"));
  bspline *curve = &sequence->fitted->windows[w].time.curve;
  if (first > curve->control_count || count > curve->control_count - first) {
    return status_set(EXM_ERROR_ARGUMENT, "first is %zu and count %zu, but the curve has %zu control points", first,
                      count, curve->control_count);
  }
  TRY(check_points(points, count, "points"));
  memcpy(curve->points + first, points, count * sizeof *curve->points);
  return EXM_OK;
}

exm_status exm_sequence_insert_control_point(exm_sequence *sequence, size_t w, size_t index, const double *point)
{
  TRY(check_window(sequence, w));
  const bspline *curve = &sequence->fitted->windows[w].time.curve;
  size_t const most = curve->is_cyclic ? curve->control_count : curve->control_count - 1;
  if (index < 1 || index > most) {
    return status_set(EXM_ERROR_ARGUMENT, "index is %zu, not between 1 and %zu", index, most);
  }
  if (point) {
    TRY(check_points(point, 1, "point"));
  }
  return window_insert_control_point(&sequence->fitted->windows[w], index, point);
}

exm_status exm_sequence_delete_control_point(exm_sequence *sequence, size_t w, size_t index)
{
  TRY(check_window(sequence, w));
  size_t const k = sequence->fitted->windows[w].time.curve.control_count;
  if (index >= k) {
    return status_set(EXM_ERROR_ARGUMENT, "index is %zu, but the curve has %zu control points", index, k);
  }
  if (k <= 4) {
    return status_set(EXM_ERROR_ARGUMENT, "a curve keeps 4 control points: none can be deleted");
  }
  return window_delete_control_point(&sequence->fitted->windows[w], index);
}

static exm_status check_knots(const double *knots, size_t control_count, int is_cyclic)
{
  size_t const count = bspline_interval_count(control_count, is_cyclic);
  size_t const begin = is_cyclic ? 0 : 2, end = is_cyclic ? count : control_count - 1;
  for (size_t i = 0; i <= count; i++) {
    if (!isfinite(knots[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "knots[%zu] is %g, not finite", i, knots[i]);
    }
    if (i > 0 && knots[i] < knots[i - 1]) {
      return status_set(EXM_ERROR_ARGUMENT, "knots[%zu] is %g, less than the one before, %g", i, knots[i],
                        knots[i - 1]);
    }
  }
  if (!(knots[end] > knots[begin])) {
    return status_set(EXM_ERROR_ARGUMENT, "knots[%zu] and [%zu] are both %g: the curve has no length", begin, end,
                      knots[begin]);
  }
  return EXM_OK;
}

exm_status exm_sequence_draw(exm_sequence *sequence, size_t control_point_count, const double *points,
                             const double *knots, size_t frame_count)
{
  TRY(check_fitted(sequence));
  TRY(check_pointer(points, "points"));
  int const is_cyclic = sequence->fitted->is_cyclic;
  if (sequence->fitted->window_count > 1) {
    return status_set(EXM_ERROR_ARGUMENT, "sequence has %zu windows: a curve can be drawn for one",
                      sequence->fitted->window_count);
  }
  if (control_point_count < 4 || control_point_count > INT32_MAX) {
    return status_set(EXM_ERROR_ARGUMENT, "control_point_count is %zu, not 4 or more", control_point_count);
  }
  if (frame_count < (is_cyclic ? 1 : 2) || frame_count > INT32_MAX) {
    return status_set(EXM_ERROR_ARGUMENT, "frame_count is %zu, not %d or more", frame_count, is_cyclic ? 1 : 2);
  }
  TRY(check_points(points, control_point_count, "points"));
  if (knots) {
    TRY(check_knots(knots, control_point_count, is_cyclic));
  }
  time_signal fresh;
  TRY(time_signal_draw(control_point_count, (const double(*)[2])points, knots, is_cyclic, frame_count, &fresh));
  time_signal_release(&sequence->fitted->windows[0].time);
  sequence->fitted->windows[0].time = fresh;
  return EXM_OK;
}
