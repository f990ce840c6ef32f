/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The monotone cubic interpolant of Fritsch and Carlson ("Monotone piecewise cubic interpolation", SIAM J. Numer. Anal.
 * 1980) at the integers, told by its steps: it never turns where the data do not. Theirs limits the slopes interval by
 * interval, one after the other; here the limit at a point is the stricter one of its two intervals, so that a slope
 * depends on four steps and no more, and an edit of the data stays local. */
#ifndef EXM_NUMERIC_MONOTONE_H
#define EXM_NUMERIC_MONOTONE_H

#include <stddef.h>

/** steps [4] around a point: from two before it to two after it, not negative. Negative ones are not there: the data
 * end. */
double monotone_slope(const double steps[4]);

/** Value above that at the beginning of an interval, and derivative, at 0 <= x <= 1 of it. */
double monotone_value(double step, double slope_begin, double slope_end, double x, double *derivative);

#endif
