/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/edges.h"

#include <string.h>

/** Edges of the triangles by their lower end, in lists: next [3 F], first [V]. */
static void link_by_lower_end(const mesh *m, uint32_t *first, uint32_t *next)
{
  memset(first, 0xff, m->vertex_count * sizeof *first);
  for (size_t h = 3 * m->triangle_count; h-- > 0;) {
    const uint32_t *t = m->triangles[h / 3];
    uint32_t const a = t[(h + 1) % 3], b = t[(h + 2) % 3];
    uint32_t const low = a < b ? a : b;
    next[h] = first[low];
    first[low] = (uint32_t)h;
  }
}

static uint32_t higher_end(const mesh *m, size_t h)
{
  const uint32_t *t = m->triangles[h / 3];
  uint32_t const a = t[(h + 1) % 3], b = t[(h + 2) % 3];
  return a < b ? b : a;
}

/** Collect the edges of one lower end; `seen` [V] holds edge numbers of this end's higher ones, NO_FACE elsewhere. */
static void collect(const mesh *m, uint32_t low, const uint32_t *first, const uint32_t *next, uint32_t *seen,
                    mesh_edges *out)
{
  for (uint32_t h = first[low]; h != NO_FACE; h = next[h]) {
    uint32_t const high = higher_end(m, h);
    if (seen[high] == NO_FACE) {
      seen[high] = (uint32_t)out->count;
      out->edges[out->count++] = (mesh_edge){{low, high}, {NO_FACE, NO_FACE}};
    }
    mesh_edge *edge = &out->edges[seen[high]];
    out->of_face[h / 3][h % 3] = seen[high];
    if (edge->faces[0] == NO_FACE) {
      edge->faces[0] = h / 3;
    } else if (edge->faces[1] == NO_FACE) {
      edge->faces[1] = h / 3;
    }
  }
  for (uint32_t h = first[low]; h != NO_FACE; h = next[h]) {
    seen[higher_end(m, h)] = NO_FACE;
  }
}

exm_status mesh_edges_find(arena *owner, const mesh *m, mesh_edges *out)
{
  arena scratch = {0};
  mesh_edges found = {0};
  uint32_t *first = ARENA_NEW(&scratch, uint32_t, m->vertex_count);
  uint32_t *seen = ARENA_NEW(&scratch, uint32_t, m->vertex_count);
  uint32_t *next = ARENA_NEW(&scratch, uint32_t, 3 * m->triangle_count);
  found.edges = ARENA_NEW(owner, mesh_edge, 3 * m->triangle_count);
  found.of_face = arena_array(owner, m->triangle_count, sizeof *found.of_face);
  exm_status status = first && seen && next && found.edges && found.of_face ? EXM_OK : status_no_memory("the edges");
  if (status >= 0) {
    memset(seen, 0xff, m->vertex_count * sizeof *seen);
    link_by_lower_end(m, first, next);
    for (size_t v = 0; v < m->vertex_count; v++) {
      collect(m, (uint32_t)v, first, next, seen, &found);
    }
    *out = found;
  }
  arena_release(&scratch);
  return status;
}

/** Flood from one triangle; gives how many are in the order then. */
static size_t flood(const mesh_edges *edges, size_t seed, size_t count, uint8_t *is_in, face_order *out)
{
  out->faces[count] = (uint32_t)seed;
  out->parents[count] = NO_FACE;
  is_in[seed] = 1;
  for (size_t head = count++; head < count; head++) {
    uint32_t const f = out->faces[head];
    for (int i = 0; i < 3; i++) {
      const mesh_edge *edge = &edges->edges[edges->of_face[f][i]];
      for (int side = 0; side < 2; side++) {
        uint32_t const g = edge->faces[side];
        if (g != NO_FACE && !is_in[g]) {
          is_in[g] = 1;
          out->parents[count] = f;
          out->faces[count++] = g;
        }
      }
    }
  }
  return count;
}

exm_status face_order_find(arena *owner, const mesh *m, const mesh_edges *edges, face_order *out)
{
  arena scratch = {0};
  face_order found = {0};
  size_t count = 0;
  uint8_t *is_in = ARENA_NEW(&scratch, uint8_t, m->triangle_count);
  found.faces = ARENA_NEW(owner, uint32_t, m->triangle_count);
  found.parents = ARENA_NEW(owner, uint32_t, m->triangle_count);
  exm_status const status = is_in && found.faces && found.parents ? EXM_OK : status_no_memory("the triangles' order");
  for (size_t f = 0; f < m->triangle_count && status >= 0; f++) {
    if (!is_in[f]) {
      found.part_count++;
      count = flood(edges, f, count, is_in, &found);
    }
  }
  arena_release(&scratch);
  *out = found;
  return status;
}
