/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/normals.h"

#include <math.h>
#include <string.h>

void triangle_normal(const double a[3], const double b[3], const double c[3], double out[3])
{
  double const u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  out[0] = u[1] * v[2] - u[2] * v[1];
  out[1] = u[2] * v[0] - u[0] * v[2];
  out[2] = u[0] * v[1] - u[1] * v[0];
}

void mesh_vertex_normals(const double (*positions)[3], size_t vertex_count, const uint32_t (*triangles)[3],
                         size_t triangle_count, double (*normals)[3])
{
  memset(normals, 0, vertex_count * sizeof *normals);
  for (size_t f = 0; f < triangle_count; f++) {
    const uint32_t *t = triangles[f];
    double normal[3];
    triangle_normal(positions[t[0]], positions[t[1]], positions[t[2]], normal);
    for (int i = 0; i < 9; i++) {
      normals[t[i / 3]][i % 3] += normal[i % 3];
    }
  }
  for (size_t v = 0; v < vertex_count; v++) {
    double *n = normals[v];
    double const length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++) {
      n[k] = length > 0 ? n[k] / length : 0;
    }
  }
}
