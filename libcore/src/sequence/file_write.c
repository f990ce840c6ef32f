/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if !defined(_WIN32)
#  include <unistd.h>
#endif

#include "base/crc.h"
#include "sequence/file.h"

/* Names that are tried for the file that becomes the wanted one when it is whole. */
enum { MOST_NAMES = 100 };

typedef struct sink {
  FILE *file;
  uint32_t crc;
  uint64_t size;
  int failure; /* errno of the first write that failed */
} sink;

static void put_bytes(sink *s, const void *bytes, size_t size)
{
  s->crc = crc_add(s->crc, bytes, size);
  s->size += size;
  if (s->failure == 0 && fwrite(bytes, 1, size, s->file) != size) {
    s->failure = errno ? errno : EIO;
  }
}

static void put_number(sink *s, uint64_t value, size_t size)
{
  unsigned char bytes[8];
  for (size_t i = 0; i < size; i++) {
    bytes[i] = (unsigned char)(value >> (8 * i));
  }
  put_bytes(s, bytes, size);
}

static void put_count(sink *s, size_t value)
{
  put_number(s, value, 8);
}

static void put_indices(sink *s, const uint32_t *values, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    put_number(s, values[i], 4);
  }
}

static void put_singles(sink *s, const float *values, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    uint32_t bits;
    memcpy(&bits, values + i, sizeof bits);
    put_number(s, bits, 4);
  }
}

static void put_doubles(sink *s, const double *values, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    uint64_t bits;
    memcpy(&bits, values + i, sizeof bits);
    put_number(s, bits, 8);
  }
}

/* --------------------------------------------------------------------------------------------------------- sections */

static void put_mesh(sink *s, const mesh *m)
{
  put_count(s, m->vertex_count);
  put_count(s, m->triangle_count);
  for (size_t v = 0; v < m->vertex_count; v++) {
    float const point[3] = {(float)m->positions[v][0], (float)m->positions[v][1], (float)m->positions[v][2]};
    put_singles(s, point, 3);
  }
  put_indices(s, &m->triangles[0][0], 3 * m->triangle_count);
}

static void put_shape(sink *s, const pca *shape)
{
  put_count(s, shape->row_count);
  put_count(s, shape->dimension);
  put_count(s, shape->component_count);
  put_doubles(s, &shape->total, 1);
  put_doubles(s, &shape->rest, 1);
  put_singles(s, shape->mean, shape->dimension);
  put_singles(s, shape->basis, shape->component_count * shape->dimension);
  put_doubles(s, shape->coordinates, shape->row_count * shape->component_count);
}

static void put_pose(sink *s, const window *w)
{
  const thin_plate *plate = &w->plate;
  put_count(s, w->first_frame);
  put_count(s, w->fitted_count);
  put_count(s, w->timed_count);
  put_doubles(s, &w->positions[0][0], 2 * w->fitted_count);
  put_bytes(s, w->pinned, w->fitted_count);
  put_count(s, plate->site_count);
  put_indices(s, w->sites, plate->site_count);
  put_doubles(s, plate->centre, 2);
  put_doubles(s, &plate->scale, 1);
  put_doubles(s, &plate->sites[0][0], 2 * plate->site_count);
  put_doubles(s, plate->coefficients, (plate->site_count + 3) * plate->value_count);
}

static void put_time(sink *s, const time_signal *time)
{
  size_t const k = time->curve.control_count;
  put_count(s, k);
  put_count(s, time->frame_count);
  put_doubles(s, &time->curve.points[0][0], 2 * k);
  put_doubles(s, time->curve.intervals, bspline_interval_count(k, time->curve.is_cyclic));
  for (size_t i = 0; i < time->frame_count; i++) {
    put_number(s, time->places[i].span, 4);
    put_doubles(s, &time->places[i].offset, 1);
  }
  put_doubles(s, time->steps, time->frame_count);
}

static void put_sequence(sink *s, const exm_sequence *sequence)
{
  const signals *fitted = sequence->fitted;
  put_bytes(s, FILE_MAGIC, FILE_MAGIC_SIZE);
  put_number(s, EXM_SEQUENCE_FILE_VERSION, 4);
  put_number(s, (uint64_t)sequence->kind, 4);
  put_mesh(s, sequence->reference);
  put_number(s, (uint64_t)fitted->is_cyclic, 4);
  put_doubles(s, &fitted->diagonal, 1);
  put_doubles(s, &fitted->unit, 1);
  put_shape(s, &fitted->shape);
  put_count(s, fitted->window_count);
  for (size_t i = 0; i < fitted->window_count; i++) {
    put_pose(s, &fitted->windows[i]);
    put_time(s, &fitted->windows[i].time);
  }
  put_number(s, s->crc, 4);
}

/* ------------------------------------------------------------------------------------------------------------ door */

/** Create a file that is not there yet, named like the wanted one. name: room for the path and 16 bytes more. */
static FILE *open_beside(const char *path, char *name, size_t room)
{
  for (int i = 0; i < MOST_NAMES; i++) {
    snprintf(name, room, "%s.part%d", path, i);
    FILE *file = fopen(name, "wbx");
    if (file || errno != EEXIST) {
      return file;
    }
  }
  return NULL;
}

/** Nothing is in place before it is on the disk: a full one is noticed here at the latest. */
static void finish(sink *s)
{
  if (fflush(s->file) != 0 && s->failure == 0) {
    s->failure = errno;
  }
#if !defined(_WIN32)
  if (s->failure == 0 && fsync(fileno(s->file)) != 0 && errno != EINVAL && errno != ENOTSUP) {
    s->failure = errno;
  }
#endif
  if (fclose(s->file) != 0 && s->failure == 0) {
    s->failure = errno;
  }
}

static exm_status replace(const char *path, const char *name, sink *s)
{
#if defined(_WIN32)
  if (s->failure == 0) {
    remove(path);
  }
#endif
  if (s->failure == 0 && rename(name, path) != 0) {
    s->failure = errno;
  }
  if (s->failure != 0) {
    remove(name);
    return status_set(file_failure(s->failure), "%s cannot be written: %s", path, strerror(s->failure));
  }
  return EXM_OK;
}

exm_status sequence_save(const exm_sequence *sequence, const char *path, exm_sequence_file_report *report)
{
  size_t const room = strlen(path) + 16;
  char *name = malloc(room);
  if (!name) {
    return status_no_memory("the name of a file");
  }
  sink s = {.file = open_beside(path, name, room)};
  exm_status status = EXM_OK;
  if (!s.file) {
    status = status_set(file_failure(errno), "%s cannot be written: %s", path, strerror(errno));
  } else {
    put_sequence(&s, sequence);
    finish(&s);
    status = replace(path, name, &s);
  }
  free(name);
  if (status >= 0) {
    report->file_size = s.size;
    report->frames_size = file_frames_size(sequence);
    report->ratio = (double)report->frames_size / (double)report->file_size;
  }
  return status;
}
