/* SPDX-License-Identifier: GPL-3.0-or-later */
/* From coefficients to positions, the one step of a solve that sees vertices:
 *
 *   v_p = sum_h w_hp (T_h0 + sum_s sum_j T_h(1 + 3 s + j) p_sj)
 *
 * with p_s the position of vertex p in exemplar s. */
#ifndef EXM_SUBSPACE_SKINNING_H
#define EXM_SUBSPACE_SKINNING_H

#include "base/status.h"

/** One thread at a time. */
typedef struct skinning skinning;

/**
 * Lay weights and exemplars out for skinning_apply.
 *
 * weights    [H][V] finite; zeros cost nothing; where a vertex's sum to 1 but for rounding they are scaled to do so
 * exemplars  [S][V][3] finite
 * out        NULL on failure; release with skinning_destroy
 *
 * Memory: 24 S V bytes, and about 8 for each weight that is not zero. Errors: EXM_ERROR_OUT_OF_MEMORY.
 */
exm_status skinning_create(size_t vertex_count, size_t handle_count, size_t exemplar_count, const float *weights,
                           const float *exemplars, skinning **out);

/**
 * coefficients  [H][1 + 3 S][3]
 * thread_count  0: chosen
 * positions     [V][3] out
 *
 * In single precision, about the centres of blocks of neighbours, where that is good for 1e-6 of the exemplars' size;
 * blocks in which coefficients are too large for that are done in double precision. The result does not depend on the
 * number of threads or the kind of processor.
 */
void skinning_apply(const skinning *skin, const double *coefficients, int thread_count, float *positions);

/** The same in double precision throughout. */
void skinning_apply_f64(const skinning *skin, const double *coefficients, double *positions);

void skinning_destroy(skinning *skin);

#endif
