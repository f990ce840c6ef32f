/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/rim.h"

/** Is an edge from v to a corner of its triangles there once only? seen [V]: counts of those corners. */
static uint8_t has_open_edge(const geodesics *ways, size_t v, const uint32_t *seen)
{
  for (uint32_t i = 3 * ways->offsets[v]; i < 3 * ways->offsets[v + 1]; i++) {
    uint32_t const corner = ways->triangles[ways->faces[i / 3]][i % 3];
    if (corner != v && seen[corner] == 1) {
      return 1;
    }
  }
  return 0;
}

static void count_corners(const geodesics *ways, size_t v, int is_counting, uint32_t *seen)
{
  for (uint32_t i = 3 * ways->offsets[v]; i < 3 * ways->offsets[v + 1]; i++) {
    uint32_t *at = &seen[ways->triangles[ways->faces[i / 3]][i % 3]];
    *at = is_counting ? *at + 1 : 0;
  }
}

exm_status mesh_rim(const geodesics *ways, uint8_t *is_rim)
{
  arena scratch = {0};
  uint32_t *seen = ARENA_NEW(&scratch, uint32_t, ways->vertex_count);
  if (!seen) {
    return status_no_memory("the boundary");
  }
  for (size_t v = 0; v < ways->vertex_count; v++) {
    count_corners(ways, v, 1, seen);
    is_rim[v] = has_open_edge(ways, v, seen);
    count_corners(ways, v, 0, seen);
  }
  arena_release(&scratch);
  return EXM_OK;
}
