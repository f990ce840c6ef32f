/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rotations to start from, out of a graph of regions. Local and global steps move a turn from vertex to vertex; what
 * has to cross the mesh is found among a few hundred regions first, and refined level by level.
 *
 * A level's nodes are regions of the finer one, some rings wide; two that touch are joined with the sum of the weights
 * of the edges between them, which is the finer energy of maps that are constant on regions. Its radii measure the same
 * lengths in wider rings. Regions about fixed vertices are fixed as they are. It is an approximation, of a start. */
#ifndef EXM_DEFORM_RIGIDITY_COARSE_H
#define EXM_DEFORM_RIGIDITY_COARSE_H

#include "deform/rigidity/solver.h"

typedef struct coarse_level coarse_level;

typedef struct coarse_source {
  const spokes *s;
  const double (*positions)[3];
  const int32_t *radii;
  const held *h;
} coarse_source;

/** Levels down to a few hundred nodes. NULL in *out where there is nothing to be gained: few vertices, or most held. */
exm_status coarse_create(const coarse_source *fine, coarse_level **out);
void coarse_destroy(coarse_level *level);

/** Solve from the coarsest level to this one, and write rotations for each of the finer level's `count` vertices. */
exm_status coarse_start(coarse_level *level, const double *targets, size_t count, row12 *rotations);

/** The levels go on from their last solve to other targets; the finer level's rotations are turned as their regions
 *  turn. */
exm_status coarse_advance(coarse_level *level, const double *targets, size_t count, row12 *rotations);

#endif
