/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_MESH_AREAS_H
#define EXM_MESH_AREAS_H

#include "mesh/mesh.h"

/** Voronoi areas of the vertices, [V], mixed as by Meyer, Desbrun, Schroeder and Barr, "Discrete differential-geometry
 *  operators for triangulated 2-manifolds", 2003: an obtuse triangle gives half of its area to its obtuse corner. They
 * add up to the area of the mesh. 0 for loose vertices. */
void mesh_voronoi_areas(const mesh *m, double *areas);

#endif
