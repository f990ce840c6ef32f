/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_DEFORM_BLENDED_INTERPOLATE_H
#define EXM_DEFORM_BLENDED_INTERPOLATE_H

#include "deform/blended/blended.h"

/** The solution as a key: that many doubles. */
size_t blended_key_size(const blended *b);
void blended_get_key(const blended *b, double *key);

/** Could this have been written by blended_get_key? */
int blended_key_is_valid(const blended *b, const double *key);

/** The pose between keys [count][size] at rising times: frame and coefficients of the solver. count 1 or more. */
exm_status blended_interpolate(blended *b, const double *keys, const double *times, size_t count, double time);

#endif
