/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Anderson mixing of a fixed-point iteration x <- g(x) [Walker and Ni, "Anderson acceleration for fixed-point
 * iterations", SIAM J. Numer. Anal. 2011, type II]: the next x is the affine combination of the last few g whose
 * residuals g - x cancel best in least squares. It keeps what the map keeps affinely, and commutes with rotations of
 * the columns of x, so an equivariant iteration stays so. It promises no descent: callers that need it check, and go
 * back to g. */
#ifndef EXM_NUMERIC_ANDERSON_H
#define EXM_NUMERIC_ANDERSON_H

#include "base/memory.h"
#include "base/status.h"

typedef struct anderson {
  size_t size, depth;
  size_t count, next; /* differences held, and where the next one goes */
  int has_last;
  double *residual_steps, *image_steps; /* [depth][size] */
  double *last_residual, *last_image;   /* [size] */
  double *gram, *coefficients;          /* [depth][depth], [depth] */
} anderson;

exm_status anderson_create(arena *owner, size_t size, size_t depth, anderson *out);

/** Forget the past: before a new iteration, or after a step back. */
void anderson_reset(anderson *a);

/** x [size] in: where g was evaluated; out: where to evaluate it next. image [size]: g(x). */
void anderson_mix(anderson *a, const double *image, double *x);

#endif
