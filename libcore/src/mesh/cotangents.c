/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cotangent weights that stay finite and positive semidefinite on any triangle.
 *
 * With e_i the edge opposite corner i, taken around the triangle (e_0 + e_1 + e_2 = 0), and A its area, half the
 * cotangent at corner i is w_i = -(e_j . e_k) / (4 A), and for any function x on the corners
 *
 *   sum_i w_i (x_j - x_k)^2  =  |x_0 e_0 + x_1 e_1 + x_2 e_2|^2 / (4 A),
 *
 * a Gram form over an area. It is a square whatever stands in the denominator: so it is the area that is floored, for
 * the three weights of a triangle alike. Clamping single cotangents, as is often done, gives up either the sign or the
 * sum.
 */
#include "mesh/cotangents.h"

#include <float.h>
#include <math.h>

/* A triangle counts for no flatter than one of this share of its longest edge squared (height 2e-5 of that edge; the
 * equilateral one has 0.43). It bounds the weights by 1 / (4 x 1e-5) = 25000. Bounded biharmonic weights square them:
 * 6e8, which leaves half of the digits of double precision. No modelled triangle is met by it; those that are have most
 * of their height from rounding, single precision resolving 1e-7 at best. */
static double const SMALLEST_AREA = 1e-5;

/* Half the cotangent of 60 degrees: three coinciding corners have no shape, so no corner is preferred. */
static double const EQUILATERAL = 0.28867513459481287;

static void subtract(const double a[3], const double b[3], double out[3])
{
  for (int k = 0; k < 3; ++k) {
    out[k] = a[k] - b[k];
  }
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double cross_length(const double a[3], const double b[3])
{
  double const x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  return sqrt(x * x + y * y + z * z);
}

static double largest_coordinate(const double a[3], const double b[3], const double c[3])
{
  double largest = 0;
  for (int k = 0; k < 3; ++k) {
    largest = fmax(largest, fmax(fabs(a[k]), fmax(fabs(b[k]), fabs(c[k]))));
  }
  return largest;
}

triangle_measure triangle_measure_of(const double a[3], const double b[3], const double c[3])
{
  double edges[3][3];
  subtract(c, b, edges[0]);
  subtract(a, c, edges[1]);
  subtract(b, a, edges[2]);
  double const longest = fmax(dot(edges[0], edges[0]), fmax(dot(edges[1], edges[1]), dot(edges[2], edges[2])));
  double const area = cross_length(edges[1], edges[2]) / 2;
  /* Rounding moves each corner by up to eps / 2 of its coordinates, and the height over the longest edge with it. */
  double const rounding = sqrt(longest) * FLT_EPSILON * largest_coordinate(a, b, c);

  triangle_measure measure = {.area = fmax(area, SMALLEST_AREA * longest), .degenerate = area <= rounding};
  for (int i = 0; i < 3; ++i) {
    measure.cotangents[i] =
        longest > 0 ? -dot(edges[(i + 1) % 3], edges[(i + 2) % 3]) / (4 * measure.area) : EQUILATERAL;
  }
  return measure;
}
