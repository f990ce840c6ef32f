/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Metric multidimensional scaling in the plane: points whose distances are close to given ones, by majorisation of the
 * raw stress [Borg and Groenen, "Modern multidimensional scaling", chapter 8]

     sum_{i<j} (|p_i - p_j| - d_ij)^2                                                       [SEQ, eq. 6]

 * Any of the points may be pinned. With equal weights the matrix of a step has a closed inverse, pins or not. Steps are
 * mixed [numeric/anderson.h], and a mixed step that does not lower the stress is taken back. */
#ifndef EXM_NUMERIC_STRESS_H
#define EXM_NUMERIC_STRESS_H

#include <stdint.h>

#include "base/progress.h"

/**
 * distances   [n][n] symmetric
 * pinned      [n] 1: stays where it is; NULL: none
 * iterations  at most; 0: a cap that is hardly ever met
 * points      [n][2] in: where to begin; out: the layout
 * stress      out
 */
exm_status stress_majorise(size_t count, const double *distances, const uint8_t *pinned, size_t iterations,
                           const progress *report, double (*points)[2], double *stress);

#endif
