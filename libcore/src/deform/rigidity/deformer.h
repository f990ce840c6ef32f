/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A mesh bound by Rigidity. Three things can change by themselves after a bind: neighbourhoods, handles, and the system
 * that follows from both; each has an arena of its own, is made anew and put in the old one's place. */
#ifndef EXM_DEFORM_RIGIDITY_DEFORMER_H
#define EXM_DEFORM_RIGIDITY_DEFORMER_H

#include "base/progress.h"
#include "deform/deformer.h"
#include "deform/rigidity/coarse.h"
#include "deform/rigidity/solver.h"

typedef struct rigidity_reach {
  arena memory;
  int32_t *radii; /* [V] */
  double *counts; /* [V] in how many neighbourhoods each vertex is */
  set_sums balls;
} rigidity_reach;

typedef struct rigidity_deformer {
  exm_deformer base;
  mesh reference; /* what a mesh holds that is needed later on; in base.memory */
  spokes edges;
  sparse pattern;
  double disc_radius;
  rigidity_reach reach;
  held handles;
  rigidity_system system;
  coarse_level *coarse; /* NULL: none, or not yet */
  int has_coarse;       /* whether it has been looked for */
  int is_coarse_there;  /* its levels are solved for the targets of the last result, too */
  rigidity_solver solver;
} rigidity_deformer;

typedef struct rigidity_request {
  const mesh *reference;
  const exm_handles *handles;
  const int32_t *radii; /* NULL: `radius` */
  int32_t radius;
  double disc_size; /* share of the diagonal */
  progress report;
} rigidity_request;

/** From arguments that were checked, but for handles. */
exm_status rigidity_deformer_bind(const rigidity_request *request, exm_deformer **out);
exm_status rigidity_deformer_set_radii(rigidity_deformer *deformer, const int32_t *radii, int32_t radius,
                                       const progress *report);
exm_status rigidity_deformer_set_handles(rigidity_deformer *deformer, const exm_handles *handles,
                                         const progress *report);

typedef struct rigidity_start {
  exm_start kind;
  const float *positions;
  int coarse; /* 0: never, 1: always, -1: for meshes that are large enough */
} rigidity_start;

/** Levels of regions for stateless starts, where they are not there yet. */
exm_status rigidity_deformer_coarsen(rigidity_deformer *deformer);
/** Whether a mesh is large enough to have them ready at the first solve. */
int rigidity_deformer_is_large(const rigidity_deformer *deformer);

exm_status rigidity_deformer_solve(rigidity_deformer *deformer, const double *targets, const rigidity_start *start,
                                   const rigidity_options *options, exm_solve_report *report);

void rigidity_deformer_rotations(const rigidity_deformer *deformer, double *rotations);
exm_status rigidity_deformer_energies(const rigidity_deformer *deformer, double *energies);

/** What a bind fills in. */
extern const deformer_methods rigidity_methods;

#endif
