/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The target of a registration: points with normals, boundaries, areas, discs and an index. */
#ifndef EXM_REGISTRATION_SCAN_H
#define EXM_REGISTRATION_SCAN_H

#include "base/memory.h"
#include "base/status.h"
#include "mesh/geodesics.h"
#include "numeric/nearest.h"

enum { SCAN_POINTS_LEAST = 4, SCAN_NEIGHBORS = 12, SCAN_NEIGHBORS_MOST = 256 };

typedef struct exm_scan {
  size_t point_count, triangle_count;
  double (*points)[3];      /* [P] */
  double (*normals)[3];     /* [P] of length 1, or 0 where unknown */
  uint32_t (*triangles)[3]; /* [F] */
  uint8_t *boundary;        /* [P] */
  double *areas;            /* [P] what each point stands for */
  nearest tree;
  geodesics *ways; /* its scratch makes a scan one thread's at a time */
  exm_scan_report report;
  arena memory; /* holds the struct itself, too */
} scan;

/** See exm_scan_create. points [P][3]; settings were read, but not checked. */
exm_status scan_create(const float *points, size_t point_count, const exm_scan_settings *settings, scan **out);

/** See exm_scan_read. */
exm_status scan_read(const char *path, scan **out);

void scan_destroy(scan *s);

#endif
