/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Handles as callers give them, checked once for every kind of deformer. */
#ifndef EXM_WEIGHTS_HANDLES_H
#define EXM_WEIGHTS_HANDLES_H

#include "mesh/mesh.h"

/** Pointers, offsets, vertices in range and none of them twice; not the kinds. EXM_ERROR_ARGUMENT. */
exm_status handles_check_vertices(const mesh *reference, const exm_handles *handles);

/** All of that and the kinds. EXM_ERROR_ARGUMENT. */
exm_status handles_check(const mesh *reference, const exm_handles *handles);

/** Does every connected part have a vertex of a handle? EXM_ERROR_UNCONSTRAINED. */
exm_status handles_check_coverage(const mesh *reference, const exm_handles *handles);

/** A caller's weights [H][V]: finite, not negative, 1 and 0 on the handles' vertices, columns that sum to 1 within
 *  1e-3. EXM_ERROR_ARGUMENT. */
exm_status handles_check_weights(const mesh *reference, const exm_handles *handles, const float *weights);

#endif
