/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/scan.h"

#include <math.h>
#include <string.h>

#include "mesh/mesh_file.h"
#include "mesh/openmesh_shim.h"
#include "registration/scan_cloud.h"
#include "registration/scan_surface.h"

/* ----------------------------------------------------------------------------------------------------------- checks */

static exm_status check_points(const float *points, size_t count)
{
  if (count < SCAN_POINTS_LEAST) {
    return status_set(EXM_ERROR_ARGUMENT, "the scan has %zu points: at least %d are needed", count, SCAN_POINTS_LEAST);
  }
  if (count > INT32_MAX) {
    return status_no_memory("the scan");
  }
  for (size_t i = 0; i < 3 * count; i++) {
    if (!isfinite(points[i])) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_POINT, i / 3, "points: the %c coordinate of point %zu is %g",
                           "xyz"[i % 3], i / 3, (double)points[i]);
    }
  }
  return EXM_OK;
}

static exm_status check_settings(const exm_scan_settings *s, size_t point_count)
{
  if (s->neighbor_count < 4 || s->neighbor_count > SCAN_NEIGHBORS_MOST) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.neighbor_count is %zu, not 4 to %d", s->neighbor_count,
                      SCAN_NEIGHBORS_MOST);
  }
  if (s->triangle_count > 0 && !s->triangles) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.triangles is NULL, but settings.triangle_count is %zu",
                      s->triangle_count);
  }
  if (s->triangle_count > INT32_MAX / 6) {
    return status_no_memory("the scan");
  }
  for (size_t i = 0; i < 3 * s->triangle_count; i++) {
    if (s->triangles[i] >= point_count) {
      return status_set_at(EXM_ERROR_TOPOLOGY, EXM_ELEMENT_FACE, i / 3,
                           "settings.triangles: corner %zu of triangle %zu is point %u, but there are %zu", i % 3,
                           i / 3, s->triangles[i], point_count);
    }
  }
  for (size_t i = 0; s->normals && i < 3 * point_count; i++) {
    if (!isfinite(s->normals[i])) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_POINT, i / 3,
                           "settings.normals: that of point %zu is not finite", i / 3);
    }
  }
  return EXM_OK;
}

/* ----------------------------------------------------------------------------------------------------------- arrays */

static exm_status copy_points(scan *s, const float *points)
{
  double low[3], high[3], squared = 0;
  s->points = arena_array(&s->memory, s->point_count, sizeof *s->points);
  s->normals = arena_array(&s->memory, s->point_count, sizeof *s->normals);
  s->boundary = ARENA_NEW(&s->memory, uint8_t, s->point_count);
  s->areas = ARENA_NEW(&s->memory, double, s->point_count);
  s->ways = ARENA_NEW(&s->memory, geodesics, 1);
  if (!s->points || !s->normals || !s->boundary || !s->areas || !s->ways) {
    return status_no_memory("the scan");
  }
  for (size_t k = 0; k < 3; k++) {
    low[k] = high[k] = (double)points[k];
  }
  for (size_t i = 0; i < 3 * s->point_count; i++) {
    double const x = (double)points[i];
    s->points[i / 3][i % 3] = x;
    low[i % 3] = fmin(low[i % 3], x);
    high[i % 3] = fmax(high[i % 3], x);
  }
  for (size_t k = 0; k < 3; k++) {
    squared += (high[k] - low[k]) * (high[k] - low[k]);
  }
  s->report.diagonal = sqrt(squared);
  if (!(squared > 0)) {
    return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_POINT, 0, "all %zu points of the scan are the same",
                         s->point_count);
  }
  return EXM_OK;
}

static exm_status copy_triangles(scan *s, const exm_scan_settings *settings)
{
  s->triangles = arena_array(&s->memory, settings->triangle_count, sizeof *s->triangles);
  if (!s->triangles) {
    return status_no_memory("the scan");
  }
  for (size_t f = 0; f < settings->triangle_count; f++) {
    const uint32_t *t = settings->triangles + 3 * f;
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
      memcpy(s->triangles[s->triangle_count++], t, 3 * sizeof *t);
    }
  }
  return EXM_OK;
}

static void take_normals(scan *s, const float *normals)
{
  for (size_t i = 0; i < s->point_count; i++) {
    double n[3] = {(double)normals[3 * i], (double)normals[3 * i + 1], (double)normals[3 * i + 2]};
    double const length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (size_t k = 0; k < 3; k++) {
      s->normals[i][k] = length > 0 ? n[k] / length : 0;
    }
  }
}

/** Root mean square distance to the nearest other point. */
static exm_status find_spacing(scan *s)
{
  arena scratch = {0};
  uint32_t *indices = ARENA_NEW(&scratch, uint32_t, 2 * s->point_count);
  double *squared = ARENA_NEW(&scratch, double, 2 * s->point_count);
  double sum = 0;
  if (indices && squared) {
    nearest_find_several(&s->tree, (const double(*)[3])s->points, s->point_count, 2, 0, indices, squared);
    for (size_t i = 0; i < s->point_count; i++) {
      sum += squared[2 * i + 1];
    }
  }
  arena_release(&scratch);
  s->report.spacing = sqrt(sum / (double)s->point_count);
  return indices && squared ? EXM_OK : status_no_memory("the scan");
}

static exm_status fill(scan *s, const float *points, const exm_scan_settings *settings)
{
  TRY(copy_points(s, points));
  TRY(copy_triangles(s, settings));
  TRY(nearest_create(&s->memory, (const double(*)[3])s->points, s->point_count, &s->tree));
  TRY(find_spacing(s));
  if (s->triangle_count > 0) {
    TRY(scan_surface(s));
  } else {
    TRY(scan_cloud(s, settings->neighbor_count));
  }
  if (settings->normals) {
    take_normals(s, settings->normals);
  }
  for (size_t i = 0; i < s->point_count; i++) {
    s->report.boundary_point_count += s->boundary[i];
  }
  s->report.point_count = s->point_count;
  s->report.triangle_count = s->triangle_count;
  s->report.signed_normals = s->triangle_count > 0 || settings->normals;
  return EXM_OK;
}

exm_status scan_create(const float *points, size_t point_count, const exm_scan_settings *settings, scan **out)
{
  TRY(check_points(points, point_count));
  TRY(check_settings(settings, point_count));
  arena memory = {0};
  scan *const s = ARENA_NEW(&memory, scan, 1);
  if (!s) {
    return status_no_memory("the scan");
  }
  *s = (scan){.point_count = point_count, .memory = memory, .report = {.struct_size = sizeof s->report}};
  exm_status const status = fill(s, points, settings);
  if (status < 0) {
    scan_destroy(s);
    return status;
  }
  *out = s;
  return EXM_OK;
}

static exm_status read_and_create(const char *path, arena *scratch, scan **out)
{
  mesh_file file = {0};
  shim_surface surface = {0};
  TRY(mesh_file_load(path, scratch, &file));
  TRY(openmesh_parse(&file, scratch, &surface));
  exm_scan_settings const settings = {.struct_size = sizeof settings,
                                      .triangles = (const uint32_t *)surface.triangles,
                                      .triangle_count = surface.triangle_count,
                                      .neighbor_count = SCAN_NEIGHBORS};
  return scan_create((const float *)surface.positions, surface.vertex_count, &settings, out);
}

exm_status scan_read(const char *path, scan **out)
{
  arena scratch = {0};
  exm_status const status = read_and_create(path, &scratch, out);
  arena_release(&scratch);
  return status;
}

void scan_destroy(scan *s)
{
  if (s) {
    arena memory = s->memory; /* it holds the struct that it is in */
    arena_release(&memory);
  }
}
