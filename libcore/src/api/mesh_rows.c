/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>

#include "api/structs.h"
#include "mesh/rows.h"

static exm_status check(const exm_mesh *m, uint32_t vertex, size_t capacity, const uint32_t *vertices,
                        const double *coefficients, const size_t *count)
{
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(count, "count"));
  if (capacity > 0) {
    TRY(check_pointer(vertices, "vertices"));
    TRY(check_pointer(coefficients, "coefficients"));
  }
  if (vertex >= m->vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "vertex is %u, but there are %zu vertices", vertex, m->vertex_count);
  }
  return EXM_OK;
}

exm_status exm_mesh_disc(const exm_mesh *m, uint32_t vertex, double radius, size_t capacity, uint32_t *vertices,
                         double *coefficients, size_t *count)
{
  TRY(check(m, vertex, capacity, vertices, coefficients, count));
  if (!(radius >= 0) || !isfinite(radius)) {
    return status_set(EXM_ERROR_ARGUMENT, "radius is %g, not 0 or more", radius);
  }
  return mesh_disc_row(m, vertex, radius, capacity, vertices, coefficients, count);
}

exm_status exm_mesh_differential(const exm_mesh *m, uint32_t vertex, size_t capacity, uint32_t *vertices,
                                 double *coefficients, size_t *count)
{
  TRY(check(m, vertex, capacity, vertices, coefficients, count));
  return mesh_differential_row(m, vertex, capacity, vertices, coefficients, count);
}
