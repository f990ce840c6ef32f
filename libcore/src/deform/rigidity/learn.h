/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Radii from poses [Rigidity, 3.4]. */
#ifndef EXM_DEFORM_RIGIDITY_LEARN_H
#define EXM_DEFORM_RIGIDITY_LEARN_H

#include "base/progress.h"
#include "mesh/mesh.h"

typedef struct learn_request {
  const mesh *reference;
  const float *poses; /* [pose_count][V][3] */
  size_t pose_count;
  int32_t radius_min, radius_max;
  double omega;
  progress report;
} learn_request;

/** radii [V]; energies [radius_max - radius_min + 1][V] or NULL. */
exm_status rigidity_learn(const learn_request *request, int32_t *radii, double *energies);

#endif
