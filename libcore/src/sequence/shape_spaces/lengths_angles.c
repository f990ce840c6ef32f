/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edge lengths and dihedral angles [Winkler et al. 2010; Froehlich and Botsch 2011; SEQ, section 5]: 2 E numbers, and 6
 * for the place of every connected part. To positions: lengths make the triangles, angles the turns from each triangle
 * to its neighbours, these the triangles' frames [shape_spaces/frame_graph.h], and all of it the edge vectors of
 * Poisson's equation. Averages of lengths need not close around a vertex; both systems then compromise, in least
 * squares. */
#include <math.h>
#include <string.h>

#include "sequence/shape_spaces/frame_graph.h"
#include "sequence/shape_spaces/polar.h"
#include "sequence/shape_spaces/spaces.h"
#include "sequence/shape_spaces/surface.h"

typedef struct lengths_angles {
  surface whole;
  frame_graph graph;                /* of the triangles */
  uint32_t *linked;                 /* [links] the edges with two triangles */
  double length_scale, angle_scale; /* all lengths by a share, all angles by an angle: as far as a turn of the whole */
  double (*layouts)[3][2];          /* [F] corners in the triangle's own frame, scratch */
  double *centres;                  /* [components][3] scratch */
} lengths_angles;

static exm_status link_faces(arena *owner, arena *scratch, lengths_angles *l)
{
  const mesh_edges *edges = &l->whole.edges;
  uint32_t(*links)[2] = arena_array(scratch, edges->count, sizeof *links);
  size_t count = 0;
  l->linked = ARENA_NEW(owner, uint32_t, edges->count);
  if (!links || !l->linked) {
    return status_no_memory("the shape space");
  }
  for (size_t e = 0; e < edges->count; e++) {
    if (edges->edges[e].faces[1] != NO_FACE) {
      memcpy(links[count], edges->edges[e].faces, sizeof *links);
      l->linked[count++] = (uint32_t)e;
    }
  }
  return frame_graph_create(owner, l->whole.reference->triangle_count, count, (const uint32_t(*)[2])links, &l->graph);
}

static exm_status rest(lengths_angles *l, arena *scratch);

static exm_status prepare(shape_space *space)
{
  const mesh *m = space->reference;
  arena scratch = {0};
  lengths_angles *l = ARENA_NEW(&space->memory, lengths_angles, 1);
  if (!l) {
    return status_no_memory("the shape space");
  }
  space->state = l;
  l->layouts = arena_array(&space->memory, m->triangle_count, sizeof *l->layouts);
  l->centres = ARENA_NEW(&space->memory, double, 3 * m->report.component_count);
  exm_status status = l->layouts && l->centres ? EXM_OK : status_no_memory("the shape space");
  if (status >= 0 && (status = surface_create(&space->memory, m, &l->whole)) >= 0) {
    l->length_scale = surface_length_scale(&l->whole);
    l->angle_scale = l->whole.turn / sqrt((double)l->whole.edges.count);
    status = link_faces(&space->memory, &scratch, l);
    status = status < 0 ? status : rest(l, &scratch);
    space->dimension = 2 * l->whole.edges.count + 3 * l->graph.part_count + 3 * m->report.component_count;
  }
  arena_release(&scratch);
  return status;
}

static void release(shape_space *space)
{
  lengths_angles *l = space->state;
  if (l) {
    surface_release(&l->whole);
    frame_graph_release(&l->graph);
  }
}

/* ---------------------------------------------------------------------------------------------------------- frames */

/** A triangle's own frame in the world, its axes in columns: along its first edge, across it, and normal. */
static void world_frame(const surface *s, const float *positions, size_t f, double frame[9])
{
  const uint32_t *t = s->reference->triangles[f];
  double axes[3][3];
  vector_between(positions, t[0], t[1], axes[0]);
  vector_between(positions, t[0], t[2], axes[1]);
  surface_orthonormal(axes);
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++) {
      frame[3 * k + i] = axes[i][k];
    }
  }
}

/** Frames of the reference, for the anchors. */
static exm_status rest(lengths_angles *l, arena *scratch)
{
  float *positions = surface_positions(&l->whole, scratch);
  if (!positions) {
    return status_no_memory("the shape space");
  }
  for (size_t f = 0; f < l->whole.reference->triangle_count; f++) {
    world_frame(&l->whole, positions, f, l->graph.frames[f]);
  }
  frame_graph_rest(&l->graph);
  return EXM_OK;
}

/** The unit vector along an edge in a triangle's frame, from its layout; and the frame along the edge: columns d, n x d
 *  and n. */
