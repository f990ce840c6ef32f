/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What is usable, but probably not meant. Each returns EXM_OK or a warning with its sentence. */
#ifndef EXM_DEFORM_BLENDED_WARNINGS_H
#define EXM_DEFORM_BLENDED_WARNINGS_H

#include "deform/blended/deformer.h"

/** Exemplars that are each other's rigid copies, or turned inside out against the reference. */
exm_status blended_warn_exemplars(const blended_deformer *deformer, const mesh *reference);

/** Targets of rows that count, [rows][stride] in the space, that lie in one point or on a line. */
exm_status blended_warn_spread(const blended *b, const double *targets, size_t stride);

/** Rows that are multiples of each other, with targets that are not. */
exm_status blended_warn_contradiction(const blended *b);

#endif
