/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Patch-based rotation-invariant coordinates [Baran et al. 2009; SEQ, section 5]. The mesh is divided into patches of
 * triangles. A triangle's rotation is told relative to that of its patch, a patch's relative to those of the patches
 * beside it, and only one patch of every connected part to the world: 9 F numbers, 3 a pair of neighbouring patches,
 * and 6 a part. Relative rotations are small, so their logarithms are unique, and averages know nothing of how a limb
 * is turned to the world. To positions: first the patches' frames, then the triangles' gradients, then Poisson's
 * equation. */
#include <math.h>
#include <string.h>

#include "linalg/rotation.h"
#include "linalg/rotation_log.h"
#include "sequence/shape_spaces/frame_graph.h"
#include "sequence/shape_spaces/polar.h"
#include "sequence/shape_spaces/spaces.h"
#include "sequence/shape_spaces/surface.h"

/* Triangles a patch, about: small enough for neighbours to be turned against each other by less than half a turn, and
 * few enough for their frames to cost nothing. */
enum { FACES_A_PATCH = 50, MOST_PATCHES = 128 };

typedef struct patches {
  surface whole;
  frame_graph graph; /* of the patches */
  size_t patch_count;
  uint32_t *patch_of;                      /* [F] */
  double (*gradients)[9], (*rotations)[9]; /* [F] scratch */
  double (*sums)[9];                       /* [patches] scratch */
  double *centres;                         /* [components][3] scratch */
} patches;

/* ------------------------------------------------------------------------------------------------------- division */

/** Neighbours of the triangles, breadth first from `queue`'s first `count`; hops [F] says how far, or stays where less.
 */
static void spread(const surface *s, uint32_t *queue, size_t count, uint32_t *hops, uint32_t *labels)
{
  for (size_t head = 0; head < count; head++) {
    uint32_t const f = queue[head];
    for (int i = 0; i < 3; i++) {
      const mesh_edge *edge = &s->edges.edges[s->edges.of_face[f][i]];
      for (int side = 0; side < 2; side++) {
        uint32_t const g = edge->faces[side];
        if (g != NO_FACE && hops[f] + 1 < hops[g]) {
          hops[g] = hops[f] + 1;
          labels[g] = labels[f];
          queue[count++] = g;
        }
      }
    }
  }
}

/** Seeds as far from each other as can be, in hops; every triangle goes to the closest. The first seeds of parts come
 *  first, for no hop leads to another part. */
static void divide(const surface *s, size_t wanted, uint32_t *queue, uint32_t *hops, patches *p)
{
  size_t const F = s->reference->triangle_count;
  memset(hops, 0xff, F * sizeof *hops);
  for (size_t i = 0; i < F; i++) {
    size_t furthest = s->order.faces[0];
    for (size_t f = 0; f < F; f++) {
      furthest = hops[f] > hops[furthest] ? f : furthest;
    }
    if (hops[furthest] == 0 || (hops[furthest] != UINT32_MAX && p->patch_count >= wanted)) {
      return;
    }
    hops[furthest] = 0;
    p->patch_of[furthest] = (uint32_t)p->patch_count++;
    queue[0] = (uint32_t)furthest;
    spread(s, queue, 1, hops, p->patch_of);
  }
}

/** Pairs of patches that share an edge, each once. */
static exm_status link_patches(arena *owner, arena *scratch, patches *p)
{
  size_t const P = p->patch_count;
  uint8_t *are_linked = ARENA_NEW(scratch, uint8_t, P * P);
  uint32_t(*links)[2] = arena_array(scratch, P * (P - 1) / 2, sizeof *links);
  size_t count = 0;
  if (!are_linked || !links) {
    return status_no_memory("the patches");
  }
  for (size_t e = 0; e < p->whole.edges.count; e++) {
    const mesh_edge *edge = &p->whole.edges.edges[e];
    if (edge->faces[1] == NO_FACE) {
      continue;
    }
    uint32_t const a = p->patch_of[edge->faces[0]], b = p->patch_of[edge->faces[1]];
    uint32_t const low = a < b ? a : b, high = a < b ? b : a;
    if (low != high && !are_linked[low * P + high]) {
      are_linked[low * P + high] = 1;
      links[count][0] = low;
      links[count++][1] = high;
    }
  }
  return frame_graph_create(owner, P, count, (const uint32_t(*)[2])links, &p->graph);
}

static exm_status prepare(shape_space *space)
{
  const mesh *m = space->reference;
  size_t const F = m->triangle_count, parts = m->report.component_count;
  arena scratch = {0};
  patches *p = ARENA_NEW(&space->memory, patches, 1);
  uint32_t *queue = ARENA_NEW(&scratch, uint32_t, 3 * F), *hops = ARENA_NEW(&scratch, uint32_t, F);
  exm_status status = p && queue && hops ? EXM_OK : status_no_memory("the shape space");
  if (status >= 0) {
    space->state = p;
    p->patch_of = ARENA_NEW(&space->memory, uint32_t, F);
    p->gradients = arena_array(&space->memory, F, sizeof *p->gradients);
    p->rotations = arena_array(&space->memory, F, sizeof *p->rotations);
    p->centres = ARENA_NEW(&space->memory, double, 3 * parts);
    status = p->patch_of && p->gradients && p->rotations && p->centres ? EXM_OK : status_no_memory("the shape space");
  }
  if (status >= 0 && (status = surface_create(&space->memory, m, &p->whole)) >= 0) {
    size_t const wanted = F / FACES_A_PATCH < 2 ? 2 : F / FACES_A_PATCH;
    divide(&p->whole, wanted < MOST_PATCHES ? wanted : MOST_PATCHES, queue, hops, p);
    p->sums = arena_array(&space->memory, p->patch_count, sizeof *p->sums);
    status = p->sums ? link_patches(&space->memory, &scratch, p) : status_no_memory("the patches");
    space->dimension = 9 * F + 3 * p->graph.link_count + 3 * p->graph.part_count + 3 * parts;
  }
  arena_release(&scratch);
  return status;
}