static void edge_frame(const lengths_angles *l, size_t f, const mesh_edge *edge, double frame[9])
{
  const uint32_t *t = l->whole.reference->triangles[f];
  double ends[2][2] = {{0}};
  for (int i = 0; i < 3; i++) {
    for (int side = 0; side < 2; side++) {
      if (t[i] == edge->ends[side]) {
        memcpy(ends[side], l->layouts[f][i], sizeof ends[side]);
      }
    }
  }
  double const x = ends[1][0] - ends[0][0], y = ends[1][1] - ends[0][1], length = hypot(x, y);
  double const c = length > 0 ? x / length : 1, s = length > 0 ? y / length : 0;
  double const A[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
  memcpy(frame, A, sizeof A);
}

/** Corners from the lengths of the edges opposite to them; sides that do not meet make a flat triangle. */
static void lay_out(const double lengths[3], double layout[3][2])
{
  double const a = lengths[2], b = lengths[1], c = lengths[0]; /* from corner 0 to 1, 0 to 2, and 1 to 2 */
  double const cosine = a * b > 0 ? fmin(fmax((a * a + b * b - c * c) / (2 * a * b), -1), 1) : 1;
  double const corners[3][2] = {{0, 0}, {a, 0}, {b * cosine, b * sqrt(1 - cosine * cosine)}};
  memcpy(layout, corners, sizeof corners);
}

static void lay_out_all(lengths_angles *l, const double *lengths, double scale)
{
  for (size_t f = 0; f < l->whole.reference->triangle_count; f++) {
    const uint32_t *edges = l->whole.edges.of_face[f];
    double const sides[3] = {fmax(lengths[edges[0]] / scale, 0), fmax(lengths[edges[1]] / scale, 0),
                             fmax(lengths[edges[2]] / scale, 0)};
    lay_out(sides, l->layouts[f]);
  }
}

/* ----------------------------------------------------------------------------------------------------- coordinates */

/** The angle about an edge from the frame of one triangle to that of the other, within half a turn of `like`. */
static double angle_between(const lengths_angles *l, size_t link, const double a[9], const double b[9], double like)
{
  const mesh_edge *edge = &l->whole.edges.edges[l->linked[link]];
  double along_a[9], along_b[9], from[9], to[9], turn[9];
  edge_frame(l, edge->faces[0], edge, along_a);
  edge_frame(l, edge->faces[1], edge, along_b);
  matrix_times(a, along_a, from);
  matrix_times(b, along_b, to);
  matrix_transposed_times(from, to, turn); /* about its x axis */
  double const angle = atan2(turn[7] - turn[5], turn[4] + turn[8]);
  return angle + 2 * M_PI * rint((like - angle) / (2 * M_PI));
}

static exm_status encode(shape_space *space, const float *positions, const double *like, double *coordinates)
{
  lengths_angles *l = space->state;
  const surface *s = &l->whole;
  size_t const E = s->edges.count, F = s->reference->triangle_count;
  double *angles = coordinates + E, *anchors = coordinates + 2 * E;
  memset(coordinates, 0, space->dimension * sizeof(double));
  for (size_t e = 0; e < E; e++) {
    const uint32_t *ends = s->edges.edges[e].ends;
    double d[3];
    vector_between(positions, ends[0], ends[1], d);
    coordinates[e] = l->length_scale * sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  }
  lay_out_all(l, coordinates, l->length_scale);
  for (size_t f = 0; f < F; f++) {
    world_frame(s, positions, f, l->graph.frames[f]);
  }
  for (size_t i = 0; i < l->graph.link_count; i++) {
    const uint32_t *faces = l->graph.links[i];
    size_t const e = l->linked[i];
    angles[e] = l->angle_scale * angle_between(l, i, l->graph.frames[faces[0]], l->graph.frames[faces[1]],
                                               like ? like[E + e] / l->angle_scale : 0);
  }
  frame_graph_put_anchors(&l->graph, s->turn, like ? like + 2 * E : NULL, anchors);
  surface_put_centres(s, positions, anchors + 3 * l->graph.part_count);
  return EXM_OK;
}

/** Turns between neighbours from lengths and angles, anchors from their logarithms; then all frames. */
static exm_status turn_faces(lengths_angles *l, const double *coordinates)
{
  const surface *s = &l->whole;
  size_t const E = s->edges.count;
  for (size_t i = 0; i < l->graph.link_count; i++) {
    const mesh_edge *edge = &s->edges.edges[l->linked[i]];
    double const angle = coordinates[E + l->linked[i]] / l->angle_scale, c = cos(angle), n = sin(angle);
    double const about[9] = {1, 0, 0, 0, c, -n, 0, n, c};
    double from[9], to[9], turned[9], back[9];
    edge_frame(l, edge->faces[0], edge, from);
    edge_frame(l, edge->faces[1], edge, to);
    matrix_times(from, about, turned);
    matrix_transpose(to, back);
    matrix_times(turned, back, l->graph.turns[i]);
  }
  frame_graph_take_anchors(&l->graph, s->turn, coordinates + 2 * E);
  return frame_graph_solve(&l->graph);
}

static exm_status decode(shape_space *space, const double *coordinates, double *positions)
{
  lengths_angles *l = space->state;
  surface *s = &l->whole;
  lay_out_all(l, coordinates, l->length_scale);
  TRY(turn_faces(l, coordinates));
  surface_begin(s);
  for (size_t f = 0; f < s->reference->triangle_count; f++) {
    const double *B = l->graph.frames[f];
    double edges[9];
    for (size_t i = 0; i < 3; i++) {
      const double *from = l->layouts[f][(i + 1) % 3], *to = l->layouts[f][(i + 2) % 3];
      double const x = to[0] - from[0], y = to[1] - from[1];
      for (size_t k = 0; k < 3; k++) {
        edges[3 * i + k] = B[3 * k] * x + B[3 * k + 1] * y;
      }
    }
    surface_add_face(s, f, edges);
  }
  surface_take_centres(s, coordinates + 2 * s->edges.count + 3 * l->graph.part_count, l->centres);
  return surface_solve(s, l->centres, positions);
}

const shape_space_methods shape_space_lengths_angles = {.name = "edge lengths and dihedral angles",
                                                        .prepare = prepare,
                                                        .encode = encode,
                                                        .decode = decode,
                                                        .release = release};
