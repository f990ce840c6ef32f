/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_MESH_TRIANGLE_H
#define EXM_MESH_TRIANGLE_H

/** The place on the triangle a, b, c that is nearest to p: weights [3] out, none negative, sum 1. Returns the squared
 *  distance. [Ericson, "Real-time collision detection", 2005, 5.1.5]. Degenerate triangles are edges or points. */
double triangle_nearest(const double a[3], const double b[3], const double c[3], const double p[3], double weights[3]);

#endif
