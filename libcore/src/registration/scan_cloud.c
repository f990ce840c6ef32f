/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/scan_cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "linalg/dense.h"

/* Neighbours leave a gap this wide in the tangent plane only at a rim: on a straight one it is half a turn. */
static double const GAP = 2.2;

/** Axes of the neighbours' scatter about the point's own neighbourhood centre: rows, the normal first. */
static exm_status find_axes(const scan *s, const uint32_t *neighbors, size_t each, double axes[9])
{
  double centre[3] = {0}, values[3];
  size_t found = 0;
  memset(axes, 0, 9 * sizeof(double));
  for (size_t i = 0; i < each && neighbors[i] != NEAREST_NONE; i++, found++) {
    dense_axpy(3, 1, s->points[neighbors[i]], centre);
  }
  for (size_t i = 0; i < found; i++) {
    double offset[3];
    for (size_t k = 0; k < 3; k++) {
      offset[k] = s->points[neighbors[i]][k] - centre[k] / (double)found;
    }
    for (size_t k = 0; k < 3; k++) {
      dense_axpy(3, offset[k], offset, axes + 3 * k);
    }
  }
  return dense_eigen(3, axes, values);
}

static int compare(const void *a, const void *b)
{
  double const x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/** The widest angle about the point, in its tangent plane, without a neighbour. angles [each]: scratch. */
static double widest_gap(const scan *s, size_t point, const uint32_t *neighbors, size_t each, const double axes[9],
                         double *angles)
{
  size_t count = 0;
  double widest = 0;
  for (size_t i = 0; i < each && neighbors[i] != NEAREST_NONE; i++) {
    double offset[3];
    for (size_t k = 0; k < 3; k++) {
      offset[k] = s->points[neighbors[i]][k] - s->points[point][k];
    }
    double const x = dense_dot(3, axes + 3, offset), y = dense_dot(3, axes + 6, offset);
    if (x != 0 || y != 0) {
      angles[count++] = atan2(y, x);
    }
  }
  qsort(angles, count, sizeof *angles, compare);
  for (size_t i = 0; i + 1 < count; i++) {
    widest = fmax(widest, angles[i + 1] - angles[i]);
  }
  return count > 0 ? fmax(widest, angles[0] + 2 * M_PI - angles[count - 1]) : 2 * M_PI;
}

exm_status scan_cloud(scan *s, size_t neighbor_count)
{
  size_t const P = s->point_count, each = neighbor_count + 1 < P ? neighbor_count + 1 : P;
  arena scratch = {0};
  uint32_t *neighbors = ARENA_NEW(&scratch, uint32_t, P * each);
  double *squared = ARENA_NEW(&scratch, double, P *each);
  double *angles = ARENA_NEW(&scratch, double, each);
  exm_status status = neighbors && squared && angles ? EXM_OK : status_no_memory("the scan");
  if (status == EXM_OK) {
    nearest_find_several(&s->tree, (const double(*)[3])s->points, P, each, 0, neighbors, squared);
  }
  for (size_t i = 0; i < P && status == EXM_OK; i++) {
    const uint32_t *around = neighbors + i * each;
    double axes[9];
    status = find_axes(s, around, each, axes);
    memcpy(s->normals[i], axes, sizeof s->normals[i]);
    s->boundary[i] = widest_gap(s, i, around, each, axes, angles) > GAP;
    /* So many points share a disc that reaches the last of them. */
    s->areas[i] = M_PI * squared[i * each + each - 1] / (double)each;
  }
  if (status == EXM_OK) {
    status = geodesics_create_cloud(&s->memory, (const double(*)[3])s->points, P, neighbors, each, s->ways);
  }
  arena_release(&scratch);
  return status;
}
