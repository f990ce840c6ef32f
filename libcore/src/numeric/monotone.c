/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/monotone.h"

#include <math.h>

/** The slope before it is limited: the mean of the steps around, or the only one at an end. */
static double average(double before, double after)
{
  if (before < 0) {
    return after < 0 ? 0 : after;
  }
  return after < 0 ? before : (before + after) / 2;
}

/** What a slope must be multiplied by for the interval to be monotone: into the circle of radius 3 step. */
static double limit(double step, double slope_begin, double slope_end)
{
  if (step <= 0) {
    return step < 0 ? 1 : 0;
  }
  double const length = hypot(slope_begin, slope_end) / step;
  return length > 3 ? 3 / length : 1;
}

double monotone_slope(const double steps[4])
{
  double const before = average(steps[0], steps[1]), here = average(steps[1], steps[2]);
  double const after = average(steps[2], steps[3]);
  return here * fmin(limit(steps[1], before, here), limit(steps[2], here, after));
}

double monotone_value(double step, double slope_begin, double slope_end, double x, double *derivative)
{
  double const y = 1 - x;
  *derivative = 6 * x * y * step + y * (1 - 3 * x) * slope_begin + x * (3 * x - 2) * slope_end;
  return x * x * (3 - 2 * x) * step + x * y * y * slope_begin - x * x * y * slope_end;
}
