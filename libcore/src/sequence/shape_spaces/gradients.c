/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Deformation gradients [Sumner and Popovic 2004; SEQ, section 5]: of every triangle the rotation's logarithm and the
 * stretch, 9 F numbers, and 3 for the place of every connected part.
 *
 * Logarithms are unique but for full turns. They are followed over the triangles, along a tree of neighbours, and over
 * the frames: a triangle's is the one closest to where its parent's way since the last frame would take it. A mesh that
 * spins as a whole then spins on, and neighbours stay neighbours, up to a full turn away from the reference: there the
 * rotations near to it have logarithms that are far apart, and no choice of them is continuous.
 *
 * Coordinates are scaled by area and by the mesh's size, so that the whole mesh turned by a small angle is as far away
 * as it is in positions. */
#include <math.h>
#include <string.h>

#include "linalg/rotation.h"
#include "linalg/rotation_log.h"
#include "sequence/shape_spaces/polar.h"
#include "sequence/shape_spaces/spaces.h"
#include "sequence/shape_spaces/surface.h"

typedef struct gradients {
  surface whole;
  double (*gradients)[9], (*rotations)[9]; /* [F] scratch */
  double *centres;                         /* [components][3] scratch */
} gradients;

static exm_status prepare(shape_space *space)
{
  const mesh *m = space->reference;
  size_t const F = m->triangle_count, parts = m->report.component_count;
  gradients *g = ARENA_NEW(&space->memory, gradients, 1);
  if (!g) {
    return status_no_memory("the shape space");
  }
  space->state = g;
  space->dimension = 9 * F + 3 * parts;
  g->gradients = arena_array(&space->memory, F, sizeof *g->gradients);
  g->rotations = arena_array(&space->memory, F, sizeof *g->rotations);
  g->centres = ARENA_NEW(&space->memory, double, 3 * parts);
  if (!g->gradients || !g->rotations || !g->centres) {
    return status_no_memory("the shape space");
  }
  return surface_create(&space->memory, m, &g->whole);
}

static void release(shape_space *space)
{
  gradients *g = space->state;
  if (g) {
    surface_release(&g->whole);
  }
}

/** The logarithm that triangle f's should be close to, scaled coordinates being what is at hand. */
static void expect_log(const gradients *g, size_t f, uint32_t parent, const double *like, const double *now,
                       double out[3])
{
  double const own = g->whole.face_weights[f] * g->whole.turn;
  for (size_t k = 0; k < 3; k++) {
    out[k] = like ? like[9 * f + k] / own : 0;
    if (parent != NO_FACE) {
      double const scale = g->whole.face_weights[parent] * g->whole.turn;
      out[k] += (now[9 * (size_t)parent + k] - (like ? like[9 * (size_t)parent + k] : 0)) / scale;
    }
  }
}

static exm_status encode(shape_space *space, const float *positions, const double *like, double *coordinates)
{
  gradients *g = space->state;
  const surface *s = &g->whole;
  size_t const F = space->reference->triangle_count;
  for (size_t f = 0; f < F; f++) {
    surface_gradient(s, positions, f, g->gradients[f]);
  }
  rotation_fit3(F, &g->gradients[0][0], &g->rotations[0][0]);
  for (size_t i = 0; i < F; i++) {
    size_t const f = s->order.faces[i];
    double const scale = s->face_weights[f] * s->turn;
    double *to = coordinates + 9 * f, expected[3];
    expect_log(g, f, s->order.parents[i], like, coordinates, expected);
    rotation_log(g->rotations[f], expected, to);
    polar_stretch(g->gradients[f], g->rotations[f], to + 3);
    for (size_t k = 0; k < 9; k++) {
      to[k] *= scale;
    }
  }
  surface_put_centres(s, positions, coordinates + 9 * F);
  return EXM_OK;
}

static exm_status decode(shape_space *space, const double *coordinates, double *positions)
{
  gradients *g = space->state;
  surface *s = &g->whole;
  size_t const F = space->reference->triangle_count;
  surface_begin(s);
  for (size_t f = 0; f < F; f++) {
    double const scale = 1 / (s->face_weights[f] * s->turn);
    double numbers[9], rotation[9], gradient[9];
    for (size_t k = 0; k < 9; k++) {
      numbers[k] = scale * coordinates[9 * f + k];
    }
    rotation_exp(numbers, rotation);
    polar_compose(rotation, numbers + 3, gradient);
    surface_add_gradient(s, f, gradient);
  }
  surface_take_centres(s, coordinates + 9 * F, g->centres);
  return surface_solve(s, g->centres, positions);
}

const shape_space_methods shape_space_gradients = {
    .name = "deformation gradients", .prepare = prepare, .encode = encode, .decode = decode, .release = release};
