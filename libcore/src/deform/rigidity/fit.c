/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/fit.h"

#include <string.h>

#include "linalg/rotation.h"

enum { BATCH = 64 };

void fit_rotations(const row12 *sums, size_t begin, size_t end, row12 *rotations, double *gains)
{
  double packed[9 * BATCH];
  double row[12], turned[12] = {0};
  for (size_t first = begin; first < end; first += BATCH) {
    size_t const some = end - first < BATCH ? end - first : BATCH;
    for (size_t i = 0; i < some; i++) {
      memcpy(row, &sums[first + i], sizeof row);
      for (size_t e = 0; e < 9; e++) {
        packed[9 * i + e] = row[e / 3 * 4 + e % 3];
      }
    }
    rotation_fit3(some, packed, packed);
    for (size_t i = 0; i < some; i++) {
      memcpy(row, &sums[first + i], sizeof row);
      double gain = 0;
      for (size_t e = 0; e < 9; e++) {
        gain += packed[9 * i + e] * row[e / 3 * 4 + e % 3];
        turned[e % 3 * 4 + e / 3] = packed[9 * i + e];
      }
      memcpy(&rotations[first + i], turned, sizeof turned);
      gains[first + i] = gain;
    }
  }
}
