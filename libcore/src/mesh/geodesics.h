/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Geodesic discs: vertices within a distance along the surface.
 *
 * Fronts run in Dijkstra's order and cross triangles as in the plane: two corners with known distances place the source
 * beside their edge, and the third is as far as from there [Novotni and Klein, "Computing geodesic distances on
 * triangular meshes", WSCG 2002; the front is that of Kimmel and Sethian's fast marching, 1998]. Exact on flat ground.
 */
#ifndef EXM_MESH_GEODESICS_H
#define EXM_MESH_GEODESICS_H

#include <stdint.h>

#include "base/memory.h"
#include "base/status.h"

typedef struct geodesics {
  size_t vertex_count;
  const double (*positions)[3];
  const uint32_t (*triangles)[3];
  uint32_t *offsets; /* [V + 1] */
  uint32_t *faces;   /* triangles around each vertex; of a cloud, its points' neighbours */
  int is_cloud;
  /* The last disc. */
  size_t count;
  uint32_t *vertices; /* [count] */
  double *distances;  /* [V] of those; infinite elsewhere */
  uint32_t *places;   /* [V] in the heap */
  uint32_t *heap;
  size_t heap_count;
} geodesics;

/** On a surface. Corners of a triangle differ. Positions and triangles are not copied. */
exm_status geodesics_create(arena *owner, const double (*positions)[3], size_t vertex_count,
                            const uint32_t (*triangles)[3], size_t triangle_count, geodesics *out);

/** On a cloud: paths along the graph of neighbours [V][each], which are a little longer than the surface's. Entries of
 *  UINT32_MAX are passed over. */
exm_status geodesics_create_cloud(arena *owner, const double (*positions)[3], size_t vertex_count,
                                  const uint32_t *neighbors, size_t each, geodesics *out);

/** The vertices within `radius` of `source`, into out->vertices and out->distances. */
void geodesics_disc(geodesics *g, uint32_t source, double radius);

#endif
