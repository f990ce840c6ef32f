/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenMesh keeps to manifolds: it takes in the triangles that fit together and refuses the rest. Its edges and those of
 * the refused triangles, merged, are the edges of the mesh as it is. */
#include "mesh/topology.h"

#include <stdbool.h>
#include <stddef.h>

#include "mesh/openmesh_shim.h"

typedef struct edge_list {
  size_t count;
  shim_edge *edges; /* sorted by low, then high; each once */
} edge_list;

/* -------------------------------------------------------------------------------------------------------------- edges
 */

static void append_triangle(edge_list *list, const uint32_t corners[3])
{
  for (int i = 0; i < 3; ++i) {
    uint32_t const from = corners[i], to = corners[(i + 1) % 3];
    shim_edge const edge = {from < to ? from : to, from < to ? to : from, from<to, from> to};
    list->edges[list->count++] = edge;
  }
}

static uint32_t edge_key(const shim_edge *edge, bool by_low)
{
  return by_low ? edge->low : edge->high;
}

/* One stable counting sort. next: [V + 1] scratch. */
static void sort_by(bool by_low, const shim_edge *edges, size_t count, size_t vertex_count, size_t *next,
                    shim_edge *sorted)
{
  for (size_t v = 0; v <= vertex_count; ++v) {
    next[v] = 0;
  }
  for (size_t i = 0; i < count; ++i) {
    ++next[edge_key(&edges[i], by_low) + 1];
  }
  for (size_t v = 0; v < vertex_count; ++v) {
    next[v + 1] += next[v];
  }
  for (size_t i = 0; i < count; ++i) {
    sorted[next[edge_key(&edges[i], by_low)]++] = edges[i];
  }
}

static void merge_equal(edge_list *list)
{
  size_t kept = 0;
  for (size_t i = 0; i < list->count; ++i) {
    const shim_edge *const edge = &list->edges[i];
    shim_edge *const last = kept ? &list->edges[kept - 1] : NULL;
    if (last && last->low == edge->low && last->high == edge->high) {
      last->forward += edge->forward;
      last->backward += edge->backward;
    } else {
      list->edges[kept++] = *edge;
    }
  }
  list->count = kept;
}

static exm_status find_edges(const mesh *m, arena *scratch, edge_list *out)
{
  shim_topology accepted = {0};
  TRY(openmesh_topology((const uint32_t(*)[3])m->triangles, m->triangle_count, m->vertex_count, scratch, &accepted));
  size_t const most = accepted.edge_count + 3 * accepted.rejected_count;
  edge_list list = {0, ARENA_NEW(scratch, shim_edge, most)};
  shim_edge *const other = ARENA_NEW(scratch, shim_edge, most);
  size_t *const next = ARENA_NEW(scratch, size_t, m->vertex_count + 1);
  if (!list.edges || !other || !next) {
    return status_no_memory("the edges of a mesh");
  }
  for (size_t i = 0; i < accepted.edge_count; ++i) {
    list.edges[list.count++] = accepted.edges[i];
  }
  for (size_t i = 0; i < accepted.rejected_count; ++i) {
    append_triangle(&list, m->triangles[accepted.rejected[i]]);
  }
  sort_by(false, list.edges, list.count, m->vertex_count, next, other);
  sort_by(true, other, list.count, m->vertex_count, next, list.edges);
  merge_equal(&list);
  *out = list;
  return EXM_OK;
}

static bool is_non_manifold(const shim_edge *edge)
{
  return edge->forward > 1 || edge->backward > 1;
}

static exm_status judge_edges(mesh *m, const edge_list *list)
{
  for (size_t i = 0; i < list->count; ++i) {
    const shim_edge *const edge = &list->edges[i];
    m->report.boundary_edge_count += edge->forward + edge->backward == 1;
    m->report.non_manifold_edge_count += is_non_manifold(edge);
  }
  m->non_manifold_edges = ARENA_NEW(&m->memory, uint32_t, 2 * m->report.non_manifold_edge_count);
  if (!m->non_manifold_edges) {
    return status_no_memory("the flaws of a mesh");
  }
  size_t written = 0;
  for (size_t i = 0; i < list->count; ++i) {
    if (is_non_manifold(&list->edges[i])) {
      m->non_manifold_edges[written++] = list->edges[i].low;
      m->non_manifold_edges[written++] = list->edges[i].high;
    }
  }
  return EXM_OK;
}

