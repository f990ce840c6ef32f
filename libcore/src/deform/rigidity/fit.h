/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The local step's rotations [Rigidity, 3.2.2]. */
#ifndef EXM_DEFORM_RIGIDITY_FIT_H
#define EXM_DEFORM_RIGIDITY_FIT_H

#include "linalg/set_sums.h"

/** For rows begin..end of S, the rotations R that maximise tr R'S, transposed (part b holds column b of R), and that
 *  maximum. Fourth numbers are not looked at. */
void fit_rotations(const row12 *sums, size_t begin, size_t end, row12 *rotations, double *gains);

#endif
