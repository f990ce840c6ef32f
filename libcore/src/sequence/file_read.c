/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A file is not trusted: its check sum says that it is what somebody wrote, not that this was us. Every count is
 * compared with the bytes that are left before anything is allocated for it, and every number with its range before it
 * is used. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/crc.h"
#include "sequence/file.h"

typedef struct source {
  const char *path;
  const unsigned char *at, *end;
} source;

static exm_status damaged(const source *s, const char *what)
{
  return status_set(EXM_ERROR_IO, "%s is damaged: %s", s->path, what);
}

/* ---------------------------------------------------------------------------------------------------------- numbers */

static size_t left(const source *s)
{
  return (size_t)(s->end - s->at);
}

/** The next `size` bytes as a number; the caller has checked that they are there. */
static uint64_t take(source *s, size_t size)
{
  uint64_t value = 0;
  for (size_t i = 0; i < size; i++) {
    value |= (uint64_t)s->at[i] << (8 * i);
  }
  s->at += size;
  return value;
}

static double take_double(source *s)
{
  uint64_t const bits = take(s, 8);
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/** `count` numbers of `size` bytes each, and `each` of them an element, must be left. */
static exm_status expect(const source *s, size_t count, size_t each, size_t size, const char *what)
{
  if (count > left(s) / (each * size)) {
    return status_set(EXM_ERROR_IO, "%s is damaged: it ends within %s", s->path, what);
  }
  return EXM_OK;
}

/** A small number between low and high, of 4 bytes. */
static exm_status get_small(source *s, uint32_t low, uint32_t high, const char *what, uint32_t *out)
{
  TRY(expect(s, 1, 1, 4, what));
  *out = (uint32_t)take(s, 4);
  if (*out < low || *out > high) {
    return status_set(EXM_ERROR_IO, "%s is damaged: %s is %u", s->path, what, *out);
  }
  return EXM_OK;
}

static exm_status get_count(source *s, size_t low, size_t high, const char *what, size_t *out)
{
  TRY(expect(s, 1, 1, 8, what));
  uint64_t const value = take(s, 8);
  if (value < low || value > high || value > FILE_LARGEST_COUNT) {
    return status_set(EXM_ERROR_IO, "%s is damaged: %s is %llu", s->path, what, (unsigned long long)value);
  }
  *out = (size_t)value;
  return EXM_OK;
}

static exm_status get_doubles(source *s, arena *owner, size_t count, size_t each, double low, const char *what,
                              double **out)
{
  TRY(expect(s, count, each, 8, what));
  double *values = ARENA_NEW(owner, double, count *each);
  if (!values) {
    return status_no_memory(what);
  }
  for (size_t i = 0; i < count * each; i++) {
    values[i] = take_double(s);
    if (!isfinite(values[i]) || values[i] < low) {
      return status_set(EXM_ERROR_IO, "%s is damaged: number %zu of %s is %g", s->path, i, what, values[i]);
    }
  }
  *out = values;
  return EXM_OK;
}

static exm_status get_singles(source *s, arena *owner, size_t count, size_t each, const char *what, float **out)
{
  TRY(expect(s, count, each, 4, what));
  float *values = ARENA_NEW(owner, float, count *each);
  if (!values) {
    return status_no_memory(what);
  }
  for (size_t i = 0; i < count * each; i++) {
    uint32_t const bits = (uint32_t)take(s, 4);
    memcpy(values + i, &bits, sizeof bits);
    if (!isfinite(values[i])) {
      return status_set(EXM_ERROR_IO, "%s is damaged: number %zu of %s is not finite", s->path, i, what);
    }
  }
  *out = values;
  return EXM_OK;
}

static exm_status get_indices(source *s, arena *owner, size_t count, size_t each, size_t limit, const char *what,
                              uint32_t **out)
{
  TRY(expect(s, count, each, 4, what));
  uint32_t *values = ARENA_NEW(owner, uint32_t, count * each);
  if (!values) {
    return status_no_memory(what);
  }
  for (size_t i = 0; i < count * each; i++) {
    values[i] = (uint32_t)take(s, 4);
    if (values[i] >= limit) {
      return status_set(EXM_ERROR_IO, "%s is damaged: number %zu of %s is %u", s->path, i, what, values[i]);
    }
  }
  *out = values;
  return EXM_OK;
}

static exm_status get_double(source *s, double low, const char *what, double *out)
{
  arena scratch = {0};
  double *value = NULL;
  exm_status const status = get_doubles(s, &scratch, 1, 1, low, what, &value);
  if (status >= 0) {
    *out = *value;
  }
  arena_release(&scratch);
  return status;
}

/* --------------------------------------------------------------------------------------------------------- sections */

static exm_status get_mesh(source *s, arena *scratch, mesh **out)
{
  size_t vertex_count = 0, triangle_count = 0;
  float *positions = NULL;
  uint32_t *triangles = NULL;
  TRY(get_count(s, 1, SIZE_MAX, "the number of vertices", &vertex_count));
  TRY(get_count(s, 1, SIZE_MAX, "the number of triangles", &triangle_count));
  TRY(get_singles(s, scratch, vertex_count, 3, "the reference", &positions));
  TRY(get_indices(s, scratch, triangle_count, 3, vertex_count, "the triangles", &triangles));
  exm_status const status =
      mesh_create((const float(*)[3])positions, vertex_count, (const uint32_t(*)[3])triangles, triangle_count, out);
  if (status < 0 && status != EXM_ERROR_OUT_OF_MEMORY) {
    return damaged(s, "its mesh is not a usable one");
  }
  return status;
}

static exm_status get_shape(source *s, size_t dimension, arena *owner, pca *shape)
{
  TRY(get_count(s, 1, SIZE_MAX, "the number of frames", &shape->row_count));
  TRY(get_count(s, dimension, dimension, "the dimension of the shape space", &shape->dimension));
  TRY(get_count(s, 1, SIZE_MAX, "the number of components", &shape->component_count));
  TRY(get_double(s, 0, "the variation", &shape->total));
  TRY(get_double(s, 0, "the variation", &shape->rest));
  TRY(get_singles(s, owner, shape->dimension, 1, "the mean shape", &shape->mean));
  TRY(get_singles(s, owner, shape->component_count, shape->dimension, "the components", &shape->basis));
  return get_doubles(s, owner, shape->row_count, shape->component_count, -INFINITY, "the frames' coordinates",
                     &shape->coordinates);
}

static exm_status get_pinned(source *s, window *w)
{
  TRY(expect(s, w->fitted_count, 1, 1, "the pins"));
  w->pinned = ARENA_NEW(&w->memory, uint8_t, w->fitted_count);
  if (!w->pinned) {
    return status_no_memory("the pins");
  }
  for (size_t i = 0; i < w->fitted_count; i++) {
    w->pinned[i] = (uint8_t)take(s, 1);
    if (w->pinned[i] > 1) {
      return damaged(s, "a pin is neither 0 nor 1");
    }
  }
  return EXM_OK;
}

static exm_status get_pose(source *s, const pca *shape, window *w)
{
  thin_plate *plate = &w->plate;
  size_t const m = shape->component_count;
  double *numbers = NULL;
  TRY(get_count(s, 0, shape->row_count - 1, "the first frame of a window", &w->first_frame));
  TRY(get_count(s, 1, shape->row_count - w->first_frame, "the number of frames of a window", &w->fitted_count));
  TRY(get_count(s, 1, w->fitted_count, "the number of frames of a window", &w->timed_count));
  TRY(get_doubles(s, &w->memory, w->fitted_count, 2, -INFINITY, "the frames in the pose plane", &numbers));
  w->positions = (double(*)[2])(void *)numbers;
  TRY(get_pinned(s, w));
  TRY(get_count(s, 0, w->fitted_count, "the number of sites", &plate->site_count));
  TRY(get_indices(s, &w->memory, plate->site_count, 1, w->fitted_count, "the sites", &w->sites));
  TRY(get_double(s, -INFINITY, "the centre of the pose plane", &plate->centre[0]));
  TRY(get_double(s, -INFINITY, "the centre of the pose plane", &plate->centre[1]));
  TRY(get_double(s, 0, "the scale of the pose plane", &plate->scale));
  TRY(get_doubles(s, &w->memory, plate->site_count, 2, -INFINITY, "the sites", &numbers));
  plate->sites = (double(*)[2])(void *)numbers;
  plate->value_count = m;
  return get_doubles(s, &w->memory, plate->site_count + 3, m, -INFINITY, "the pose signal", &plate->coefficients);
}

/** Frames' places on the curve: within their spans. */
static exm_status get_places(source *s, time_signal *time)
{
  size_t const spans = bspline_span_count(time->curve.control_count, time->curve.is_cyclic);
  TRY(expect(s, time->frame_count, 1, 12, "the frames on the curve"));
  time->places = ARENA_NEW(&time->memory, curve_place, time->frame_count);
  if (!time->places) {
    return status_no_memory("the frames on the curve");
  }
  for (size_t i = 0; i < time->frame_count; i++) {
    curve_place place = {(size_t)take(s, 4), 0};
    place.offset = take_double(s);
    if (place.span >= spans || !(place.offset >= 0) || !(place.offset <= bspline_span(&time->curve, place.span))) {
      return status_set(EXM_ERROR_IO, "%s is damaged: frame %zu is not on the curve", s->path, i);
    }
    time->places[i] = place;
  }
  return EXM_OK;
}

static exm_status get_time(source *s, int is_cyclic, time_signal *time)
{
  bspline *curve = &time->curve;
  double *points = NULL;
  curve->is_cyclic = is_cyclic;
  TRY(get_count(s, 4, SIZE_MAX, "the number of control points", &curve->control_count));
  TRY(get_count(s, 1, SIZE_MAX, "the number of frames", &time->frame_count));
  TRY(get_doubles(s, &time->memory, curve->control_count, 2, -INFINITY, "the control points", &points));
  curve->points = (double(*)[2])(void *)points;
  TRY(get_doubles(s, &time->memory, bspline_interval_count(curve->control_count, is_cyclic), 1, 0, "the knots",
                  &curve->intervals));
  TRY(get_places(s, time));
  return get_doubles(s, &time->memory, time->frame_count, 1, 0, "the steps between frames", &time->steps);
}

/** Does a window begin within the one before it, and end behind it? */
static int follows(const window *w, const window *before)
{
  size_t const end = before->first_frame + before->time.frame_count;
  return w->first_frame > before->first_frame && w->first_frame < end && w->first_frame + w->fitted_count > end;
}

static exm_status get_signals(source *s, size_t dimension, signals *fitted)
{
  uint32_t cyclic = 0;
  size_t count = 0;
  TRY(get_small(s, 0, 1, "the mark of a cyclic sequence", &cyclic));
  fitted->is_cyclic = (int)cyclic;
  TRY(get_double(s, 0, "the diagonal", &fitted->diagonal));
  TRY(get_double(s, 0, "the unit of the pose plane", &fitted->unit));
  TRY(get_shape(s, dimension, &fitted->memory, &fitted->shape));
  TRY(get_count(s, 1, fitted->shape.row_count, "the number of windows", &count));
  fitted->windows = ARENA_NEW(&fitted->memory, window, count);
  if (!fitted->windows) {
    return status_no_memory("the sequence");
  }
  if (count > 1 && fitted->is_cyclic) {
    return damaged(s, "a cyclic sequence has windows");
  }
  for (; fitted->window_count < count; fitted->window_count++) {
    window *w = &fitted->windows[fitted->window_count];
    exm_status status = get_pose(s, &fitted->shape, w);
    if (status >= 0 && fitted->window_count == 0 && w->first_frame != 0) {
      status = damaged(s, "its first window does not begin with the first frame");
    }
    if (status >= 0 && fitted->window_count > 0 && !follows(w, w - 1)) {
      status = damaged(s, "its windows do not overlap");
    }
    if (status >= 0) {
      status = get_time(s, fitted->is_cyclic, &w->time);
    }
    if (status < 0) {
      window_release(w);
      return status;
    }
  }
  return left(s) == 0 ? EXM_OK : damaged(s, "it goes on after its end");
}

static exm_status get_sequence(source *s, exm_sequence **out)
{
  arena scratch = {0};
  mesh *reference = NULL;
  signals *fitted = NULL;
  exm_sequence *sequence = NULL;
  uint32_t kind = 0;
  TRY(get_small(s, 0, INT32_MAX, "the shape space", &kind));
  exm_status status = get_mesh(s, &scratch, &reference);
  arena_release(&scratch);
  if (status < 0 || (status = sequence_create(reference, (int32_t)kind, &sequence)) < 0) {
    goto done;
  }
  fitted = calloc(1, sizeof *fitted);
  status = fitted ? get_signals(s, sequence->space.dimension, fitted) : status_no_memory("the sequence");
  if (status >= 0 && (status = sequence_adopt(sequence, fitted)) >= 0) {
    fitted = NULL;
    *out = sequence;
    sequence = NULL;
  }
done:
  signals_release(fitted);
  sequence_destroy(sequence);
  mesh_destroy(reference);
  if (status == EXM_ERROR_ARGUMENT) {
    return damaged(s, "its shape space is not a known one");
  }
  return status < 0 ? status : EXM_OK;
}

/* ------------------------------------------------------------------------------------------------------------ door */

static exm_status read_file(const char *path, unsigned char **bytes, size_t *size)
{
  FILE *file = fopen(path, "rb");
  if (!file) {
    return status_set(file_failure(errno), "%s cannot be opened: %s", path, strerror(errno));
  }
  exm_status status = EXM_OK;
  long length = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
  length = fseek(file, 0, SEEK_SET) == 0 ? length : -1;
  *size = length > 0 ? (size_t)length : 0;
  *bytes = malloc(*size + 1);
  if (!*bytes) {
    status = status_no_memory("a file");
  } else if (length < 0 || fread(*bytes, 1, *size, file) != *size) {
    status = status_set(EXM_ERROR_IO, "%s cannot be read: %s", path, strerror(errno));
  }
  fclose(file);
  return status;
}

/** Magic, version and check sum; the source is left at what is between them. */
static exm_status check_frame(source *s)
{
  if (left(s) < FILE_MAGIC_SIZE + 8 || memcmp(s->at, FILE_MAGIC, FILE_MAGIC_SIZE) != 0) {
    return status_set(EXM_ERROR_IO, "%s is not a sequence of Exemplar", s->path);
  }
  source head = *s, tail = *s;
  head.at += FILE_MAGIC_SIZE;
  uint32_t const version = (uint32_t)take(&head, 4);
  if (version != EXM_SEQUENCE_FILE_VERSION) {
    return status_set(EXM_ERROR_IO, "%s has version %u of the format; this library reads version %d", s->path, version,
                      EXM_SEQUENCE_FILE_VERSION);
  }
  tail.at = s->end - 4;
  if ((uint32_t)take(&tail, 4) != crc_add(0, s->at, left(s) - 4)) {
    return damaged(s, "its check sum does not fit; it was cut short or changed");
  }
  s->at = head.at;
  s->end -= 4;
  return EXM_OK;
}

exm_status sequence_load(const char *path, exm_sequence_file_report *report, exm_sequence **out)
{
  unsigned char *bytes = NULL;
  size_t size = 0;
  exm_status status = read_file(path, &bytes, &size);
  if (status >= 0) {
    source s = {path, bytes, bytes + size};
    status = check_frame(&s);
    if (status >= 0) {
      status = get_sequence(&s, out);
    }
  }
  free(bytes);
  if (status >= 0) {
    report->file_size = size;
    report->frames_size = file_frames_size(*out);
    report->ratio = (double)report->frames_size / (double)size;
  }
  return status;
}
