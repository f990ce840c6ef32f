/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What handles hold of a full-resolution mesh. A vertex is fixed, at a place that its handle's target gives, or it
 * belongs to a patch, whose mean is held, or it is free.
 *
 * A handle that is small has a disc: an edge set with a rotation of its own, made of the spokes of vertices i within
 * `radius` of its centre, each counted s_i = d_i ((radius / distance_i)^2 - 1) times, d_i being in how many
 * neighbourhoods it is anyway. The surface conducts displacement as a membrane does, whose answer to a force at a point
 * is a logarithm, a cusp; with a conductivity that grows as 1 / distance^2 towards the point it is a parabola, which
 * meets the logarithm at the rim without a kink. */
#ifndef EXM_DEFORM_RIGIDITY_HELD_H
#define EXM_DEFORM_RIGIDITY_HELD_H

#include "mesh/mesh.h"

typedef struct held_vertex {
  uint32_t vertex, handle;
  double arm[3]; /* from the handle's centre to it, in the reference */
} held_vertex;

typedef struct held_patch {
  uint32_t handle;
  uint32_t begin, end; /* into patch_vertices */
  uint32_t ground;     /* into `grounds`, or HELD_NONE */
  double arm[3];       /* from the handle's centre to the patch's */
} held_patch;

#define HELD_NONE UINT32_MAX

typedef struct held {
  arena memory;
  size_t handle_count;
  int32_t *kinds;       /* [handle_count] */
  double (*centres)[3]; /* [handle_count] */
  double *targets;      /* [handle_count][3][4] room for those of the last solve */
  int has_targets;
  size_t fixed_count;
  held_vertex *fixed;
  size_t patch_count;
  held_patch *patches;
  uint32_t *patch_vertices;
  /* Connected parts that have patches alone can be anywhere as far as the matrix goes: one vertex of each is taken out
   * of it, and where it is follows from the patches. */
  size_t ground_count;
  uint32_t *grounds;           /* vertices */
  uint32_t *component_grounds; /* [components] into `grounds`, or HELD_NONE */
  unsigned char *is_out;       /* [V] of the system: fixed, or a ground */
  size_t disc_count;
  uint32_t *disc_offsets; /* [disc_count + 1] */
  uint32_t *disc_vertices;
  double *disc_weights; /* (radius / distance)^2 - 1 */
} held;

/** From handles that were checked. disc_radius: a length; 0: no discs. `out` has an arena of its own, also on failure.
 */
exm_status held_create(const mesh *m, const exm_handles *handles, double disc_radius, held *out);
void held_destroy(held *h);

/** Where a handle's target [3][4] takes the point at `arm` from its centre. */
void held_place(const held *h, size_t handle, const double arm[3], const double *targets, double out[3]);

#endif
