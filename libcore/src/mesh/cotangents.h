/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_MESH_COTANGENTS_H
#define EXM_MESH_COTANGENTS_H

#include <stdbool.h>

/** What a triangle counts for in every energy. */
typedef struct triangle_measure {
  double cotangents[3]; /* half the cotangent at each corner */
  double area;          /* floored as the cotangents are; 0 only where the three corners coincide */
  bool degenerate;      /* no area that could be told from the rounding of single precision coordinates */
} triangle_measure;

triangle_measure triangle_measure_of(const double a[3], const double b[3], const double c[3]);

#endif
