/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Landmarks as linear constraints: averages of positions over geodesic discs of several radii, on the mesh and on the
 * scan alike, each vertex by its Voronoi area [Blended, 5]. */
#ifndef EXM_REGISTRATION_LANDMARKS_H
#define EXM_REGISTRATION_LANDMARKS_H

#include "registration/registration.h"

typedef struct landmark_rows {
  size_t count;
  size_t *offsets;      /* [count + 1] terms of row i */
  uint32_t *vertices;   /* of the mesh */
  double *coefficients; /* that sum to 1 */
  double *weights;      /* [count]; those of one landmark sum to its weight */
  double (*targets)[3]; /* [count] in the caller's space */
} landmark_rows;

/** Rows that hold the landmarks' vertices themselves. */
exm_status landmark_points(arena *owner, const exm_landmarks *landmarks, landmark_rows *out);

/** Rows of discs, for a scan that is `scale` times as large as the mesh; a landmark whose surroundings are not whole on
 *  the scan has a row of its point alone. */
exm_status landmark_discs(arena *owner, const registration *r, const fit_request *request,
                          const exm_landmarks *landmarks, double scale, landmark_rows *out);

/** Put the rows in the place of those that the deformer has. */
exm_status landmark_hold(registration *r, const landmark_rows *rows);

/** Pose the deformer by the rows that it holds, given a scale or to find one. */
exm_status landmark_pose(registration *r, const landmark_rows *rows, const exm_registration_fit_settings *settings,
                         exm_blended_outcome *outcome);

/** Enough points, not all on a line: EXM_ERROR_UNCONSTRAINED. */
exm_status landmark_check_spread(const exm_landmarks *landmarks, size_t least);

#endif
