/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/scan.h"

#include <math.h>
#include <string.h>

#include "api/structs.h"

void exm_scan_settings_init(exm_scan_settings *settings)
{
  if (settings) {
    *settings = (exm_scan_settings){.struct_size = sizeof *settings, .neighbor_count = SCAN_NEIGHBORS};
  }
}

void exm_scan_report_init(exm_scan_report *report)
{
  if (report) {
    *report = (exm_scan_report){.struct_size = sizeof *report};
  }
}

exm_status exm_scan_create(const float *points, size_t point_count, const exm_scan_settings *settings, exm_scan **out)
{
  exm_scan_settings own;
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(points, "points"));
  exm_scan_settings_init(&own);
  TRY(settings_read(&own, sizeof own, settings, "settings"));
  return scan_create(points, point_count, &own, out);
}

exm_status exm_scan_read(const char *path, exm_scan **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(path, "path"));
  return scan_read(path, out);
}

void exm_scan_destroy(exm_scan *s)
{
  scan_destroy(s);
}

exm_status exm_scan_get_report(const exm_scan *s, exm_scan_report *report)
{
  TRY(check_pointer(s, "scan"));
  TRY(check_pointer(report, "report"));
  return report_write(report, &s->report, sizeof s->report, "report");
}

exm_status exm_scan_get_arrays(const exm_scan *s, float *points, uint32_t *triangles, float *normals, uint8_t *boundary)
{
  TRY(check_pointer(s, "scan"));
  for (size_t i = 0; i < 3 * s->point_count; i++) {
    if (points) {
      points[i] = (float)s->points[i / 3][i % 3];
    }
    if (normals) {
      normals[i] = (float)s->normals[i / 3][i % 3];
    }
  }
  if (triangles) {
    memcpy(triangles, s->triangles, s->triangle_count * sizeof *s->triangles);
  }
  if (boundary) {
    memcpy(boundary, s->boundary, s->point_count);
  }
  return EXM_OK;
}

exm_status exm_scan_nearest(const exm_scan *s, const double *queries, size_t count, uint32_t *indices,
                            double *distances)
{
  TRY(check_pointer(s, "scan"));
  TRY(check_pointer(queries, "queries"));
  if (count > SIZE_MAX / (3 * sizeof(double))) {
    return status_no_memory("the queries");
  }
  for (size_t i = 0; i < 3 * count; i++) {
    if (!isfinite(queries[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "queries: coordinate %zu of query %zu is not finite", i % 3, i / 3);
    }
  }
  arena scratch = {0};
  uint32_t *found = ARENA_NEW(&scratch, uint32_t, count);
  double *squared = ARENA_NEW(&scratch, double, count);
  exm_status const status = found && squared ? EXM_OK : status_no_memory("the queries");
  if (status == EXM_OK) {
    nearest_find(&s->tree, (const double(*)[3])queries, count, NULL, NULL, INFINITY, 0, found, squared);
    for (size_t i = 0; i < count && distances; i++) {
      distances[i] = sqrt(squared[i]);
    }
    if (indices) {
      memcpy(indices, found, count * sizeof *found);
    }
  }
  arena_release(&scratch);
  return status;
}
