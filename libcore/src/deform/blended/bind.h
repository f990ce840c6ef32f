/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The parts of a bind: functions and clusters, and the atoms of each stage. */
#ifndef EXM_DEFORM_BLENDED_BIND_H
#define EXM_DEFORM_BLENDED_BIND_H

#include "deform/blended/deformer.h"

typedef struct blended_functions {
  size_t count;       /* of the joint dictionary */
  size_t last_count;  /* of them those of the last stage, which come first */
  size_t first_count; /* of the first stage: the constant, and the others at `first` */
  size_t *first;      /* [first_count] */
  double *forms;      /* [count][count] their Laplacian energies [Blended, eq. 6] */
} blended_functions;

/** The functions of both stages, into deformer->functions, and rotation clusters. aligned [S][V][3]. */
exm_status blended_find_functions(arena *owner, const blended_request *request, const float *aligned,
                                  const progress *report, blended_deformer *deformer, blended_functions *out);

/** A stage's atoms among those of the joint dictionary, reduced by k-medoids as the settings ask. */
exm_status blended_choose_atoms(arena *owner, const dictionary *d, const edge_energy *energy,
                                const blended_functions *functions, int stage,
                                const exm_blended_bind_settings *settings, exm_blended_info *info, size_t **atoms,
                                size_t *count);

#endif
