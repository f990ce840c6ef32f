/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_NUMERIC_SPATIAL_ORDER_H
#define EXM_NUMERIC_SPATIAL_ORDER_H

#include <stddef.h>
#include <stdint.h>

/**
 * Number points so that each run of `leaf` holds neighbours: halved across the widest side of their box, again and
 * again, at multiples of `leaf`. Not random: the same points are numbered alike everywhere.
 *
 * points  [count][3] finite
 * order   [count] out
 */
void spatial_order(size_t count, const float *points, size_t leaf, uint32_t *order);

#endif
