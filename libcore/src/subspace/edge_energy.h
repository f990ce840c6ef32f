/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The as-rigid-as-possible energy over a dictionary [Blended, eq. 2]: with poses D T,
 *
 *     2 E(V_s, D T) = tr T'(D'L D)T - 2 sum_g tr R_gs K_gs T + tr V_s'L V_s,    K_gs = V_s' L_g D,
 *
 * for every exemplar s against the edge sets of the same groups g. Unlike group_factor, these are Gram matrices, which
 * halve the digits: right where atoms are many and constraints soft, and an order faster. */
#ifndef EXM_SUBSPACE_EDGE_ENERGY_H
#define EXM_SUBSPACE_EDGE_ENERGY_H

#include "base/progress.h"
#include "subspace/dictionary.h"

typedef struct edge_energy {
  size_t atom_count, group_count, exemplar_count, dimension;
  double *laplacian; /* [atoms][atoms] D'L D */
  double *masses;    /* [atoms][atoms] D'M D over the total mass */
  double *proxies;   /* [S][G][d][atoms] K_gs */
  double *own;       /* [S] tr V_s'L V_s */
} edge_energy;

/** labels [V] below group_count. Everything is allocated from `owner`. */
exm_status edge_energy_create(arena *owner, const mesh *reference, const dictionary *d, const uint32_t *labels,
                              size_t group_count, const progress *report, edge_energy *out);

#endif
