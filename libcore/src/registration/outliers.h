/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_REGISTRATION_OUTLIERS_H
#define EXM_REGISTRATION_OUTLIERS_H

#include "registration/landmarks.h"

/**
 * Landmarks that contradict all others: without one of them the rest is met by far easier.
 *
 * rows      of the landmarks as points, held by the deformer, with a pose of this energy
 * weights   [rows] out: 0 for those that are rejected, else as they were
 * rejected  [rows] out: how many landmarks were there; a sixth of them at most
 */
exm_status outliers_find(registration *r, const landmark_rows *rows, const exm_registration_fit_settings *settings,
                         double energy, double *weights, size_t *rejected);

#endif
