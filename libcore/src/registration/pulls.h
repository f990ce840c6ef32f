/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What draws a pose during ICP, and the pose that follows: the global step of [Blended, eq. 18] with constraints that
 * hold along normals more than across them, so that correspondences may slide. */
#ifndef EXM_REGISTRATION_PULLS_H
#define EXM_REGISTRATION_PULLS_H

#include "registration/registration.h"

/** One constraint: w ((1 - slip) (n . (x u - y))^2 + slip |x u - y|^2) / 2. All in the frame. */
typedef struct pull {
  double target[3], normal[3];
  double weight, slip; /* slip 1: a point, whatever the normal */
} pull;

typedef struct pulls {
  const blended_basis *basis;
  size_t count, capacity;
  pull *list;       /* [capacity] */
  double *rows;     /* [capacity][rank] */
  double *base;     /* [rank][rank] everything that does not change: rigidity, smoothness, a floor */
  double *factor;   /* [rank][rank] of the preconditioner */
  double *weighted; /* [capacity][rank] scratch */
  double *images;   /* [capacity][3] scratch */
  double *right, *residual, *direction, *applied, *precondition; /* [rank][3] */
  double *column;                                                /* [rank] */
} pulls;

exm_status pulls_create(arena *owner, const registration *r, size_t capacity, pulls *out);

/** Factor what the list adds up to: once for a list. */
exm_status pulls_factor(pulls *p);

/** Minimise over u [rank][3], from u: `elastic` [rank][3] is alpha K'R. */
void pulls_solve(pulls *p, const double *elastic, double *u);

#endif
