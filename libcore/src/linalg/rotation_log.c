/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/rotation_log.h"

#include <math.h>
#include <string.h>

/* Below this angle its sine is the angle, to rounding, and the axis is not known any more. */
static double const SMALLEST_ANGLE = 1e-12;

void rotation_exp(const double vector[3], double rotation[9])
{
  double const x = vector[0], y = vector[1], z = vector[2];
  double const squared = x * x + y * y + z * z, angle = sqrt(squared);
  /* sin(a) / a and (1 - cos(a)) / a^2, by their series where the quotients lose digits */
  double const s = angle > 1e-4 ? sin(angle) / angle : 1 - squared / 6;
  double const c = angle > 1e-4 ? (1 - cos(angle)) / squared : 0.5 - squared / 24;
  double const diagonal = 1 - c * squared;
  double const R[9] = {diagonal + c * x * x, c * x * y - s * z,    c * x * z + s * y,
                       c * x * y + s * z,    diagonal + c * y * y, c * y * z - s * x,
                       c * x * z - s * y,    c * y * z + s * x,    diagonal + c * z * z};
  memcpy(rotation, R, sizeof R);
}

/** Unit quaternion (w, x, y, z), w >= 0, by the largest of its components [Shepperd 1978]. */
static void quaternion_of(const double R[9], double q[4])
{
  double const trace = R[0] + R[4] + R[8];
  double const squares[4] = {1 + trace, 1 + 2 * R[0] - trace, 1 + 2 * R[4] - trace, 1 + 2 * R[8] - trace};
  int largest = 0;
  for (int i = 1; i < 4; i++) {
    largest = squares[i] > squares[largest] ? i : largest;
  }
  double const a = R[7] - R[5], b = R[2] - R[6], c = R[3] - R[1];
  double const d = R[3] + R[1], e = R[2] + R[6], f = R[7] + R[5];
  double const rows[4][4] = {
      {squares[0], a, b, c}, {a, squares[1], d, e}, {b, d, squares[2], f}, {c, e, f, squares[3]}};
  double length = 0;
  for (int i = 0; i < 4; i++) {
    length += rows[largest][i] * rows[largest][i];
  }
  length = sqrt(length) * (rows[largest][0] < 0 ? -1 : 1);
  for (int i = 0; i < 4; i++) {
    q[i] = rows[largest][i] / length;
  }
}

void rotation_log(const double rotation[9], const double like[3], double vector[3])
{
  double q[4], axis[3];
  quaternion_of(rotation, q);
  double const sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  double const angle = 2 * atan2(sine, q[0]), wanted = sqrt(like[0] * like[0] + like[1] * like[1] + like[2] * like[2]);
  for (int i = 0; i < 3; i++) {
    axis[i] = sine > SMALLEST_ANGLE ? q[i + 1] / sine : wanted > 0 ? like[i] / wanted : 0;
  }
  /* Closest to `like` on the line of the axis: the turns that bring the angle closest to like's part along it. */
  double const along = axis[0] * like[0] + axis[1] * like[1] + axis[2] * like[2];
  double const turned = angle + 2 * M_PI * rint((along - angle) / (2 * M_PI));
  for (int i = 0; i < 3; i++) {
    vector[i] = turned * axis[i];
  }
}
