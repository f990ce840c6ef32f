/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What shape spaces that are not positions share: the mesh taken apart into triangles, each with an edge vector a side,
 * and put together again by a Poisson equation [SEQ, section 5; Sumner and Popovic 2004]:
 *
 *   min over x of  sum_f sum_i c_fi |(x_k - x_j) - e_fi|^2,    corner i opposite to the edge from j to k,
 *
 * factored once; the connected parts of the mesh are moved to their centres afterwards. */
#ifndef EXM_SEQUENCE_SHAPE_SPACES_SURFACE_H
#define EXM_SEQUENCE_SHAPE_SPACES_SURFACE_H

#include "linalg/cholesky.h"
#include "mesh/edges.h"

typedef struct surface {
  const mesh *reference;
  mesh_edges edges;
  face_order order;
  cholesky *factor;
  double *right;        /* [V][3] scratch */
  double *counts;       /* [components] vertices */
  double *face_weights; /* [F] root of the share of the area */
  double (*frames)[9];  /* [F] inverse of [e_2 | -e_1 | normal] of the reference, of degenerate ones zero */
  /* Root of V times the radius of inertia: a turn of the whole mesh by a small angle moves the vertices, all squares
   * summed, by the angle times that. Coordinates that are angles or stretches are scaled by it. */
  double turn;
} surface;

/** From vertex to vertex of positions [V][3]. */
static inline void vector_between(const float *positions, size_t from, size_t to, double out[3])
{
  for (size_t k = 0; k < 3; k++) {
    out[k] = (double)positions[3 * to + k] - (double)positions[3 * from + k];
  }
}

/** The surface may be released whether or not it could be created. */
exm_status surface_create(arena *owner, const mesh *reference, surface *out);
void surface_release(surface *s);

/** The map [3][3] that takes triangle f of the reference to that of `positions` [V][3], unit normal to unit normal. */
void surface_gradient(const surface *s, const float *positions, size_t f, double gradient[9]);

/** Begin with `right` all zero, add every triangle with its edge vectors [3][3], then solve. */
void surface_begin(surface *s);
void surface_add_face(surface *s, size_t f, const double edges[9]);
/** The same with the edges that a gradient [3][3] makes of the reference's. */
void surface_add_gradient(surface *s, size_t f, const double gradient[9]);
/** centres [components][3], of the vertices of each part; positions [V][3] out. */
exm_status surface_solve(surface *s, const double *centres, double *positions);

/** Centres of the connected parts as coordinates, [components][3], scaled by the root of their vertices; and back. */
void surface_put_centres(const surface *s, const float *positions, double *coordinates);
void surface_take_centres(const surface *s, const double *coordinates, double *centres);

/** The reference's positions [V][3] in single precision; NULL where memory is short. */
float *surface_positions(const surface *s, arena *owner);

/** What lengths of edges are scaled by: a mesh that grows by a share is then as far away as in positions. */
double surface_length_scale(const surface *s);

/** axes[0] and axes[1] become orthonormal, the first keeping its direction, and axes[2] normal to both. Where they span
 * no plane, some plane is taken. */
void surface_orthonormal(double axes[3][3]);

/** Edge i of triangle f in the reference, from corner i + 1 to corner i + 2. */
void surface_edge(const surface *s, size_t f, size_t i, double edge[3]);

#endif