static void release(shape_space *space)
{
  patches *p = space->state;
  if (p) {
    surface_release(&p->whole);
    frame_graph_release(&p->graph);
  }
}

/* ----------------------------------------------------------------------------------------------------- coordinates */

/** Weight of one of several rotations that together turn the whole mesh. */
static double share(const patches *p, size_t count)
{
  return p->whole.turn / sqrt((double)(count ? count : 1));
}

/** The rotation of a patch is the one closest to its triangles' gradients, by area. */
static void turn_patches(patches *p)
{
  const surface *s = &p->whole;
  memset(p->sums, 0, p->patch_count * sizeof *p->sums);
  for (size_t f = 0; f < s->reference->triangle_count; f++) {
    for (size_t k = 0; k < 9; k++) {
      p->sums[p->patch_of[f]][k] += s->face_weights[f] * s->face_weights[f] * p->gradients[f][k];
    }
  }
  rotation_fit3(p->patch_count, &p->sums[0][0], &p->graph.frames[0][0]);
}

/** The scaled logarithm of a' b, close to `like` where that is given. */
static void relative_log(const double a[9], const double b[9], const double *like, double scale, double out[3])
{
  double turn[9], expected[3] = {0};
  matrix_transposed_times(a, b, turn);
  for (int k = 0; like && k < 3; k++) {
    expected[k] = like[k] / scale;
  }
  rotation_log(turn, expected, out);
  for (int k = 0; k < 3; k++) {
    out[k] *= scale;
  }
}

static exm_status encode(shape_space *space, const float *positions, const double *like, double *coordinates)
{
  patches *p = space->state;
  surface *s = &p->whole;
  size_t const F = space->reference->triangle_count, links = p->graph.link_count, turns = p->graph.part_count;
  double const linked = share(p, links), whole = share(p, turns);
  for (size_t f = 0; f < F; f++) {
    surface_gradient(s, positions, f, p->gradients[f]);
  }
  rotation_fit3(F, &p->gradients[0][0], &p->rotations[0][0]);
  turn_patches(p);
  for (size_t f = 0; f < F; f++) {
    double const scale = s->face_weights[f] * s->turn;
    double *to = coordinates + 9 * f;
    relative_log(p->graph.frames[p->patch_of[f]], p->rotations[f], like ? like + 9 * f : NULL, scale, to);
    polar_stretch(p->gradients[f], p->rotations[f], to + 3);
    for (size_t k = 3; k < 9; k++) {
      to[k] *= scale;
    }
  }
  for (size_t i = 0; i < links; i++) {
    size_t const at = 9 * F + 3 * i;
    const uint32_t *ends = p->graph.links[i];
    relative_log(p->graph.frames[ends[0]], p->graph.frames[ends[1]], like ? like + at : NULL, linked, coordinates + at);
  }
  size_t const at = 9 * F + 3 * links;
  frame_graph_put_anchors(&p->graph, whole, like ? like + at : NULL, coordinates + at);
  surface_put_centres(s, positions, coordinates + 9 * F + 3 * (links + turns));
  return EXM_OK;
}

/** Frames of the patches from the coordinates of their pairs. */
static exm_status place_patches(const shape_space *space, const double *coordinates)
{
  patches *p = space->state;
  size_t const F = space->reference->triangle_count, links = p->graph.link_count, turns = p->graph.part_count;
  double const linked = share(p, links), whole = share(p, turns);
  for (size_t i = 0; i < links; i++) {
    const double *from = coordinates + 9 * F + 3 * i;
    double const vector[3] = {from[0] / linked, from[1] / linked, from[2] / linked};
    rotation_exp(vector, p->graph.turns[i]);
  }
  frame_graph_take_anchors(&p->graph, whole, coordinates + 9 * F + 3 * links);
  return frame_graph_solve(&p->graph);
}

static exm_status decode(shape_space *space, const double *coordinates, double *positions)
{
  patches *p = space->state;
  surface *s = &p->whole;
  size_t const F = space->reference->triangle_count;
  TRY(place_patches(space, coordinates));
  surface_begin(s);
  for (size_t f = 0; f < F; f++) {
    double const scale = 1 / (s->face_weights[f] * s->turn);
    double numbers[9], relative[9], rotation[9], gradient[9];
    for (size_t k = 0; k < 9; k++) {
      numbers[k] = scale * coordinates[9 * f + k];
    }
    rotation_exp(numbers, relative);
    matrix_times(p->graph.frames[p->patch_of[f]], relative, rotation);
    polar_compose(rotation, numbers + 3, gradient);
    surface_add_gradient(s, f, gradient);
  }
  surface_take_centres(s, coordinates + 9 * F + 3 * (p->graph.link_count + p->graph.part_count), p->centres);
  return surface_solve(s, p->centres, positions);
}

const shape_space_methods shape_space_patches = {
    .name = "patch-based coordinates", .prepare = prepare, .encode = encode, .decode = decode, .release = release};
