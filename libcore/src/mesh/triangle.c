/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/triangle.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** Where on the edge from a to b p is nearest, 0 at a; and the squared distance. */
static double on_edge(const double a[3], const double b[3], const double p[3], double *squared)
{
  double const u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
  double const length = dot(u, u), along = length > 0 ? fmin(fmax(dot(u, v) / length, 0), 1) : 0;
  double const rest[3] = {v[0] - along * u[0], v[1] - along * u[1], v[2] - along * u[2]};
  *squared = dot(rest, rest);
  return along;
}

double triangle_nearest(const double a[3], const double b[3], const double c[3], const double p[3], double weights[3])
{
  double const u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  double const w[3] = {p[0] - a[0], p[1] - a[1], p[2] - a[2]};
  double const uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w);
  double const area = uu * vv - uv * uv; /* squared, four times */
  double const beta = vv * uw - uv * vw, gamma = uu * vw - uv * uw;
  if (area > 1e-14 * uu * vv && beta >= 0 && gamma >= 0 && beta + gamma <= area) {
    weights[1] = beta / area;
    weights[2] = gamma / area;
    weights[0] = 1 - weights[1] - weights[2];
    double rest[3];
    for (int k = 0; k < 3; k++) {
      rest[k] = w[k] - weights[1] * u[k] - weights[2] * v[k];
    }
    return dot(rest, rest);
  }
  /* Outside: the nearest place is on one of the edges. */
  const double *const corners[3] = {a, b, c};
  double best = INFINITY;
  for (int e = 0; e < 3; e++) {
    double squared;
    double const along = on_edge(corners[e], corners[(e + 1) % 3], p, &squared);
    if (squared < best) {
      best = squared;
      weights[e] = 1 - along;
      weights[(e + 1) % 3] = along;
      weights[(e + 2) % 3] = 0;
    }
  }
  return best;
}
