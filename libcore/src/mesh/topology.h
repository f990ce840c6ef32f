/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_MESH_TOPOLOGY_H
#define EXM_MESH_TOPOLOGY_H

#include "mesh/mesh.h"

/** Fill in what follows from m->triangles alone: rings, components, non-manifold edges, loose vertices and their counts
 *  in m->report. Indices are in range and the corners of a triangle differ. */
exm_status topology_find(mesh *m);

#endif
