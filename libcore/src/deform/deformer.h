/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What every kind of deformer shares: a mesh bound to handles, posed by skinning with affine coefficients. */
#ifndef EXM_DEFORM_DEFORMER_H
#define EXM_DEFORM_DEFORMER_H

#include "base/progress.h"
#include "deform/amrap.h"
#include "subspace/constraints.h"
#include "subspace/dictionary.h"
#include "subspace/skinning.h"
#include "subspace/space.h"

struct exm_deformer {
  arena memory;
  exm_deformer_info info;
  space coordinates;
  dictionary atoms;
  constraints held;
  int32_t *handle_kinds; /* [H] */
  float *weights;        /* [H][V] */
  uint32_t *groups;      /* [V] */
  skinning *skin;
  amrap solver;
  /* Planar meshes: heights of handles over the plane. Free handles follow the others, out of [H][H]. */
  double *height_map, *heights, *pinned_heights;
  /* The result, as skinning applies it, [H][1 + 3 S][3]. */
  double *affine;
  double *coefficients, *scratch;
  double *targets;  /* c of the last solve */
  float *reference; /* [V][3] what is shown before the first */
  int has_result;
};

typedef struct deformer_request {
  const mesh *reference;
  const float *exemplars;
  size_t exemplar_count;
  const exm_handles *handles;
  exm_amrap_bind_settings settings;
  progress report;
} deformer_request;

exm_status deformer_bind(const deformer_request *request, exm_deformer **out);
exm_status deformer_solve(exm_deformer *deformer, const double *targets, const amrap_options *options,
                          exm_solve_report *report);
void deformer_handle_pose(const exm_deformer *deformer, size_t exemplar, double *targets);
/** Positions of exemplar s's own ARAP solution, [V][3]. */
exm_status deformer_exemplar_positions(const exm_deformer *deformer, size_t exemplar, double *positions);
/** D in the caller's units, [G][S]; rotations as maps of the caller's space, [G][S][3][3]. */
void deformer_exemplar_energies(const exm_deformer *deformer, double *energies);
void deformer_rotations(const exm_deformer *deformer, double *rotations);
void deformer_destroy(exm_deformer *deformer);

#endif
