/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Linear functionals of positions: coefficients for vertices. */
#ifndef EXM_MESH_ROWS_H
#define EXM_MESH_ROWS_H

#include "mesh/mesh.h"

/** See exm_mesh_disc and exm_mesh_differential. Up to `capacity` terms are written; *count says how many there are. */
exm_status mesh_disc_row(const mesh *m, uint32_t vertex, double radius, size_t capacity, uint32_t *vertices,
                         double *coefficients, size_t *count);
exm_status mesh_differential_row(const mesh *m, uint32_t vertex, size_t capacity, uint32_t *vertices,
                                 double *coefficients, size_t *count);

#endif
