/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A square root of the elastic energy of each edge group over the dictionary.
 *
 * Group g's edge set is made of whole triangles, each with the share of its corners that are in g, so that
 * sum_g L_g is the cotangent Laplacian and each L_g is positive semidefinite whatever the angles: a triangle's three
 * cotangent terms add up to the Dirichlet energy of a linear function. With R_g' R_g = D' L_g D, the energy of
 * coefficients T in the group is 1/2 |R_g T - R_g T_rest|^2: the rows of R_g T are a handful of "proxy edges" that
 * stand for all the edges of the group. R_g comes from a QR factorisation of the gradients, not from their Gram matrix,
 * which would halve the digits. */
#ifndef EXM_SUBSPACE_GROUP_FACTOR_H
#define EXM_SUBSPACE_GROUP_FACTOR_H

#include "base/progress.h"
#include "subspace/dictionary.h"

typedef struct group_factor {
  size_t row_count, column_count;
  size_t *columns; /* [column_count] of the dictionary's atoms, rising */
  double *rows;    /* [row_count][column_count] */
  /* From group_roots_create alone: the rows as combinations of vertices, whose columns are these. */
  size_t vertex_count;
  uint32_t *vertices; /* [vertex_count] of the mesh */
  double *root;       /* [row_count][vertex_count] */
} group_factor;

/** labels [V] below group_count; factors [group_count] out, from `owner`. */
exm_status group_factors_create(arena *owner, const mesh *reference, const dictionary *d, const uint32_t *labels,
                                size_t group_count, const progress *report, group_factor *factors);

/** The same over the vertices themselves, for groups of few: every factor has its root, and no columns. Cubic in the
 *  largest group. */
exm_status group_roots_create(arena *owner, const mesh *reference, const uint32_t *labels, size_t group_count,
                              const progress *report, group_factor *factors);

#endif
