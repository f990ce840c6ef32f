/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Small meshes, each with one trait; sound ones first, then broken ones. */
#ifndef EXM_TESTS_ZOO_H
#define EXM_TESTS_ZOO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "exemplar.h"

typedef struct zoo_mesh {
  const char *name;
  size_t vertex_count, triangle_count;
  float (*positions)[3];
  uint32_t (*triangles)[3];
  /* What is known of it beforehand. */
  size_t boundary_edges, non_manifold_edges, degenerate_faces, loose_vertices, components;
  int euler_characteristic; /* V - E + F, loose vertices left out */
  bool sound;               /* exm_mesh_create returns EXM_OK */
} zoo_mesh;

/** All of them; built once, never released. The count is stored in *count. */
const zoo_mesh *zoo(size_t *count);

/** By name; ends the program where there is none of that name. */
const zoo_mesh *zoo_find(const char *name);

/** exm_mesh_create of one; NULL and a failure in the harness's books where it fails. */
exm_mesh *zoo_create(const zoo_mesh *mesh);

/* Makers, for sizes of one's own. Release with zoo_free. */
zoo_mesh zoo_grid(size_t columns, size_t rows, float width, float height); /* cells; in the plane z = 0 */
zoo_mesh zoo_sphere(int subdivisions);                                     /* unit icosphere */
zoo_mesh zoo_torus(size_t around, size_t across, float major, float minor);
zoo_mesh zoo_bar(size_t length, size_t side); /* closed box of `length` x side x side unit cells along x */
void zoo_free(zoo_mesh *mesh);

#endif
