/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The one door to OpenMesh. What comes out is plain arrays in the caller's arena; every C++ exception ends here. */
#ifndef EXM_MESH_OPENMESH_SHIM_H
#define EXM_MESH_OPENMESH_SHIM_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/memory.h"
#include "base/status.h"
#include "mesh/mesh_file.h"

/** Triangles that share vertices, as a file has them: nothing is checked but that indices are in range. */
typedef struct shim_surface {
  size_t vertex_count;
  size_t triangle_count;
  float (*positions)[3];    /* [V] finite */
  uint32_t (*triangles)[3]; /* [F] polygons are fanned from their first corner */
} shim_surface;

/** Parse what mesh_file_load has prepared. A polygon that repeats a corner loses the repetition, and is left out
 *  where fewer than three corners remain, in every format alike. */
exm_status openmesh_parse(const mesh_file *file, arena *memory, shim_surface *out);

/** An undirected edge and how many triangles run along it from low to high, and from high to low. */
typedef struct shim_edge {
  uint32_t low, high;
  uint32_t forward, backward;
} shim_edge;

typedef struct shim_topology {
  size_t edge_count;
  shim_edge *edges; /* [E] of the accepted triangles, each once */
  size_t rejected_count;
  uint32_t *rejected; /* triangles that OpenMesh cannot take in: it keeps to manifolds */
} shim_topology;

/** Edges of a triangle list. Indices are in range and the corners of a triangle differ: OpenMesh aborts otherwise. */
exm_status openmesh_topology(const uint32_t (*triangles)[3], size_t triangle_count, size_t vertex_count, arena *memory,
                             shim_topology *out);

#ifdef __cplusplus
}
#endif

#endif
