/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The spokes of every vertex, the half-edges that leave it, with the weights of [Rigidity, eq. 2], and what local and
 * global steps sum over them. Any larger neighbourhood is a union of them. */
#ifndef EXM_DEFORM_RIGIDITY_SPOKES_H
#define EXM_DEFORM_RIGIDITY_SPOKES_H

#include "linalg/set_sums.h"
#include "mesh/balls.h"

typedef struct spokes {
  rings around;    /* the mesh's */
  double *weights; /* [offsets[V]] w_ij */
  four *arms;      /* [offsets[V]] w_ij (p_i - p_j), 0 */
  double *rest;    /* [V] sum_j w_ij |p_i - p_j|^2 */
} spokes;

/** The mesh's rings have to stay. */
exm_status spokes_create(arena *owner, const mesh *m, spokes *out);

/**
 * Vertices begin..end of C_i = sum_j w_ij (p'_i - p'_j) (p_i - p_j)', row-major, and their share of
 * sum_i d_i sum_j w_ij |p'_i - p'_j|^2, which is returned.
 */
double spokes_moments(const spokes *s, size_t begin, size_t end, const double *positions, const double *multiplicity,
                      row12 *moments);

/** Vertices begin..end of b_i = sum_j (T_i + T_j) w_ij (p_i - p_j), the right-hand side of eq. 5 for sums T_i of
 *  rotations, given transposed. out [V][3] */
void spokes_forces(const spokes *s, size_t begin, size_t end, const row12 *sums, double *out);

#endif
