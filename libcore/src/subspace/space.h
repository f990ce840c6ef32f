/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The coordinates that the reduced solvers work in: centred on the reference, its diagonal as the unit of length, and
 * two-dimensional where every pose lies in the reference's plane. */
#ifndef EXM_SUBSPACE_SPACE_H
#define EXM_SUBSPACE_SPACE_H

#include "mesh/mesh.h"

typedef struct space {
  size_t dimension; /* 2 or 3 */
  double origin[3];
  double axes[3][3]; /* rows; the first `dimension` span the space, the third is the normal of a planar one */
  double unit;       /* length of one unit, in the caller's */
} space;

/**
 * dimension  2, 3, or 0 for 2 where the mesh and all poses [count][V][3] share a plane
 *
 * Errors: EXM_ERROR_ARGUMENT where 2 is asked for and a vertex lies outside the plane.
 */
exm_status space_create(const mesh *reference, const float *poses, size_t count, int32_t dimension, space *out);

/** Coordinates of a point, and the way back. out: [dimension]. */
void space_from_point(const space *s, const double point[3], double *out);
void space_to_point(const space *s, const double *coordinates, double out[3]);

/** Height of a point over the plane of a two-dimensional space, in units; 0 in three dimensions. */
double space_height(const space *s, const double point[3]);

/** A linear map of the caller's space in these coordinates, [dimension][dimension] row-major; and the way back, where
 * the normal of a plane is kept. */
void space_from_linear(const space *s, const double linear[3][3], double *out);
void space_to_linear(const space *s, const double *coordinates, double out[3][3]);

#endif
