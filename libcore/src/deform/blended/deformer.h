/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A mesh bound by Blended: posed by skinning with the affine coefficients that the reduced solver finds. */
#ifndef EXM_DEFORM_BLENDED_DEFORMER_H
#define EXM_DEFORM_BLENDED_DEFORMER_H

#include "base/progress.h"
#include "deform/blended/blended.h"
#include "deform/deformer.h"
#include "subspace/skinning.h"
#include "subspace/space.h"

typedef struct blended_deformer {
  exm_deformer base;
  space coordinates;
  dictionary
      atoms; /* joint: functions of the last stage first, then those of the first stage that are not among them */
  edge_energy energy;
  uint32_t *clusters;     /* [V] */
  float *functions;       /* [functions][V] */
  size_t skin_count;      /* functions of the last stage, which skinning applies */
  constraints held;       /* of the handles */
  double *poses;          /* [S][H][3][4] the handles in the exemplars */
  double *handle_weights; /* [H] */
  skinning *skin;
  blended solver;
  exm_blended_info info;
  exm_blended_outcome outcome;
  /* The result, as skinning applies it, [functions][1 + 3 S][3], and the coefficients it came from. */
  double *affine;
  double *placed;  /* [joint atoms][d] coefficients turned, scaled and moved out of the frame */
  double *heights; /* [functions] off the plane of a two-dimensional space */
  double *scratch;
  double *centres; /* [H][joint atoms] the handles' centres as rows */
  double *images;  /* [handles' rows][d] scratch */
} blended_deformer;

typedef struct blended_request {
  const mesh *reference;
  const float *exemplars;
  size_t exemplar_count;
  const exm_handles *handles;
  exm_blended_bind_settings settings;
  progress report;
} blended_request;

/** From arguments that were checked, but for handles. May return a warning, with a deformer. */
exm_status blended_deformer_bind(const blended_request *request, exm_deformer **out);

/** row_targets [rows][3] of the rows that were added. */
exm_status blended_deformer_solve(blended_deformer *deformer, const double *targets, const double *row_targets,
                                  const blended_options *options, exm_solve_report *report);

exm_status blended_deformer_add_rows(blended_deformer *deformer, const exm_rows *rows);
exm_status blended_deformer_weigh_rows(blended_deformer *deformer, size_t first, size_t count, const double *weights);
/** weights [H], or NULL for all 1. */
exm_status blended_deformer_weigh_handles(blended_deformer *deformer, const double *weights);

/** The last result's handles as targets, [H][3][4]. */
void blended_deformer_result_pose(const blended_deformer *deformer, double *targets);

/** Take the solver's coefficients out of its frame and make them the result. mean_height: of the targets. */
void blended_deformer_place(blended_deformer *deformer, double mean_height);

extern const deformer_methods blended_methods;

#endif
