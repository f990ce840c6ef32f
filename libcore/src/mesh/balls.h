/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Balls of the graph of edges: the vertices within r - 1 edges of vertex k, whose spokes are the neighbourhood N(k, r)
 * of [Rigidity, 3.1]. */
#ifndef EXM_MESH_BALLS_H
#define EXM_MESH_BALLS_H

#include "base/progress.h"
#include "linalg/set_sums.h"
#include "mesh/mesh.h"

/** The rings of a mesh, wherever they are kept. */
typedef struct rings {
  size_t vertex_count;
  const uint32_t *offsets;   /* [V + 1] */
  const uint32_t *neighbors; /* [offsets[V]] */
} rings;

/**
 * Sums over the balls of all vertices.
 *
 * radii   [V] r of each vertex, 1 or more
 * counts  [V] out: in how many balls each vertex is; may be NULL
 */
exm_status balls_create(arena *owner, const rings *around, const int32_t *radii, const progress *report, double *counts,
                        set_sums *out);

#endif
