/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/spatial_order.h"

#include <math.h>

static size_t widest_side(const float *points, const uint32_t *order, size_t begin, size_t end)
{
  size_t widest = 0;
  float width = -1;
  for (size_t k = 0; k < 3; k++) {
    float low = INFINITY, high = -INFINITY;
    for (size_t i = begin; i < end; i++) {
      float const x = points[3 * (size_t)order[i] + k];
      low = fminf(low, x);
      high = fmaxf(high, x);
    }
    if (high - low > width) {
      width = high - low;
      widest = k;
    }
  }
  return widest;
}

/** Coordinates first; equal ones by number, so that the order is total. */
static int is_before(const float *points, size_t k, uint32_t a, uint32_t b)
{
  float const x = points[3 * (size_t)a + k], y = points[3 * (size_t)b + k];
  return x < y || (x == y && a < b);
}

/** Quickselect: what comes first along side k goes before `middle`. */
static void halve(const float *points, size_t k, uint32_t *order, size_t begin, size_t end, size_t middle)
{
  while (end - begin > 1) {
    uint32_t const pivot = order[begin + (end - begin - 1) / 2]; /* never the last: both parts get something */
    size_t i = begin, j = end - 1;
    for (;;) {
      while (is_before(points, k, order[i], pivot)) {
        i++;
      }
      while (is_before(points, k, pivot, order[j])) {
        j--;
      }
      if (i >= j) {
        break;
      }
      uint32_t const swap = order[i];
      order[i++] = order[j];
      order[j--] = swap;
    }
    /* Everything before i is at most the pivot, everything after j at least. */
    size_t const split = j + 1;
    if (middle < split) {
      end = split;
    } else {
      begin = split;
    }
  }
}

static void sort(const float *points, size_t leaf, uint32_t *order, size_t begin, size_t end)
{
  while (leaf > 0 && end - begin > leaf) {
    size_t const half = ((end - begin) / 2 + leaf - 1) / leaf * leaf, middle = begin + half;
    halve(points, widest_side(points, order, begin, end), order, begin, end, middle);
    sort(points, leaf, order, begin, middle);
    begin = middle;
  }
}

void spatial_order(size_t count, const float *points, size_t leaf, uint32_t *order)
{
  for (size_t i = 0; i < count; i++) {
    order[i] = (uint32_t)i;
  }
  sort(points, leaf, order, 0, count);
}
