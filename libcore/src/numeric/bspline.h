/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cubic B-spline curves in the plane, open or closed. Knots are kept as the intervals between them, and a place on the
 * curve as a span and an offset into it: evaluation then reads what is near the place and nothing else, so that a
 * change somewhere else, or a stretch inserted before, does not change a bit here.
 *
 * An open curve of k control points has k + 2 knots u_0 .. u_{k+1} and is defined on [u_2, u_{k-1}]: the two outermost
 * knots of the usual k + 4 have no influence there. Its k - 3 spans lie between intervals 2 and k - 2 of k + 1. A
 * closed one has k spans and k intervals, and indices go round. Span s blends the control points s .. s + 3. */
#ifndef EXM_NUMERIC_BSPLINE_H
#define EXM_NUMERIC_BSPLINE_H

#include <stdint.h>

#include "base/memory.h"
#include "base/status.h"

typedef struct bspline {
  size_t control_count; /* k, 4 at least */
  int is_cyclic;
  double (*points)[2]; /* [k] */
  double *intervals;   /* [k + 1], cyclic [k]; not negative */
} bspline;

/** A place on a curve: 0 <= offset <= length of the span. */
typedef struct curve_place {
  size_t span;
  double offset;
} curve_place;

size_t bspline_span_count(size_t control_count, int is_cyclic);
size_t bspline_interval_count(size_t control_count, int is_cyclic);

/** Length of a span. */
double bspline_span(const bspline *curve, size_t span);

/** The place `advance` >= 0 further on. An open curve ends at its end; a closed one goes round. */
curve_place bspline_walk(const bspline *curve, curve_place from, double advance);

/** Numbers of the four control points that a span blends. */
void bspline_controls(const bspline *curve, size_t span, size_t controls[4]);

/** The four basis functions at a place, and their derivatives. */
void bspline_basis(const bspline *curve, curve_place place, double values[4], double derivatives[4]);

/** Point and derivative; either may be NULL. */
void bspline_evaluate(const bspline *curve, curve_place place, double point[2], double derivative[2]);

/**
 * Knots for n parameters [Piegl and Tiller, The NURBS Book, 9.4.1]: at equal steps of the parameters' index, so that
 * every span holds one parameter at least and the Schoenberg-Whitney conditions are met. Theirs divide n by the number
 * of spans; these divide n - 1, the number of steps there are, so that k = n + 2 puts a knot on every parameter, as
 * [SEQ, 3.3] wants it. Closed: k = n does. The outer knots coincide with the ends.
 *
 * control_count  at most n + 2, closed n
 * parameters     [n] rising, closed [n + 1] with the one that is the first again
 * intervals  out
 * places     [n] out: of the parameters
 */
void bspline_choose_knots(size_t control_count, int is_cyclic, size_t count, const double *parameters,
                          double *intervals, curve_place *places);

/**
 * Control points that fit the curve to points at places by least squares. With more control points than points (k = n +
 * 1 and n + 2), of the curves through them that without curvature at its ends.
 */
exm_status bspline_fit(bspline *curve, size_t count, const curve_place *places, const double (*points)[2]);

/** Insert a knot at a place without a change of the curve [Boehm]; `to` has room for one control point more. */
void bspline_insert_knot(const bspline *from, curve_place place, bspline *to);

#endif
