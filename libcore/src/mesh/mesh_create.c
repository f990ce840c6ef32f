/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "mesh/cotangents.h"
#include "mesh/mesh.h"
#include "mesh/mesh_file.h"
#include "mesh/openmesh_shim.h"
#include "mesh/topology.h"

/* The share of the mean below which a vertex's mass does not go. Energies divide by masses: without a floor a loose
 * vertex would divide by zero, and one among slivers would dominate. Adaptive meshes stay above it: triangles that
 * differ in size by a factor of a thousand differ in area by a million. */
static double const SMALLEST_MASS = 1e-6;

/* ------------------------------------------------------------------------------------------------------- validation */

/* OpenMesh and half of the world number in int; a triangle has six half-edges while they are being linked. */
enum { MOST_VERTICES = INT32_MAX, MOST_TRIANGLES = INT32_MAX / 6 };

static exm_status check_sizes(size_t vertex_count, size_t triangle_count)
{
  if (vertex_count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "the mesh has no vertices");
  }
  if (triangle_count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "the mesh has no triangles");
  }
  if (vertex_count > MOST_VERTICES || triangle_count > MOST_TRIANGLES) {
    return status_set(EXM_ERROR_OUT_OF_MEMORY, "a mesh of %zu vertices and %zu triangles does not fit in memory",
                      vertex_count, triangle_count);
  }
  return EXM_OK;
}

static exm_status check_positions(const float (*positions)[3], size_t vertex_count)
{
  for (size_t v = 0; v < vertex_count; ++v) {
    for (int k = 0; k < 3; ++k) {
      if (!isfinite(positions[v][k])) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, v, "vertex %zu: its %c coordinate is %g", v,
                             "xyz"[k], (double)positions[v][k]);
      }
    }
  }
  return EXM_OK;
}

static exm_status check_triangles(const uint32_t (*triangles)[3], size_t triangle_count, size_t vertex_count)
{
  for (size_t f = 0; f < triangle_count; ++f) {
    const uint32_t *const t = triangles[f];
    for (int i = 0; i < 3; ++i) {
      if (t[i] >= vertex_count) {
        return status_set_at(EXM_ERROR_TOPOLOGY, EXM_ELEMENT_FACE, f,
                             "triangle %zu: corner %d is vertex %u, but there are %zu vertices", f, i, t[i],
                             vertex_count);
      }
      if (t[i] == t[(i + 1) % 3]) {
        return status_set_at(EXM_ERROR_TOPOLOGY, EXM_ELEMENT_FACE, f, "triangle %zu: vertex %u is two of its corners",
                             f, t[i]);
      }
    }
  }
  return EXM_OK;
}

static double bounding_diagonal(const float (*positions)[3], size_t vertex_count)
{
  double squared = 0;
  for (int k = 0; k < 3; ++k) {
    double low = (double)positions[0][k], high = low;
    for (size_t v = 1; v < vertex_count; ++v) {
      low = fmin(low, (double)positions[v][k]);
      high = fmax(high, (double)positions[v][k]);
    }
    squared += (high - low) * (high - low);
  }
  return sqrt(squared);
}

/* --------------------------------------------------------------------------------------------------------- building */

static exm_status copy_arrays(mesh *m, const float (*positions)[3], const uint32_t (*triangles)[3])
{
  m->positions = arena_array(&m->memory, m->vertex_count, sizeof *m->positions);
  m->triangles = arena_array(&m->memory, m->triangle_count, sizeof *m->triangles);
  if (!m->positions || !m->triangles) {
    return status_no_memory("the mesh");
  }
  for (size_t v = 0; v < m->vertex_count; ++v) {
    for (int k = 0; k < 3; ++k) {
      m->positions[v][k] = (double)positions[v][k];
    }
  }
  memcpy(m->triangles, triangles, m->triangle_count * sizeof *triangles);
  return EXM_OK;
}

/* Cotangents, masses before their floor, and degenerate faces in one pass over the triangles. */
static void measure_triangles(mesh *m, double *total_area)
{
  for (size_t f = 0; f < m->triangle_count; ++f) {
    const uint32_t *const t = m->triangles[f];
    triangle_measure const measure = triangle_measure_of(m->positions[t[0]], m->positions[t[1]], m->positions[t[2]]);
    for (int i = 0; i < 3; ++i) {
      m->cotangents[f][i] = measure.cotangents[i];
      m->masses[t[i]] += measure.area / 3;
    }
    *total_area += measure.area;
    if (measure.degenerate) {
      m->degenerate_faces[m->report.degenerate_face_count++] = (uint32_t)f;
    }
  }
}

