/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The space of all positions that meet the handles, for meshes of no more vertices than a dictionary would have atoms.
 *
 * Each constraint gives one vertex away, the bound one: positions are x = N k + Y c with k the other vertices, the kept
 * ones. With C C' = N'LN a sparse root of their elastic energy, u = C'k is a basis that is orthonormal in the energy,
 * as that of a dictionary is (subspace/reduced.h), and to change to it costs a sparse triangular solve. */
#ifndef EXM_SUBSPACE_VERTICES_H
#define EXM_SUBSPACE_VERTICES_H

#include "linalg/cholesky.h"
#include "mesh/mesh.h"
#include "subspace/constraints.h"

typedef struct vertex_space {
  size_t vertex_count, kept_count, bound_count;
  size_t *kept, *bound; /* vertices */
  /* x_bound = to_bound c - rest x_kept, with rest sparse by rows; columns are places among the kept. */
  double *to_bound; /* [bound][bound] */
  size_t *rest_offsets;
  uint32_t *rest_columns;
  double *rest_values;
  double *held; /* Y [V][bound]: positions of least energy under c */
  cholesky *root;
} vertex_space;

/**
 * All but the root comes from `owner`; vertices_destroy releases that, also after a failure.
 *
 * Errors: EXM_ERROR_NUMERIC where constraints depend on one another or leave a vertex free to move without energy.
 */
exm_status vertices_create(arena *owner, const mesh *reference, const constraints *c, vertex_space *out);
void vertices_destroy(vertex_space *s);

/** u [kept][width] = C^-1 N' f for forces f [V][width]. */
void vertices_to_basis(const vertex_space *s, size_t width, const double *forces, double *u);

/** x [V][width] = N C'^-1 u; u is overwritten. */
void vertices_from_basis(const vertex_space *s, size_t width, double *u, double *points);

/** points [V][d] += Y c for c [bound][d]. */
void vertices_hold(const vertex_space *s, size_t d, const double *c, double *points);

#endif
