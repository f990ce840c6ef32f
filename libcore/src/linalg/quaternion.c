/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/quaternion.h"

#include <math.h>
#include <string.h>

void quaternion_from_rotation(const double r[9], double q[4])
{
  /* The largest of the four is found first, and the others from products with it: no cancellation. */
  double const squares[4] = {1 + r[0] + r[4] + r[8], 1 + r[0] - r[4] - r[8], 1 - r[0] + r[4] - r[8],
                             1 - r[0] - r[4] + r[8]};
  int largest = 0;
  for (int i = 1; i < 4; i++) {
    largest = squares[i] > squares[largest] ? i : largest;
  }
  double const twice = sqrt(squares[largest]);
  double const products[4][4] = {{0, r[7] - r[5], r[2] - r[6], r[3] - r[1]},
                                 {r[7] - r[5], 0, r[1] + r[3], r[2] + r[6]},
                                 {r[2] - r[6], r[1] + r[3], 0, r[5] + r[7]},
                                 {r[3] - r[1], r[2] + r[6], r[5] + r[7], 0}};
  double length2 = 0;
  for (int i = 0; i < 4; i++) {
    q[i] = i == largest ? twice / 2 : products[largest][i] / (2 * twice);
    length2 += q[i] * q[i];
  }
  for (int i = 0; i < 4; i++) {
    q[i] /= sqrt(length2);
  }
}

void quaternion_to_rotation(const double q[4], double r[9])
{
  double const w = q[0], x = q[1], y = q[2], z = q[3];
  double const rotation[9] = {
      w * w + x * x - y * y - z * z, 2 * (x * y - w * z),           2 * (x * z + w * y),
      2 * (x * y + w * z),           w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
      2 * (x * z - w * y),           2 * (y * z + w * x),           w * w - x * x - y * y + z * z};
  memcpy(r, rotation, sizeof rotation);
}

void quaternion_multiply(const double a[4], const double b[4], double out[4])
{
  double const product[4] = {
      a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
      a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
  memcpy(out, product, sizeof product);
}

void quaternion_turn(const double a[4], const double b[4], double out[3])
{
  double const inverse[4] = {a[0], -a[1], -a[2], -a[3]};
  double relative[4];
  quaternion_multiply(inverse, b, relative);
  double const sign = relative[0] < 0 ? -1 : 1;
  double const sine = sqrt(relative[1] * relative[1] + relative[2] * relative[2] + relative[3] * relative[3]);
  double const factor = sine > 1e-300 ? sign * 2 * atan2(sine, sign * relative[0]) / sine : 0;
  for (int k = 0; k < 3; k++) {
    out[k] = factor * relative[k + 1];
  }
}

void quaternion_turned(const double a[4], const double turn[3], double out[4])
{
  double const angle = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  double const factor = angle > 1e-8 ? sin(angle / 2) / angle : 0.5;
  double const step[4] = {cos(angle / 2), factor * turn[0], factor * turn[1], factor * turn[2]};
  quaternion_multiply(a, step, out);
}

static void between(const double a[4], const double b[4], double u, double out[4])
{
  double turn[3];
  quaternion_turn(a, b, turn);
  for (int k = 0; k < 3; k++) {
    turn[k] *= u;
  }
  quaternion_turned(a, turn, out);
}

void quaternion_curve(const double a[4], const double va[3], const double vb[3], const double b[4], double u,
                      double out[4])
{
  double const leaving[3] = {va[0] / 3, va[1] / 3, va[2] / 3}, arriving[3] = {-vb[0] / 3, -vb[1] / 3, -vb[2] / 3};
  double p[4][4];
  memcpy(p[0], a, sizeof p[0]);
  quaternion_turned(a, leaving, p[1]);
  quaternion_turned(b, arriving, p[2]);
  memcpy(p[3], b, sizeof p[3]);
  for (int left = 3; left > 0; left--) {
    for (int i = 0; i < left; i++) {
      between(p[i], p[i + 1], u, p[i]);
    }
  }
  memcpy(out, p[0], sizeof p[0]);
}
