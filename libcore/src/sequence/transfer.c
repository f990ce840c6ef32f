/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The shape signal replaced [SEQ, 4.3]. The paper writes the frames in terms of the examples and then fits pose and
 * time signals to these coordinates. Both are linear in the coordinates once the frames have their places and sites, so
 * the signals that are there, with all that was edited in them, are mapped instead. */
#include <stdlib.h>
#include <string.h>

#include "linalg/dense.h"
#include "sequence/shape_signal.h"

static exm_status copy_time(const time_signal *from, time_signal *to)
{
  size_t const k = from->curve.control_count;
  TRY(time_signal_allocate(k, from->curve.is_cyclic, from->frame_count, to));
  memcpy(to->curve.points, from->curve.points, k * sizeof *to->curve.points);
  memcpy(to->curve.intervals, from->curve.intervals, bspline_interval_count(k, from->curve.is_cyclic) * sizeof(double));
  memcpy(to->places, from->places, from->frame_count * sizeof *to->places);
  memcpy(to->steps, from->steps, from->frame_count * sizeof *to->steps);
  return EXM_OK;
}

/** g in other coordinates: side conditions are linear and hold on; the constant goes to the constant. */
static exm_status map_plate(const thin_plate *from, const shape_map *map, arena *owner, thin_plate *to)
{
  size_t const l = from->site_count, m = from->value_count;
  *to = *from;
  to->value_count = map->to;
  to->sites = arena_array(owner, l, sizeof *to->sites);
  to->coefficients = ARENA_NEW(owner, double, (l + 3) * map->to);
  if (!to->sites || !to->coefficients) {
    return status_no_memory("the pose signal");
  }
  memcpy(to->sites, from->sites, l * sizeof *to->sites);
  for (size_t j = 0; j < l + 3; j++) {
    dense_times(map->to, m, 1, map->linear, from->coefficients + j * m, to->coefficients + j * map->to);
  }
  dense_axpy(map->to, 1, map->constant, to->coefficients + l * map->to);
  return EXM_OK;
}

exm_status window_map(const window *from, const shape_map *map, window *out)
{
  size_t const n = from->fitted_count, l = from->plate.site_count;
  window w = {.first_frame = from->first_frame, .fitted_count = n, .timed_count = from->timed_count};
  w.positions = arena_array(&w.memory, n, sizeof *w.positions);
  w.pinned = ARENA_NEW(&w.memory, uint8_t, n);
  w.sites = ARENA_NEW(&w.memory, uint32_t, n);
  exm_status status = w.positions && w.pinned && w.sites ? EXM_OK : status_no_memory("the pose signal");
  if (status >= 0) {
    memcpy(w.positions, from->positions, n * sizeof *w.positions);
    memcpy(w.pinned, from->pinned, n);
    memcpy(w.sites, from->sites, l * sizeof *w.sites);
    if ((status = map_plate(&from->plate, map, &w.memory, &w.plate)) >= 0) {
      status = copy_time(&from->time, &w.time);
    }
  }
  if (status < 0) {
    window_release(&w);
    return status;
  }
  *out = w;
  return EXM_OK;
}

exm_status signals_map(const signals *from, const shape_map *map, signals *to)
{
  to->is_cyclic = from->is_cyclic;
  to->windows = ARENA_NEW(&to->memory, window, from->window_count);
  if (!to->windows) {
    return status_no_memory("the sequence");
  }
  for (; to->window_count < from->window_count; to->window_count++) {
    TRY(window_map(&from->windows[to->window_count], map, &to->windows[to->window_count]));
  }
  return EXM_OK;
}

exm_status sequence_transfer(exm_sequence *sequence, const float *source_examples, const mesh *target, int32_t kind,
                             const float *target_examples, size_t count, exm_sequence **out)
{
  shape_map map = {0};
  arena scratch = {0};
  exm_sequence *made = NULL;
  signals *fitted = calloc(1, sizeof *fitted);
  exm_status status = fitted ? sequence_create(target, kind, &made) : status_no_memory("the sequence");
  if (status >= 0 &&
      (status = shape_signal_transfer(&fitted->memory, &sequence->fitted->shape, &sequence->space, source_examples,
                                      &made->space, target_examples, count, &fitted->shape, &map)) >= 0 &&
      (status = signals_map(sequence->fitted, &map, fitted)) >= 0) {
    fitted->diagonal = made->reference->report.diagonal;
    fitted->unit = plane_unit(made);
    status = sequence_adopt(made, fitted);
  }
  arena_release(&scratch);
  if (status < 0) {
    signals_release(fitted);
    sequence_destroy(made);
    return status;
  }
  *out = made;
  return EXM_OK;
}
