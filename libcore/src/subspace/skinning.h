/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Coefficients to positions: the only work of a solve that sees vertices. */
#ifndef EXM_SUBSPACE_SKINNING_H
#define EXM_SUBSPACE_SKINNING_H

#include "base/status.h"

typedef struct skinning skinning;

exm_status skinning_create(size_t vertex_count, size_t handle_count, size_t exemplar_count, const float *weights,
                           const float *exemplars, skinning **out);
void skinning_apply(const skinning *skin, const double *coefficients, int thread_count, float *positions);
void skinning_apply_f64(const skinning *skin, const double *coefficients, double *positions);
void skinning_destroy(skinning *skin);

#endif
