/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_WEIGHTS_EIGENFUNCTIONS_H
#define EXM_WEIGHTS_EIGENFUNCTIONS_H

#include "base/progress.h"
#include "mesh/mesh.h"

/**
 * The first `count` eigenfunctions of the Laplace-Beltrami operator, L f = lambda M f with the cotangent Laplacian and
 * the mesh's masses; see exm_weights_eigenfunctions.
 *
 * count   at most the number of vertices
 * report  may be NULL
 * values  [count] out; functions [count][V] out
 */
exm_status weights_eigenfunctions(const mesh *reference, size_t count, const progress *report, double *values,
                                  double *functions);

#endif
