/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_MESH_RIM_H
#define EXM_MESH_RIM_H

#include "mesh/geodesics.h"

/** Vertices at the ends of edges that belong to one triangle alone, [V]: beyond them a surface may go on. `ways` of
 * that surface. */
exm_status mesh_rim(const geodesics *ways, uint8_t *is_rim);

#endif
