/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Arguments that functions of several nouns have in common. */
#ifndef EXM_API_CHECKS_H
#define EXM_API_CHECKS_H

#include "deform/deformer.h"

/** The deformer is there and of the kind that the calling function is for. */
exm_status check_kind(const exm_deformer *deformer, exm_deformer_kind kind);

/** `exemplar` is below the number that the deformer has. */
exm_status check_exemplar(const exm_deformer *deformer, size_t exemplar);

/** [S][V][3]: enough of them to count, and finite. */
exm_status check_exemplars(const float *exemplars, size_t exemplar_count, size_t vertex_count);
exm_status check_poses(const float *poses, size_t pose_count, size_t vertex_count);

/** The same under other names: of all of them, which is that of the argument, and of one. */
exm_status check_shapes(const float *shapes, size_t count, size_t vertex_count, const char *several, const char *one);

/** [H][3][4]: every number that a solve will look at is finite. */
exm_status check_targets(const exm_deformer *deformer, const double *targets);

/** Settings of a bind by Blended, which registrations take as well. */
exm_status check_blended_settings(const exm_blended_bind_settings *settings, size_t vertex_count,
                                  size_t exemplar_count);

/** A report for a solve to fill in: ours, with the caller's buffer for the history. `theirs` may be NULL. */
exm_status report_begin(exm_solve_report *ours, const exm_solve_report *theirs);

#endif
