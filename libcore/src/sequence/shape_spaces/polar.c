/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/shape_spaces/polar.h"

#include <stddef.h>

void matrix_times(const double a[9], const double b[9], double out[9])
{
  for (size_t i = 0; i < 3; i++) {
    for (size_t j = 0; j < 3; j++) {
      out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    }
  }
}

void matrix_transpose(const double a[9], double out[9])
{
  for (int i = 0; i < 9; i++) {
    out[i] = a[3 * (i % 3) + i / 3];
  }
}

void matrix_transposed_times(const double a[9], const double b[9], double out[9])
{
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      out[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
    }
  }
}

void polar_stretch(const double gradient[9], const double rotation[9], double stretch[6])
{
  double S[9];
  matrix_transposed_times(rotation, gradient, S);
  stretch[0] = S[0] - 1;
  stretch[1] = S[4] - 1;
  stretch[2] = S[8] - 1;
  stretch[3] = (S[1] + S[3]) / 2;
  stretch[4] = (S[2] + S[6]) / 2;
  stretch[5] = (S[5] + S[7]) / 2;
}

void polar_compose(const double rotation[9], const double stretch[6], double gradient[9])
{
  double const S[9] = {1 + stretch[0], stretch[3], stretch[4], stretch[3],    1 + stretch[1],
                       stretch[5],     stretch[4], stretch[5], 1 + stretch[2]};
  matrix_times(rotation, S, gradient);
}
