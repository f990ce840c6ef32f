/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/scan_surface.h"

#include <math.h>

#include "mesh/normals.h"

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

/** The ends of edges that are of one triangle alone, and points of none: whatever lies there, the surface goes on
 *  beyond. `seen` [P]: scratch, zeros. */
static void find_boundary(scan *s, uint32_t *seen)
{
  const geodesics *g = s->ways;
  for (size_t v = 0; v < s->point_count; v++) {
    uint32_t const first = g->offsets[v], last = g->offsets[v + 1];
    for (int is_counting = 1; is_counting >= 0; is_counting--) {
      for (uint32_t i = first; i < last; i++) {
        const uint32_t *t = s->triangles[g->faces[i]];
        for (int c = 0; c < 3; c++) {
          if (t[c] != v && is_counting) {
            seen[t[c]]++;
          } else if (t[c] != v) {
            s->boundary[v] |= seen[t[c]] == 1;
          }
        }
      }
    }
    for (uint32_t i = first; i < last; i++) {
      for (int c = 0; c < 3; c++) {
        seen[s->triangles[g->faces[i]][c]] = 0;
      }
    }
  }
}

exm_status scan_surface(scan *s)
{
  const double(*points)[3] = (const double(*)[3])s->points;
  const uint32_t(*triangles)[3] = (const uint32_t(*)[3])s->triangles;
  arena scratch = {0};
  uint32_t *seen = ARENA_NEW(&scratch, uint32_t, s->point_count);
  exm_status status = seen ? EXM_OK : status_no_memory("the scan");
  if (status == EXM_OK) {
    status = geodesics_create(&s->memory, points, s->point_count, triangles, s->triangle_count, s->ways);
  }
  if (status == EXM_OK) {
    find_boundary(s, seen);
    find_areas(s);
    mesh_vertex_normals(points, s->point_count, triangles, s->triangle_count, s->normals);
  }
  arena_release(&scratch);
  return status;
}
