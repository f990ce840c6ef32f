/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edge groups as pieces of the mesh. Group g's edge set is made of whole triangles, each with the share of its corners
 * that are in g: then sum_g L_g is the cotangent Laplacian, and each L_g is positive semidefinite whatever the angles.
 */
#ifndef EXM_SUBSPACE_PATCH_H
#define EXM_SUBSPACE_PATCH_H

#include "subspace/dictionary.h"

/** Triangles by group: one that touches two groups is listed in both. */
typedef struct incidence {
  size_t *offsets; /* [groups + 1] */
  uint32_t *triangles;
  double *shares;
} incidence;

exm_status incidence_create(arena *owner, const mesh *reference, const uint32_t *labels, size_t group_count,
                            incidence *out);

/** The triangles of one group, their corners renumbered, and the dictionary's values there. */
typedef struct patch {
  size_t triangle_count, vertex_count, column_count;
  const uint32_t *triangles; /* of the mesh, ascending */
  const double *shares;      /* of their corners that are in the group */
  uint32_t *vertices;        /* [vertex_count] of the mesh */
  uint32_t *local;           /* [V] where a vertex of the mesh is among them; UINT32_MAX elsewhere */
  size_t *columns;           /* [column_count] atoms that have weight on the patch, rising */
  double *atoms;             /* [vertex_count][column_count] */
} patch;

/** Room for the vertices of any one group, from `scratch`; taken up anew by each patch_begin. */
exm_status patch_create(arena *scratch, const mesh *reference, patch *out);

/** The patch of group g: columns from `owner`, atoms from `scratch`; neither where d is NULL. */
exm_status patch_begin(arena *owner, arena *scratch, const mesh *reference, const dictionary *d, const incidence *in,
                       size_t group, patch *area);

#endif
