/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The mesh every other layer works on: plain arrays, validated once. Topology comes from OpenMesh through
 * mesh/openmesh_shim.h; energies are sums over triangles and need no manifold. */
#ifndef EXM_MESH_MESH_H
#define EXM_MESH_MESH_H

#include "base/memory.h"
#include "base/status.h"

typedef struct exm_mesh {
  size_t vertex_count;
  size_t triangle_count;
  double (*positions)[3];       /* [V] the reference pose */
  uint32_t (*triangles)[3];     /* [F] */
  double (*cotangents)[3];      /* [F] half cotangent at each corner; see exm_mesh_cotangents */
  double *masses;               /* [V] a third of the area of the triangles around, floored so that none is zero */
  uint32_t *components;         /* [V] connected part, numbered from 0 in the order of their lowest vertex */
  uint32_t *neighbor_offsets;   /* [V + 1] */
  uint32_t *neighbors;          /* 1-rings, sorted */
  uint32_t *non_manifold_edges; /* [2 x] vertex pairs */
  uint32_t *degenerate_faces;
  uint32_t *loose_vertices;
  exm_mesh_report report; /* says how many there are of each */
  arena memory;           /* holds the struct itself, too */
} mesh;

/** See exm_mesh_create. positions [V][3], triangles [F][3], neither NULL. */
exm_status mesh_create(const float (*positions)[3], size_t vertex_count, const uint32_t (*triangles)[3],
                       size_t triangle_count, mesh **out);

/** See exm_mesh_read. */
exm_status mesh_read(const char *path, mesh **out);

void mesh_destroy(mesh *m);

#endif
