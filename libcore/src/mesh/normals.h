/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_MESH_NORMALS_H
#define EXM_MESH_NORMALS_H

#include <stddef.h>
#include <stdint.h>

/** (b - a) x (c - a): twice the area, along the outward normal of a triangle that is counter-clockwise from outside. */
void triangle_normal(const double a[3], const double b[3], const double c[3], double out[3]);

/** Normals of vertices, [V] of length 1: those of the triangles around, by area; 0 where there is none. */
void mesh_vertex_normals(const double (*positions)[3], size_t vertex_count, const uint32_t (*triangles)[3],
                         size_t triangle_count, double (*normals)[3]);

#endif
