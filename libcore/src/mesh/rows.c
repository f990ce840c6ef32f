/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/rows.h"

#include "mesh/areas.h"
#include "mesh/geodesics.h"

exm_status mesh_disc_row(const mesh *m, uint32_t vertex, double radius, size_t capacity, uint32_t *vertices,
                         double *coefficients, size_t *count)
{
  arena scratch = {0};
  geodesics ways;
  double *areas = ARENA_NEW(&scratch, double, m->vertex_count);
  exm_status status = areas ? EXM_OK : status_no_memory("a geodesic disc");
  if (status == EXM_OK) {
    status = geodesics_create(&scratch, (const double(*)[3])m->positions, m->vertex_count,
                              (const uint32_t(*)[3])m->triangles, m->triangle_count, &ways);
  }
  if (status == EXM_OK) {
    double total = 0;
    mesh_voronoi_areas(m, areas);
    geodesics_disc(&ways, vertex, radius);
    for (size_t i = 0; i < ways.count; i++) {
      total += areas[ways.vertices[i]];
    }
    for (size_t i = 0; i < ways.count && i < capacity; i++) {
      vertices[i] = ways.vertices[i];
      coefficients[i] = total > 0 ? areas[ways.vertices[i]] / total : 1.0 / (double)ways.count;
    }
    *count = ways.count;
  }
  arena_release(&scratch);
  return status;
}

exm_status mesh_differential_row(const mesh *m, uint32_t vertex, size_t capacity, uint32_t *vertices,
                                 double *coefficients, size_t *count)
{
  size_t const first = m->neighbor_offsets[vertex], rings = m->neighbor_offsets[vertex + 1] - first;
  double total = 0;
  if (1 + rings > capacity) {
    *count = 1 + rings;
    return EXM_OK;
  }
  for (size_t v = 0; v < m->vertex_count; v++) {
    total += m->masses[v];
  }
  vertices[0] = vertex;
  coefficients[0] = 0;
  for (size_t i = 0; i < rings; i++) {
    vertices[1 + i] = m->neighbors[first + i];
    coefficients[1 + i] = 0;
  }
  /* Degenerate triangles aside, (L v)_i = sum_j w_ij (v_i - v_j). */
  double const factor = total / m->masses[vertex];
  for (size_t t = 0; t < m->triangle_count; t++) {
    for (int i = 0; i < 3; i++) {
      uint32_t const a = m->triangles[t][(i + 1) % 3], b = m->triangles[t][(i + 2) % 3];
      if (a == vertex || b == vertex) {
        size_t place = 1;
        while (vertices[place] != (a == vertex ? b : a)) {
          place++;
        }
        coefficients[0] += factor * m->cotangents[t][i];
        coefficients[place] -= factor * m->cotangents[t][i];
      }
    }
  }
  *count = 1 + rings;
  return EXM_OK;
}
