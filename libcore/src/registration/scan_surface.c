/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/scan_surface.h"

#include <math.h>

#include "mesh/normals.h"
#include "mesh/rim.h"

/** A third of the area of the triangles around. */
static void find_areas(scan *s)
{
  for (size_t f = 0; f < s->triangle_count; f++) {
    double normal[3];
    const uint32_t *t = s->triangles[f];
    triangle_normal(s->points[t[0]], s->points[t[1]], s->points[t[2]], normal);
    double const area = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]) / 2;
    for (int c = 0; c < 3; c++) {
      s->areas[t[c]] += area / 3;
    }
  }
}

exm_status scan_surface(scan *s)
{
  const double(*points)[3] = (const double(*)[3])s->points;
  const uint32_t(*triangles)[3] = (const uint32_t(*)[3])s->triangles;
  TRY(geodesics_create(&s->memory, points, s->point_count, triangles, s->triangle_count, s->ways));
  TRY(mesh_rim(s->ways, s->boundary));
  find_areas(s);
  mesh_vertex_normals(points, s->point_count, triangles, s->triangle_count, s->normals);
  return EXM_OK;
}
