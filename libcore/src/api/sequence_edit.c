/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edits of the frames, and of the shape signal. */
#include <math.h>
#include <stdlib.h>

#include "api/checks.h"
#include "api/sequence.h"
#include "api/structs.h"
#include "sequence/sequence.h"

static exm_status check_single(const exm_sequence *sequence)
{
  TRY(check_fitted(sequence));
  if (sequence->fitted->window_count > 1) {
    return status_set(EXM_ERROR_ARGUMENT, "sequence has %zu windows: this edit is for sequences of one",
                      sequence->fitted->window_count);
  }
  return EXM_OK;
}

static exm_status check_times(const time_signal *time, const double *times, size_t count)
{
  double const last = (double)time->frame_count - 1;
  for (size_t i = 0; i < count; i++) {
    if (!isfinite(times[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "times[%zu] is %g, not finite", i, times[i]);
    }
    if (i > 0 && times[i] < times[i - 1]) {
      return status_set(EXM_ERROR_ARGUMENT, "times[%zu] is %g, before times[%zu], %g", i, times[i], i - 1,
                        times[i - 1]);
    }
    if (!time->curve.is_cyclic && (times[i] < 0 || times[i] > last)) {
      return status_set(EXM_ERROR_ARGUMENT, "times[%zu] is %g, not within 0 and %g", i, times[i], last);
    }
  }
  if (time->curve.is_cyclic && !(times[count - 1] - times[0] < (double)time->frame_count)) {
    return status_set(EXM_ERROR_ARGUMENT, "times: from %g to %g they go round more than once in %zu frames", times[0],
                      times[count - 1], time->frame_count);
  }
  return EXM_OK;
}

exm_status exm_sequence_resample(exm_sequence *sequence, const double *times, size_t count)
{
  TRY(check_single(sequence));
  TRY(check_pointer(times, "times"));
  window *w = &sequence->fitted->windows[0];
  size_t const least = w->time.curve.is_cyclic ? 1 : 2;
  if (count < least || count > INT32_MAX) {
    return status_set(EXM_ERROR_ARGUMENT, "count is %zu, not %zu or more", count, least);
  }
  TRY(check_times(&w->time, times, count));
  return window_resample(w, count, times);
}

exm_status exm_sequence_convert_rate(exm_sequence *sequence, double ratio)
{
  TRY(check_single(sequence));
  window *w = &sequence->fitted->windows[0];
  int const is_cyclic = w->time.curve.is_cyclic;
  double const length = (double)(w->time.frame_count - (is_cyclic ? 0 : 1));
  double const frames = is_cyclic ? fmax(rint(length * ratio), 1) : floor(length * ratio + 1e-9) + 1;
  if (!(ratio > 0) || !(frames >= (is_cyclic ? 1 : 2)) || !(frames <= INT32_MAX)) {
    return status_set(EXM_ERROR_ARGUMENT, "ratio is %g: of %zu frames it would make %.0f", ratio, w->time.frame_count,
                      frames);
  }
  size_t const count = (size_t)frames;
  double *times = malloc(count * sizeof *times);
  if (!times) {
    return status_no_memory("the frames' times");
  }
  for (size_t i = 0; i < count; i++) {
    times[i] = is_cyclic ? (double)i * length / frames : fmin((double)i / ratio, length);
  }
  exm_status const status = window_resample(w, count, times);
  free(times);
  return status;
}

/** Frames in the order of the curve: after a resampling a closed one may begin anywhere. */
static exm_status check_order(const time_signal *time)
{
  for (size_t i = 1; i < time->frame_count; i++) {
    if (time->places[i].span < time->places[i - 1].span) {
      return status_set(
          EXM_ERROR_ARGUMENT,
          "sequence was resampled across the beginning of its closed curve: loops are no longer possible");
    }
  }
  return EXM_OK;
}

exm_status exm_sequence_loop(exm_sequence *sequence, double from, double to, size_t count)
{
  TRY(check_single(sequence));
  window *w = &sequence->fitted->windows[0];
  double const last = (double)w->time.frame_count - (w->time.curve.is_cyclic ? 0 : 1);
  if (!(from >= 0) || !(to > from) || !(to <= last)) {
    return status_set(EXM_ERROR_ARGUMENT, "from is %g and to is %g: 0 <= from < to <= %g is wanted", from, to, last);
  }
  TRY(check_order(&w->time));
  size_t const begin = time_signal_place(&w->time, from, NULL).span;
  size_t const end = to < last || !w->time.curve.is_cyclic ? time_signal_place(&w->time, to, NULL).span
                                                           : w->time.curve.control_count - 1;
  if (count < 1 || count > (size_t)INT32_MAX / (end - begin + 1)) {
    return status_set(EXM_ERROR_ARGUMENT, "count is %zu, not a sensible number of repetitions", count);
  }
  if (end <= begin) {
    return status_set(EXM_ERROR_ARGUMENT, "from is %g and to is %g: there is no knot of the curve between them", from,
                      to);
  }
  return window_loop(w, begin, end, count);
}

exm_status exm_sequence_add_pose(exm_sequence *sequence, const float *positions, const double *point)
{
  TRY(check_single(sequence));
  TRY(check_pointer(positions, "positions"));
  TRY(check_pointer(point, "point"));
  TRY(check_shapes(positions, 1, sequence->reference->vertex_count, "positions", "pose"));
  TRY(check_points(point, 1, "point"));
  return sequence_add_pose(sequence, positions, point);
}

exm_status exm_sequence_transfer(exm_sequence *sequence, const float *source_examples, const exm_mesh *target,
                                 int32_t kind, const float *target_examples, size_t count, exm_sequence **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_fitted(sequence));
  TRY(check_pointer(source_examples, "source_examples"));
  TRY(check_pointer(target, "target"));
  TRY(check_pointer(target_examples, "target_examples"));
  if (count < 2) {
    return status_set(EXM_ERROR_ARGUMENT, "count is %zu: a transfer needs two examples at least", count);
  }
  TRY(check_shapes(source_examples, count, sequence->reference->vertex_count, "source_examples", "example"));
  TRY(check_shapes(target_examples, count, target->vertex_count, "target_examples", "example"));
  return sequence_transfer(sequence, source_examples, target, kind, target_examples, count, out);
}
