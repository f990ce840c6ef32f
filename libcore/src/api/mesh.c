/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/mesh.h"

#include <string.h>

#include "api/structs.h"

void exm_mesh_report_init(exm_mesh_report *report)
{
  if (report) {
    *report = (exm_mesh_report){.struct_size = sizeof *report};
  }
}

exm_status exm_mesh_create(const float *positions, size_t vertex_count, const uint32_t *triangles,
                           size_t triangle_count, exm_mesh **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(positions, "positions"));
  TRY(check_pointer(triangles, "triangles"));
  return mesh_create((const float(*)[3])positions, vertex_count, (const uint32_t(*)[3])triangles, triangle_count, out);
}

exm_status exm_mesh_read(const char *path, exm_mesh **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(path, "path"));
  return mesh_read(path, out);
}

void exm_mesh_destroy(exm_mesh *m)
{
  mesh_destroy(m);
}

exm_status exm_mesh_get_report(const exm_mesh *m, exm_mesh_report *report)
{
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(report, "report"));
  return report_write(report, &m->report, sizeof m->report, "report");
}

exm_status exm_mesh_get_arrays(const exm_mesh *m, float *positions, uint32_t *triangles)
{
  TRY(check_pointer(m, "mesh"));
  for (size_t i = 0; positions && i < 3 * m->vertex_count; ++i) {
    positions[i] = (float)m->positions[i / 3][i % 3];
  }
  if (triangles) {
    memcpy(triangles, m->triangles, m->triangle_count * sizeof *m->triangles);
  }
  return EXM_OK;
}

exm_status exm_mesh_flaws(const exm_mesh *m, exm_mesh_flaw flaw, uint32_t *elements, size_t capacity, size_t *count)
{
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(count, "count"));
  if (capacity > 0) {
    TRY(check_pointer(elements, "elements"));
  }
  const uint32_t *found;
  size_t found_count;
  switch (flaw) {
  case EXM_FLAW_NON_MANIFOLD_EDGE:
    found = m->non_manifold_edges;
    found_count = 2 * m->report.non_manifold_edge_count;
    break;
  case EXM_FLAW_DEGENERATE_FACE:
    found = m->degenerate_faces;
    found_count = m->report.degenerate_face_count;
    break;
  case EXM_FLAW_LOOSE_VERTEX:
    found = m->loose_vertices;
    found_count = m->report.loose_vertex_count;
    break;
  default:
    return status_set(EXM_ERROR_ARGUMENT, "flaw is %d, not one of exm_mesh_flaw", (int)flaw);
  }
  size_t const written = found_count < capacity ? found_count : capacity;
  if (written > 0) {
    memcpy(elements, found, written * sizeof *found);
  }
  *count = found_count;
  return EXM_OK;
}

exm_status exm_mesh_cotangents(const exm_mesh *m, double *cotangents)
{
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(cotangents, "cotangents"));
  memcpy(cotangents, m->cotangents, m->triangle_count * sizeof *m->cotangents);
  return EXM_OK;
}