/* -------------------------------------------------------------------------------------------------------------- rings
 */

/* Edges come sorted, so a vertex first meets the lower ends of its edges in order, and then the higher ones: its ring
 * is sorted without a sort. */
static exm_status find_rings(mesh *m, const edge_list *list)
{
  m->neighbor_offsets = ARENA_NEW(&m->memory, uint32_t, m->vertex_count + 1);
  m->neighbors = ARENA_NEW(&m->memory, uint32_t, 2 * list->count);
  if (!m->neighbor_offsets || !m->neighbors) {
    return status_no_memory("the rings of a mesh");
  }
  uint32_t *const ends = m->neighbor_offsets + 1; /* of the rings filled so far; offsets when all are full */
  for (size_t i = 0; i < list->count; ++i) {
    for (int side = 0; side < 2; ++side) {
      uint32_t const v = edge_key(&list->edges[i], side == 0);
      if (v + 1 < m->vertex_count) {
        ++ends[v + 1];
      }
    }
  }
  for (size_t v = 1; v < m->vertex_count; ++v) {
    ends[v] += ends[v - 1];
  }
  for (size_t i = 0; i < list->count; ++i) {
    const shim_edge *const edge = &list->edges[i];
    m->neighbors[ends[edge->high]++] = edge->low;
    m->neighbors[ends[edge->low]++] = edge->high;
  }
  return EXM_OK;
}

static exm_status find_loose(mesh *m)
{
  const uint32_t *const offsets = m->neighbor_offsets;
  for (size_t v = 0; v < m->vertex_count; ++v) {
    m->report.loose_vertex_count += offsets[v] == offsets[v + 1];
  }
  m->loose_vertices = ARENA_NEW(&m->memory, uint32_t, m->report.loose_vertex_count);
  if (!m->loose_vertices) {
    return status_no_memory("the flaws of a mesh");
  }
  size_t written = 0;
  for (size_t v = 0; v < m->vertex_count; ++v) {
    if (offsets[v] == offsets[v + 1]) {
      m->loose_vertices[written++] = (uint32_t)v;
    }
  }
  return EXM_OK;
}

/* Flood each part from its lowest vertex. */
static exm_status find_components(mesh *m, arena *scratch)
{
  uint32_t const unseen = UINT32_MAX;
  uint32_t *const queue = ARENA_NEW(scratch, uint32_t, m->vertex_count);
  m->components = ARENA_NEW(&m->memory, uint32_t, m->vertex_count);
  if (!queue || !m->components) {
    return status_no_memory("the connected parts of a mesh");
  }
  for (size_t v = 0; v < m->vertex_count; ++v) {
    m->components[v] = unseen;
  }
  for (size_t seed = 0; seed < m->vertex_count; ++seed) {
    if (m->components[seed] != unseen) {
      continue;
    }
    uint32_t const component = (uint32_t)m->report.component_count++;
    size_t head = 0, tail = 0;
    m->components[seed] = component;
    queue[tail++] = (uint32_t)seed;
    while (head < tail) {
      uint32_t const v = queue[head++];
      for (uint32_t i = m->neighbor_offsets[v]; i < m->neighbor_offsets[v + 1]; ++i) {
        uint32_t const neighbor = m->neighbors[i];
        if (m->components[neighbor] == unseen) {
          m->components[neighbor] = component;
          queue[tail++] = neighbor;
        }
      }
    }
  }
  return EXM_OK;
}

static exm_status find_all(mesh *m, arena *scratch)
{
  edge_list list = {0};
  TRY(find_edges(m, scratch, &list));
  TRY(judge_edges(m, &list));
  TRY(find_rings(m, &list));
  TRY(find_loose(m));
  return find_components(m, scratch);
}

exm_status topology_find(mesh *m)
{
  arena scratch = {0};
  exm_status const status = find_all(m, &scratch);
  arena_release(&scratch);
  return status;
}
