/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Non-rigid ICP over the dictionary [Blended, 5]. Each round looks for counterparts both ways, of the mesh's samples on
 * the scan and of the scan's on the mesh, and poses the mesh by them. */
#ifndef EXM_REGISTRATION_ICP_H
#define EXM_REGISTRATION_ICP_H

#include "registration/landmarks.h"
#include "registration/pulls.h"
#include "registration/shape.h"

typedef struct icp {
  registration *r;
  const fit_request *request;
  const landmark_rows *landmarks;
  double *landmark_basis; /* [landmark rows][rank] */
  registered_pose pose;
  shape *surface;
  pulls pulls;
  size_t sample_count, scan_sample_count;
  uint32_t *scan_samples;
  double reach; /* in the caller's unit */
  double scan_area;
  /* Scratch, [the larger sample count]. */
  double (*queries)[3], (*directions)[3];
  uint32_t *found;
  double *squared;
  foot *feet;
  double *distances; /* of this round's correspondences */
  size_t distance_count;
  /* Rotations of all exemplars for the pose, and what they are fitted to: [S][G d][3]. */
  double *rotations, *fits, *elastic;
  int32_t iterations;
  int converged;
  double energy;
} icp;

exm_status icp_create(arena *owner, registration *r, const fit_request *request, const landmark_rows *landmarks,
                      shape *surface, icp *out);

/** From icp->pose, which the surface has taken on. */
exm_status icp_run(icp *fit, const progress *report);

/** Counterparts for this round: fills fit->pulls but for the factor. `strength` of the scan's points in all,
 *  `landmark_strength` of each landmark. */
exm_status icp_correspond(icp *fit, double strength, double landmark_strength, double samples_share);

#endif
