/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_WEIGHTS_BOUNDED_BIHARMONIC_H
#define EXM_WEIGHTS_BOUNDED_BIHARMONIC_H

#include "base/progress.h"
#include "mesh/mesh.h"

/**
 * Bounded biharmonic weights; see exm_weights_bounded_biharmonic.
 *
 * handles  that handles_check_vertices has passed
 * report   may be NULL
 * weights  [H][V] out; untouched on failure
 */
exm_status weights_bounded_biharmonic(const mesh *reference, const exm_handles *handles, const progress *report,
                                      float *weights);

#endif
