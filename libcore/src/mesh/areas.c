/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/areas.h"

#include <string.h>

#include "mesh/cotangents.h"

static double square_distance(const double a[3], const double b[3])
{
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

static void triangle_shares(const double *const corners[3], double shares[3])
{
  triangle_measure const measure = triangle_measure_of(corners[0], corners[1], corners[2]);
  for (int c = 0; c < 3; c++) {
    if (measure.cotangents[c] < 0) {
      shares[c] = measure.area / 2;
      shares[(c + 1) % 3] = shares[(c + 2) % 3] = measure.area / 4;
      return;
    }
  }
  /* An edge's two right triangles to the circumcentre have its squared length times the cotangent opposite to it, over
   * eight, each; cotangents are halved here. */
  memset(shares, 0, 3 * sizeof *shares);
  for (int c = 0; c < 3; c++) {
    int const i = (c + 1) % 3, j = (c + 2) % 3;
    double const share = measure.cotangents[c] * square_distance(corners[i], corners[j]) / 4;
    shares[i] += share;
    shares[j] += share;
  }
}

void mesh_voronoi_areas(const mesh *m, double *areas)
{
  double shares[3];
  memset(areas, 0, m->vertex_count * sizeof *areas);
  for (size_t f = 0; f < m->triangle_count; f++) {
    const uint32_t *t = m->triangles[f];
    const double *const corners[3] = {m->positions[t[0]], m->positions[t[1]], m->positions[t[2]]};
    triangle_shares(corners, shares);
    for (int c = 0; c < 3; c++) {
      areas[t[c]] += shares[c];
    }
  }
}
