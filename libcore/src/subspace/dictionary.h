/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The dictionary of skinning atoms [AMRAP, eq. 6]: a pose is  v_p = sum_h w_hp (t_h + sum_s A_hs (p_s - c_hs)).
 *
 * Two departures from the print. One translation a handle serves all exemplars, since the paper's one an exemplar are
 * duplicates. Atoms are centred: c_hs is where exemplar s has the handle's centre, so that pinning a handle fixes t_h
 * and nothing else, and the atoms of one handle are far less collinear.
 *
 * With many exemplars most of a handle's atoms repeat (exemplars agree in most regions): dictionary_mix replaces them
 * by an orthogonal mixture that spans the same. */
#ifndef EXM_SUBSPACE_DICTIONARY_H
#define EXM_SUBSPACE_DICTIONARY_H

#include "mesh/mesh.h"
#include "subspace/space.h"

typedef struct dictionary {
  size_t vertex_count, handle_count, exemplar_count;
  size_t dimension;
  /* Weights by vertex, without the zeros. */
  size_t *weight_offsets; /* [V + 1] */
  uint32_t *weight_handles;
  double *weight_values;
  double *exemplars;    /* [V][S d] coordinates of the space, exemplars side by side */
  double *centres;      /* [H][S d] */
  size_t *atom_offsets; /* [H + 1] columns of handle h; the first of them is its translation */
  double **mixtures;    /* [H] each [atoms of h - 1][S d], orthonormal rows; NULL for the identity */
  size_t atom_count;
} dictionary;

/** What a dictionary is made from. Weights come from handles, or are functions that belong to no place (eigenfunctions,
 *  bones): those need not sum to one and are taken as they are, and their atoms are centred on each exemplar's
 * centroid. */
typedef struct dictionary_source {
  const exm_handles *handles; /* NULL for functions */
  size_t weight_count;        /* H */
  const float *weights;       /* [H][V] */
  size_t exemplar_count;
  const float *poses; /* [S][V][3] */
} dictionary_source;

/** Everything is allocated from `owner`. */
exm_status dictionary_create(arena *owner, const mesh *reference, const dictionary_source *source, const space *s,
                             dictionary *out);

/** Replace every handle's atoms by mixtures, where they are many. */
exm_status dictionary_mix(arena *owner, const mesh *reference, dictionary *d);

/** Values of handle h's atoms at vertex v where its weight is w: [atoms of h]. */
void dictionary_atoms(const dictionary *d, size_t handle, size_t vertex, double weight, double *out);

/** Coefficients that give all exemplars back, [atom_count][S d]: columns s d .. s d + d are exemplar s. */
void dictionary_exemplar_coefficients(const dictionary *d, double *out);

/** Coefficients [atom_count][dimension] as affine maps of the caller's space over uncentred exemplars, which is what
 *  skinning applies: [H][1 + 3 S][3]. heights [H] lifts handles off the plane of a two-dimensional space; or NULL.
 *  scratch
 *  [(1 + S d) d]. */
void dictionary_affine(const dictionary *d, const space *s, const double *coefficients, const double *heights,
                       double *scratch, double *out);

#endif
