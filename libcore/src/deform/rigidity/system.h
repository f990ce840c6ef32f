/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The global step: positions for given rotations [Rigidity, eq. 5]. The matrix is that of the whole mesh, with rows and
 * columns of fixed vertices replaced by the identity's, as in the paper: its pattern depends on the mesh alone, so one
 * analysis serves every handle set. Patches are held by multipliers, one a patch, through a Schur complement. */
#ifndef EXM_DEFORM_RIGIDITY_SYSTEM_H
#define EXM_DEFORM_RIGIDITY_SYSTEM_H

#include "deform/rigidity/held.h"
#include "deform/rigidity/spokes.h"
#include "linalg/cholesky.h"

typedef struct system_coupling {
  uint32_t vertex, fixed; /* a free vertex, and which of the fixed it is next to */
  double weight;
} system_coupling;

typedef struct rigidity_system {
  arena memory;
  size_t vertex_count;
  double *multiplicity;     /* [V] d_i: by how many edge sets each vertex's spokes count, discs included */
  double *disc_weights;     /* [entries of discs] s_i */
  row12 *disc_rotations[2]; /* [discs] room for a solver's two states */
  cholesky *factor;
  size_t coupling_count;
  system_coupling *couplings;
  double *responses; /* [V][patches] A^-1 M' */
  double *solution;  /* [patches + grounds][patches]: multipliers and places of grounds, from how far patches are off */
  double *misses, *answers; /* [patches][3], [patches + grounds][3] */
} rigidity_system;

/** The pattern of the matrix, for values that change. */
exm_status system_pattern(arena *owner, const rings *around, sparse *out);

/**
 * pattern  of the mesh; its values are overwritten
 * counts   [V] in how many neighbourhoods each vertex is
 * like     a system of the same mesh, whose analysis is used, or NULL
 * out      has an arena of its own, also on failure
 */
exm_status system_create(const spokes *s, const held *h, sparse *pattern, const double *counts,
                         const rigidity_system *like, rigidity_system *out);
void system_destroy(rigidity_system *system);

/**
 * components  [V] connected parts
 * targets     [H][3][4]
 * positions   [V][3] in: forces; out: positions
 */
exm_status system_solve(rigidity_system *system, const held *h, const uint32_t *components, const double *targets,
                        double *positions);

#endif