static exm_status find_geometry(mesh *m)
{
  m->cotangents = arena_array(&m->memory, m->triangle_count, sizeof *m->cotangents);
  m->masses = ARENA_NEW(&m->memory, double, m->vertex_count);
  m->degenerate_faces = ARENA_NEW(&m->memory, uint32_t, m->triangle_count);
  if (!m->cotangents || !m->masses || !m->degenerate_faces) {
    return status_no_memory("the geometry of a mesh");
  }
  double total_area = 0;
  measure_triangles(m, &total_area);
  if (total_area <= 0) {
    return status_set(EXM_ERROR_TOPOLOGY, "every triangle of the mesh is a single point");
  }
  double const floor = SMALLEST_MASS * total_area / (double)m->vertex_count;
  for (size_t v = 0; v < m->vertex_count; ++v) {
    m->masses[v] = fmax(m->masses[v], floor);
  }
  return EXM_OK;
}

static exm_status fill(mesh *m, const float (*positions)[3], const uint32_t (*triangles)[3])
{
  TRY(copy_arrays(m, positions, triangles));
  TRY(find_geometry(m));
  return topology_find(m);
}

/* The warning, and the first element that it is about. */
static exm_status judge(const mesh *m)
{
  const exm_mesh_report *const r = &m->report;
  if (r->non_manifold_edge_count + r->degenerate_face_count + r->loose_vertex_count == 0) {
    return EXM_OK;
  }
  exm_element kind = EXM_ELEMENT_VERTEX;
  size_t first = 0;
  if (r->non_manifold_edge_count) {
    first = m->non_manifold_edges[0];
  } else if (r->degenerate_face_count) {
    kind = EXM_ELEMENT_FACE;
    first = m->degenerate_faces[0];
  } else {
    first = m->loose_vertices[0];
  }
  return status_set_at(EXM_WARNING_MESH, kind, first,
                       "the mesh has %zu non-manifold edges, %zu degenerate faces and %zu loose vertices",
                       r->non_manifold_edge_count, r->degenerate_face_count, r->loose_vertex_count);
}

/* ------------------------------------------------------------------------------------------------------------- doors
 */

exm_status mesh_create(const float (*positions)[3], size_t vertex_count, const uint32_t (*triangles)[3],
                       size_t triangle_count, mesh **out)
{
  TRY(check_sizes(vertex_count, triangle_count));
  TRY(check_positions(positions, vertex_count));
  TRY(check_triangles(triangles, triangle_count, vertex_count));
  double const diagonal = bounding_diagonal(positions, vertex_count);
  if (diagonal <= 0) {
    return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, 0, "all %zu vertices are the same point",
                         vertex_count);
  }
  arena memory = {0};
  mesh *const m = ARENA_NEW(&memory, mesh, 1);
  if (!m) {
    return status_no_memory("the mesh");
  }
  *m = (mesh){.vertex_count = vertex_count, .triangle_count = triangle_count, .memory = memory};
  m->report = (exm_mesh_report){.struct_size = sizeof m->report,
                                .vertex_count = vertex_count,
                                .triangle_count = triangle_count,
                                .diagonal = diagonal};
  exm_status const status = fill(m, positions, triangles);
  if (status < 0) {
    mesh_destroy(m);
    return status;
  }
  *out = m;
  return judge(m);
}

static exm_status read_and_create(const char *path, arena *scratch, mesh **out)
{
  mesh_file file = {0};
  shim_surface surface = {0};
  TRY(mesh_file_load(path, scratch, &file));
  TRY(openmesh_parse(&file, scratch, &surface));
  if (surface.triangle_count == 0) {
    return status_set(EXM_ERROR_IO, "%s has no faces", path);
  }
  return mesh_create((const float(*)[3])surface.positions, surface.vertex_count,
                     (const uint32_t(*)[3])surface.triangles, surface.triangle_count, out);
}

exm_status mesh_read(const char *path, mesh **out)
{
  arena scratch = {0};
  exm_status const status = read_and_create(path, &scratch, out);
  arena_release(&scratch);
  return status;
}

void mesh_destroy(mesh *m)
{
  if (m) {
    arena memory = m->memory; /* it holds the struct that it is in */
    arena_release(&memory);
  }
}
