/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/thin_plate.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Squared distance, in the scaled plane, below which a second derivative is that of this distance. */
static double const CLOSE = 1e-12;

double thin_plate_basis(double squared)
{
  return squared > 0 ? 0.5 * squared * log(squared) : 0;
}

static void to_inside(const thin_plate *plate, const double point[2], double inside[2])
{
  inside[0] = (point[0] - plate->centre[0]) * plate->scale;
  inside[1] = (point[1] - plate->centre[1]) * plate->scale;
}

void thin_plate_evaluate(const thin_plate *plate, const double point[2], double *values)
{
  size_t const m = plate->value_count, l = plate->site_count;
  const double *polynomial = plate->coefficients + l * m;
  double p[2];
  to_inside(plate, point, p);
  for (size_t k = 0; k < m; k++) {
    values[k] = polynomial[k] + p[0] * polynomial[m + k] + p[1] * polynomial[2 * m + k];
  }
  for (size_t j = 0; j < l; j++) {
    double const dx = p[0] - plate->sites[j][0], dy = p[1] - plate->sites[j][1];
    dense_axpy(m, thin_plate_basis(dx * dx + dy * dy), plate->coefficients + j * m, values);
  }
}

void thin_plate_derivative(const thin_plate *plate, const double point[2], const double direction[2],
                           double *derivative)
{
  size_t const m = plate->value_count, l = plate->site_count;
  const double *polynomial = plate->coefficients + l * m;
  double const u = direction[0] * plate->scale, v = direction[1] * plate->scale;
  double p[2];
  to_inside(plate, point, p);
  for (size_t k = 0; k < m; k++) {
    derivative[k] = u * polynomial[m + k] + v * polynomial[2 * m + k];
  }
  for (size_t j = 0; j < l; j++) {
    double const dx = p[0] - plate->sites[j][0], dy = p[1] - plate->sites[j][1], squared = dx * dx + dy * dy;
    /* grad phi = (log r^2 + 1) (p - s) */
    double const slope = squared > 0 ? (log(squared) + 1) * (dx * u + dy * v) : 0;
    dense_axpy(m, slope, plate->coefficients + j * m, derivative);
  }
}

void thin_plate_curvature(const thin_plate *plate, const double point[2], const double direction[2], double *along,
                          double *across)
{
  size_t const m = plate->value_count;
  double const factor = plate->scale * plate->scale;
  double p[2];
  to_inside(plate, point, p);
  memset(along, 0, m * sizeof(double));
  memset(across, 0, m * sizeof(double));
  for (size_t j = 0; j < plate->site_count; j++) {
    double const dx = p[0] - plate->sites[j][0], dy = p[1] - plate->sites[j][1];
    double const squared = fmax(dx * dx + dy * dy, CLOSE);
    /* The Hessian of phi is (log r^2 + 1) I + 2 (p - s)(p - s)' / r^2. */
    double const u = dx * direction[0] + dy * direction[1], v = dy * direction[0] - dx * direction[1];
    double const even = log(squared) + 1;
    dense_axpy(m, factor * (even + 2 * u * u / squared), plate->coefficients + j * m, along);
    dense_axpy(m, factor * (even + 2 * v * v / squared), plate->coefficients + j * m, across);
  }
}
