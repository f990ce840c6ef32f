/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Assignments of points to vertices whose distances are plausible, by branch and bound.
 *
 * The cost of an assignment is the sum over its pairs of how far, squared, their distance is from those that the pair
 * has in the exemplars. It only grows as pairs are added, so a beginning that costs as much as the worst of the
 * assignments that are kept is given up with all that begin like it. */
#ifndef EXM_REGISTRATION_ASSIGNMENTS_H
#define EXM_REGISTRATION_ASSIGNMENTS_H

#include <stdint.h>

#include "base/memory.h"
#include "base/status.h"

typedef struct assignments {
  size_t size;           /* landmarks */
  const double *low;     /* [size][size] least distance of two vertices over the exemplars */
  const double *high;    /* [size][size] and the greatest */
  const double *between; /* [size][size] of two points, in the exemplars' scale */
  const int32_t *groups; /* [size] labels >= 0 may change places */
  size_t capacity;       /* how many are wanted */
  size_t count;          /* found: the cheapest, in rising order */
  uint32_t *orders;      /* [capacity][size] */
  double *costs;         /* [capacity] */
  double permissible;    /* how many there are */
} assignments;

exm_status assignments_find(arena *owner, assignments *a);

#endif
