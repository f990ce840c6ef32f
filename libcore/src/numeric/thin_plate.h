/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Thin-plate splines from the plane to R^m [SEQ, 2.2 and 3.2]:
 *
 *   g(p) = g_0 + sum_j phi(|s_j - p|) g_j + G p,   phi(r) = r^2 log r,   sum_j g_j = 0,   sum_j g_j s_j' = 0.
 *
 * The side conditions make the splines of l sites a space of l dimensions, in which the bending energy is finite and
 * the result does not depend on the unit of the plane; points are scaled for the sake of rounding only. */
#ifndef EXM_NUMERIC_THIN_PLATE_H
#define EXM_NUMERIC_THIN_PLATE_H

#include <stdint.h>

#include "base/memory.h"
#include "base/progress.h"

typedef struct thin_plate {
  size_t site_count, value_count;
  double centre[2], scale; /* points are (p - centre) * scale inside */
  double (*sites)[2];      /* [l] scaled */
  double *coefficients;    /* [l + 3][m]: of the sites, then of 1 and the two scaled coordinates */
} thin_plate;

/** values [m] at a point. */
void thin_plate_evaluate(const thin_plate *plate, const double point[2], double *values);

/** The derivative [m] at a point in a direction. */
void thin_plate_derivative(const thin_plate *plate, const double point[2], const double direction[2],
                           double *derivative);

/** The second derivative along a unit direction, and along the one across it, [m] each. Unbounded (like log r) at a
 *  site, where that of a point close by is given. */
void thin_plate_curvature(const thin_plate *plate, const double point[2], const double direction[2], double *along,
                          double *across);

typedef struct thin_plate_request {
  size_t point_count, value_count;
  const double (*points)[2]; /* [n] */
  const double *values;      /* [n][m] */
  const double *weights;     /* [n] positive, of the residuals; NULL: 1 */
  size_t site_count;         /* l, at most n; 0: as few as leave no more than `limit` */
  double limit;              /* of the sum of squared residuals */
  uint32_t *order;           /* [n] out: the points that were chosen for sites, first come first */
} thin_plate_request;

/**
 * Choose sites among the points, greedily, and fit the spline to all points by least squares [SEQ, 3.2.2]. The order of
 * the sites does not depend on how many are taken. A site at the place of another, or one whose function the others
 * already have, is passed over and not counted.
 *
 * residual  out: sum of squares that is left; may be NULL
 *
 * The values' first two columns are taken for the best-fit plane of the values, as principal components are.
 */
exm_status thin_plate_fit(arena *owner, const thin_plate_request *request, const progress *report, thin_plate *plate,
                          double *residual);

/** phi of a squared distance: r^2 log r = 1/2 r^2 log r^2. */
double thin_plate_basis(double squared);

#endif
