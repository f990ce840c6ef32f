/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Handle constraints as linear functionals of the positions, A T = c [AMRAP, eq. 20].
 *
 * A pinned handle has one row: the mean of its vertices is where its target is. An oriented handle has as many more
 * rows as its vertices span directions v_j: with r_i the reference offsets, sum_i (r_i . v_j) / m_j q_i is the image of
 * v_j under the affine map that fits the handle's vertices best, m_j the second moment along v_j. */
#ifndef EXM_SUBSPACE_CONSTRAINTS_H
#define EXM_SUBSPACE_CONSTRAINTS_H

#include "subspace/dictionary.h"

typedef struct constraint_row {
  size_t handle;
  int is_frame;        /* 0: a position; 1: the image of `direction` */
  double direction[3]; /* unit, in the coordinates of the space */
  size_t term_count;   /* the functional is a weighted sum of positions */
  const uint32_t *vertices;
  const double *weights;
} constraint_row;

typedef struct constraints {
  size_t row_count;
  constraint_row *rows;
} constraints;

/** Everything is allocated from `owner`. */
exm_status constraints_create(arena *owner, const mesh *reference, const exm_handles *handles, const space *s,
                              constraints *out);

/** The right-hand side c [row_count][d] for targets [H][3][4]. */
void constraints_targets(const constraints *c, const space *s, const double *targets, double *out);

/** The rows' values on the exemplars, [row_count][S d]. */
void constraints_on_exemplars(const constraints *c, const dictionary *d, double *out);

/** The rows' values on a pose [V][3], [row_count][d]. */
void constraints_on_pose(const constraints *c, const space *s, const float *pose, double *out);

/** The matrix A, [row_count][atom_count]. */
void constraints_matrix(const constraints *c, const dictionary *d, double *scratch, double *out);

/** A handle's linear map [d][d] from its rows' images of their directions, which lie `stride` doubles apart,
 * [row_count] in all: a plane's normal follows as the images' cross product, one direction alone leaves the others as
 * they are. linear comes in as zeros. */
void constraints_frame(const constraints *c, size_t d, size_t handle, const double *images, size_t stride,
                       double *linear);

#endif
