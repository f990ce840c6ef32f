/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A mesh bound by AMRAP: posed by skinning with the affine coefficients that the reduced solver finds. */
#ifndef EXM_DEFORM_AMRAP_DEFORMER_H
#define EXM_DEFORM_AMRAP_DEFORMER_H

#include "base/progress.h"
#include "deform/amrap/amrap.h"
#include "deform/deformer.h"
#include "subspace/constraints.h"
#include "subspace/dictionary.h"
#include "subspace/skinning.h"
#include "subspace/space.h"

typedef struct amrap_deformer {
  exm_deformer base;
  space coordinates;
  dictionary atoms;
  constraints held;
  uint32_t *groups;         /* [V] */
  skinning *skin;           /* NULL where coefficients are positions */
  exm_status weight_status; /* EXM_OK, or the warning that weights came with */
  amrap solver;
  /* Planar meshes: heights of handles over the plane. Free handles follow the others, out of [H][H]. */
  double *height_map, *heights, *pinned_heights;
  /* The result, as skinning applies it, [H][1 + 3 S][3]. */
  double *affine;
  double *coefficients, *scratch;
  double *targets; /* c of the last solve */
} amrap_deformer;

typedef struct amrap_request {
  const mesh *reference;
  const float *exemplars;
  size_t exemplar_count;
  const exm_handles *handles;
  exm_amrap_bind_settings settings;
  progress report;
} amrap_request;

/** From arguments that were checked, but for handles. */
exm_status amrap_deformer_bind(const amrap_request *request, exm_deformer **out);
exm_status amrap_deformer_solve(amrap_deformer *deformer, const double *targets, const amrap_options *options,
                                exm_solve_report *report);

/** What a bind fills in. */
extern const deformer_methods amrap_methods;

/** Positions of exemplar s's own ARAP solution, [V][3]. */
exm_status amrap_deformer_exemplar_positions(const amrap_deformer *deformer, size_t exemplar, double *positions);
/** D in the caller's units, [G][S]; rotations as maps of the caller's space, [G][S][3][3]. */
void amrap_deformer_exemplar_energies(const amrap_deformer *deformer, double *energies);
void amrap_deformer_rotations(const amrap_deformer *deformer, double *rotations);

#endif
