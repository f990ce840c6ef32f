/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The edges of a mesh with the triangles on them, and an order in which triangles hang together. */
#ifndef EXM_MESH_EDGES_H
#define EXM_MESH_EDGES_H

#include "mesh/mesh.h"

/** An edge, and two of its triangles: the first two where there are more. */
typedef struct mesh_edge {
  uint32_t ends[2];  /* the lower first */
  uint32_t faces[2]; /* NO_FACE where there is one */
} mesh_edge;

#define NO_FACE UINT32_MAX

typedef struct mesh_edges {
  size_t count;
  mesh_edge *edges;       /* sorted by their ends */
  uint32_t (*of_face)[3]; /* [F] number of the edge opposite to each corner */
} mesh_edges;

exm_status mesh_edges_find(arena *owner, const mesh *m, mesh_edges *out);

/** The triangles in an order in which every one follows a neighbour across an edge, where it has one before it. */
typedef struct face_order {
  size_t part_count; /* of triangles that hang together by edges */
  uint32_t *faces;   /* [F] in that order */
  uint32_t *parents; /* [F] of faces[i]: a triangle before it, or NO_FACE: a part begins */
} face_order;

exm_status face_order_find(arena *owner, const mesh *m, const mesh_edges *edges, face_order *out);

#endif
