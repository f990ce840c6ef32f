/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Linear rotation-invariant coordinates [Lipman et al. 2005; SEQ, section 5]: the first and the second discrete form of
 * every vertex. The second form is how far the neighbours stand out of the tangent plane; the first is the lengths of
 * and the angles between the edges' shadows in it, which follow from the second and from the edges' lengths. So an edge
 * has three numbers, its length and its height at either end: 3 E in all, and 6 for the place of every connected part.
 *
 * To positions, as in the paper by two linear systems: forms lay out every vertex's ring in a frame of its own; rings
 * of neighbours share a triangle or two, which gives the turn from frame to frame [shape_spaces/frame_graph.h]; and
 * edge vectors in all frames give positions. A ring that is folded over in its tangent plane is laid out folded where
 * the reference's is: forms do not say which way an angle turns.
 *
 * Rings need an order: vertices must be manifold. */
#include <math.h>
#include <string.h>

#include "linalg/rotation.h"
#include "linalg/rotation_log.h"
#include "sequence/shape_spaces/frame_graph.h"
#include "sequence/shape_spaces/spaces.h"
#include "sequence/shape_spaces/surface.h"

typedef struct spoke {
  uint32_t vertex, edge;
  uint32_t opposite; /* edge to the next spoke's vertex; NO_EDGE after the last of an open ring */
  int32_t turn;      /* 1: the angle to the next spoke's shadow is counter-clockwise in the reference, or -1 */
} spoke;

#define NO_EDGE UINT32_MAX

enum { CAP_STEPS = 100, MOST_TURNS = 12 };

/* Angles of a ring in radians: when it is closed but for rounding, and when it is open beyond what rounding does. */
static double const CLOSED = 1e-4, OPEN = 1e-3;

typedef struct forms {
  surface whole;
  frame_graph graph;   /* of the vertices, along the edges */
  uint32_t *offsets;   /* [V + 1] */
  spoke *spokes;       /* [2 E] rings in their order */
  double (*layout)[3]; /* [2 E] the spokes in their vertex's frame, scratch */
  double length_scale;
  double (*normals)[3]; /* of a ring's triangles, scratch */
  double *centres;      /* [components][3] scratch */
} forms;

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ----------------------------------------------------------------------------------------------------------- rings */

/** The corner of triangle f that is at vertex v. */
static size_t corner_at(const mesh *m, size_t f, uint32_t v)
{
  return m->triangles[f][0] == v ? 0 : m->triangles[f][1] == v ? 1 : 2;
}

static exm_status not_manifold(size_t v)
{
  return status_set_at(EXM_ERROR_TOPOLOGY, EXM_ELEMENT_VERTEX, v,
                       "shape_space: linear rotation-invariant coordinates need a manifold mesh, and the triangles "
                       "around vertex %zu are not in one ring",
                       v);
}

/** Spokes of one vertex from its triangles [count], in order. */
static exm_status order_ring(const forms *l, uint32_t v, const uint32_t *faces, size_t count, spoke *out)
{
  const mesh *m = l->whole.reference;
  size_t const degree = l->offsets[v + 1] - l->offsets[v];
  size_t current = count;
  for (size_t i = 0; i < count; i++) { /* begin where no triangle comes before */
    uint32_t const begin = m->triangles[faces[i]][(corner_at(m, faces[i], v) + 1) % 3];
    int has_previous = 0;
    for (size_t j = 0; j < count; j++) {
      has_previous |= m->triangles[faces[j]][(corner_at(m, faces[j], v) + 2) % 3] == begin;
    }
    current = has_previous ? current : i;
  }
  int const is_open = current < count;
  if (degree != count + (size_t)is_open) {
    return count == 0 && degree == 0 ? EXM_OK : not_manifold(v);
  }
  current = is_open ? current : 0;
  for (size_t k = 0; k < count; k++) {
    uint32_t const f = faces[current];
    size_t const corner = corner_at(m, f, v);
    const uint32_t *edges = l->whole.edges.of_face[f];
    uint32_t const next = m->triangles[f][(corner + 2) % 3];
    out[k] = (spoke){m->triangles[f][(corner + 1) % 3], edges[(corner + 2) % 3], edges[corner], 1};
    if (is_open && k + 1 == count) {
      out[count] = (spoke){next, edges[(corner + 1) % 3], NO_EDGE, 1};
      return EXM_OK;
    }
    size_t found = count;
    for (size_t j = 0; j < count; j++) {
      found = m->triangles[faces[j]][(corner_at(m, faces[j], v) + 1) % 3] == next ? j : found;
    }
    if (found == count || (found == 0) != (k + 1 == count && !is_open)) {
      if (!is_open || found == count) {
        return not_manifold(v);
      }
    }
    current = found;
  }
  return EXM_OK;
}

/** Triangles around every vertex, [3 F] behind their starts [V + 1]. */
static exm_status gather_faces(const mesh *m, arena *scratch, uint32_t **starts, uint32_t **faces)
{
  *starts = ARENA_NEW(scratch, uint32_t, m->vertex_count + 2);
  *faces = ARENA_NEW(scratch, uint32_t, 3 * m->triangle_count);
  if (!*starts || !*faces) {
    return status_no_memory("the rings of a mesh");
  }
  for (size_t i = 0; i < 3 * m->triangle_count; i++) {
    (*starts)[m->triangles[i / 3][i % 3] + 2]++;
  }
  for (size_t v = 0; v < m->vertex_count; v++) {
    (*starts)[v + 2] += (*starts)[v + 1];
  }
  for (size_t i = 0; i < 3 * m->triangle_count; i++) {
    (*faces)[(*starts)[m->triangles[i / 3][i % 3] + 1]++] = (uint32_t)(i / 3);
  }
  return EXM_OK;
}

static exm_status order_rings(arena *owner, arena *scratch, forms *l)
{
  const mesh *m = l->whole.reference;
  uint32_t *starts = NULL, *faces = NULL;
  TRY(gather_faces(m, scratch, &starts, &faces));
  l->offsets = ARENA_NEW(owner, uint32_t, m->vertex_count + 1);
  l->spokes = ARENA_NEW(owner, spoke, 2 * l->whole.edges.count);
  l->layout = arena_array(owner, 2 * l->whole.edges.count, sizeof *l->layout);
  l->normals = arena_array(owner, 3 * m->triangle_count, sizeof *l->normals);
  if (!l->offsets || !l->spokes || !l->layout || !l->normals) {
    return status_no_memory("the shape space");
  }
  for (size_t e = 0; e < l->whole.edges.count; e++) {
    l->offsets[l->whole.edges.edges[e].ends[0] + 1]++;
    l->offsets[l->whole.edges.edges[e].ends[1] + 1]++;
  }
  for (size_t v = 0; v < m->vertex_count; v++) {
    l->offsets[v + 1] += l->offsets[v];
    TRY(order_ring(l, (uint32_t)v, faces + starts[v], starts[v + 1] - starts[v], l->spokes + l->offsets[v]));
  }
  return EXM_OK;
}

/* ---------------------------------------------------------------------------------------------------------- frames */

static void spoke_vector(const float *positions, size_t v, const spoke *s, double out[3])
{
  vector_between(positions, v, s->vertex, out);
}

/** Unit normals of a ring's triangles; gives how many. Those without area are left out. */
static size_t ring_normals(const forms *l, const float *positions, size_t v, double (*normals)[3])
{
  size_t count = 0;
  for (uint32_t i = l->offsets[v]; i < l->offsets[v + 1]; i++) {
    double a[3], b[3];
    if (l->spokes[i].opposite == NO_EDGE) {
      continue;
    }
    spoke_vector(positions, v, &l->spokes[i], a);
    spoke_vector(positions, v, &l->spokes[i + 1 < l->offsets[v + 1] ? i + 1 : l->offsets[v]], b);
    double normal[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double const length = sqrt(dot(normal, normal));
    for (int k = 0; k < 3 && length > 0; k++) {
      normals[count][k] = normal[k] / length;
    }
    count += length > 0;
  }
  return count;
}

/**
 * The normal of a vertex: the centre of the smallest cap that holds the normals of its triangles. A triangle's shadow
 * in the tangent plane is turned over where its normal is more than a right angle away, and of all directions this one
 * is the least away from all of them. By steps towards the furthest one, of 1/2, 1/3, ... [Badoiu and Clarkson 2003].
 */
static void cap_centre(size_t count, const double (*normals)[3], double centre[3])
{
  memset(centre, 0, 3 * sizeof(double));
  for (size_t i = 0; i < 3 * count; i++) {
    centre[i % 3] += normals[i / 3][i % 3] / (double)count;
  }
  for (int step = 2; step < CAP_STEPS && count > 0; step++) {
    size_t furthest = 0;
    for (size_t i = 1; i < count; i++) {
      furthest = dot(normals[i], centre) < dot(normals[furthest], centre) - 1e-12 ? i : furthest;
    }
    for (int k = 0; k < 3; k++) {
      centre[k] += (normals[furthest][k] - centre[k]) / step;
    }
  }
}

/** Frames of the vertices: the shadow of the first spoke, across it, normal. */
static void find_frames(forms *l, const float *positions)
{
  for (size_t v = 0; v < l->whole.reference->vertex_count; v++) {
    double *B = l->graph.frames[v], axes[3][3] = {{0}, {1, 0, 0}, {0}};
    cap_centre(ring_normals(l, positions, v, l->normals), (const double(*)[3])l->normals, axes[0]);
    if (l->offsets[v + 1] > l->offsets[v]) {
      spoke_vector(positions, v, &l->spokes[l->offsets[v]], axes[1]);
    }
    surface_orthonormal(axes); /* normal, shadow, and normal x shadow */
    for (size_t k = 0; k < 3; k++) {
      B[3 * k] = axes[1][k];
      B[3 * k + 1] = axes[2][k];
      B[3 * k + 2] = axes[0][k];
    }
  }
}

/** Vector in the frame's coordinates. */
static void into_frame(const double B[9], const double vector[3], double out[3])
{
  for (int i = 0; i < 3; i++) {
    out[i] = B[i] * vector[0] + B[3 + i] * vector[1] + B[6 + i] * vector[2];
  }
}

static void find_turns(forms *l, const float *positions)
{
  find_frames(l, positions);
  for (size_t v = 0; v < l->whole.reference->vertex_count; v++) {
    for (uint32_t i = l->offsets[v]; i < l->offsets[v + 1]; i++) {
      uint32_t const next = i + 1 < l->offsets[v + 1] ? i + 1 : l->offsets[v];
      double here[3], there[3], a[3], b[3];
      spoke_vector(positions, v, &l->spokes[i], here);
      spoke_vector(positions, v, &l->spokes[next], there);
      into_frame(l->graph.frames[v], here, a);
      into_frame(l->graph.frames[v], there, b);
      l->spokes[i].turn = a[0] * b[1] - a[1] * b[0] < 0 ? -1 : 1;
    }
  }
}

/** Where in the coordinates the height of an edge at a vertex is. */
static size_t height_at(const forms *l, size_t edge, uint32_t v)
{
  return l->whole.edges.count + 2 * edge + (l->whole.edges.edges[edge].ends[0] == v ? 0 : 1);
}

/** How far a ring's angles are from closing: once around, or folded up and not around at all. */
static double misclosure(double total)
{
  return fmin(fabs(total - 2 * M_PI), fabs(total) + CLOSED / 2);
}

/**
 * Which way the angles of a closed ring turn: angles [count], at layout[i][1], not negative in; signed out. As in the
 * reference, unless that leaves the ring open and another way closes it exactly: a shape that was measured, and not an
 * average, then comes back whole although it is folded over where the reference is not. Gives the sum.
 */
static double choose_turns(const spoke *spokes, double (*layout)[3], size_t count)
{
  double total = 0, best = CLOSED;
  size_t chosen = 0;
  for (size_t i = 0; i < count; i++) {
    total += spokes[i].turn * layout[i][1];
  }
  if (misclosure(total) > OPEN && count <= MOST_TURNS) {
    for (size_t pattern = 1; pattern < (size_t)1 << count; pattern++) {
      double other = 0;
      for (size_t i = 0; i < count; i++) {
        other += (pattern >> i & 1 ? -1 : 1) * spokes[i].turn * layout[i][1];
      }
      if (misclosure(other) < best) {
        best = misclosure(other);
        chosen = pattern;
        total = other;
      }
    }
  }
  for (size_t i = 0; i < count; i++) {
    layout[i][1] *= (chosen >> i & 1 ? -1 : 1) * spokes[i].turn;
  }
  return total;
}

/** Heights, lengths of shadows, and angles from each spoke's shadow to the next, in the layout; gives whether the ring
 * is open. */
static int measure_ring(forms *l, uint32_t v, const double *coordinates)
{
  uint32_t const first = l->offsets[v], last = l->offsets[v + 1];
  for (uint32_t i = first; i < last; i++) {
    double const length = coordinates[l->spokes[i].edge] / l->length_scale;
    double const height = coordinates[height_at(l, l->spokes[i].edge, v)] / l->length_scale;
    l->layout[i][0] = sqrt(fmax(length * length - height * height, 0));
    l->layout[i][1] = 0;
    l->layout[i][2] = height;
  }
  for (uint32_t i = first; i < last; i++) {
    const double *a = l->layout[i], *b = l->layout[i + 1 < last ? i + 1 : first];
    if (l->spokes[i].opposite == NO_EDGE) {
      return 1;
    }
    double const across = coordinates[l->spokes[i].opposite] / l->length_scale, rise = a[2] - b[2];
    double const product = a[0] * a[0] + b[0] * b[0] + rise * rise - across * across, size = 2 * a[0] * b[0];
    l->layout[i][1] = size > 0 ? acos(fmin(fmax(product / size, -1), 1)) : 0;
  }
  return 0;
}

/** The ring of a vertex in its frame, from the forms. */
static void lay_out(forms *l, uint32_t v, const double *coordinates)
{
  uint32_t const first = l->offsets[v], last = l->offsets[v + 1];
  double angle = 0, scale = 1;
  if (measure_ring(l, v, coordinates)) {
    for (uint32_t i = first; i < last; i++) {
      l->layout[i][1] *= l->spokes[i].turn;
    }
  } else {
    double const total = choose_turns(l->spokes + first, l->layout + first, last - first);
    if (fabs(total) > M_PI) { /* averages need not close: all angles give way alike */
      scale = 2 * M_PI * rint(total / (2 * M_PI)) / total;
    }
  }
  for (uint32_t i = first; i < last; i++) {
    double const radius = l->layout[i][0], step = l->layout[i][1];
    l->layout[i][0] = radius * cos(angle);
    l->layout[i][1] = radius * sin(angle);
    angle += scale * step;
  }
}

static const double *spoke_to(const forms *l, uint32_t v, uint32_t other)
{
  uint32_t i = l->offsets[v];
  while (l->spokes[i].vertex != other) {
    i++;
  }
  return l->layout[i];
}

/** The turn between the frames of an edge's ends, from what both see: the edge and its triangles' third corners. */
static void find_turn(forms *l, size_t e)
{
  const mesh_edge *edge = &l->whole.edges.edges[e];
  uint32_t const a = edge->ends[0], b = edge->ends[1];
  const double *here = spoke_to(l, a, b), *back = spoke_to(l, b, a);
  double *M = l->graph.turns[e];
  for (int i = 0; i < 9; i++) {
    M[i] = -here[i / 3] * back[i % 3];
  }
  for (int side = 0; side < 2 && edge->faces[side] != NO_FACE; side++) {
    const uint32_t *t = l->whole.reference->triangles[edge->faces[side]];
    uint32_t const c = t[0] + t[1] + t[2] - a - b;
    const double *u = spoke_to(l, a, c), *v = spoke_to(l, b, c);
    for (int i = 0; i < 9; i++) {
      M[i] += u[i / 3] * (v[i % 3] - back[i % 3]);
    }
  }
}

/* --------------------------------------------------------------------------------------------------------- methods */

static exm_status link_vertices(arena *owner, arena *scratch, forms *l)
{
  size_t const E = l->whole.edges.count;
  uint32_t(*links)[2] = arena_array(scratch, E, sizeof *links);
  if (!links) {
    return status_no_memory("the shape space");
  }
  for (size_t e = 0; e < E; e++) {
    memcpy(links[e], l->whole.edges.edges[e].ends, sizeof *links);
  }
  return frame_graph_create(owner, l->whole.reference->vertex_count, E, (const uint32_t(*)[2])links, &l->graph);
}

static exm_status build(shape_space *space, arena *scratch, forms *l)
{
  const mesh *m = space->reference;
  TRY(surface_create(&space->memory, m, &l->whole));
  TRY(link_vertices(&space->memory, scratch, l));
  TRY(order_rings(&space->memory, scratch, l));
  l->length_scale = surface_length_scale(&l->whole);
  l->centres = ARENA_NEW(&space->memory, double, 3 * m->report.component_count);
  float *positions = surface_positions(&l->whole, scratch);
  if (!l->centres || !positions) {
    return status_no_memory("the shape space");
  }
  find_turns(l, positions);
  frame_graph_rest(&l->graph);
  space->dimension = 3 * l->whole.edges.count + 3 * l->graph.part_count + 3 * m->report.component_count;
  return EXM_OK;
}

static exm_status prepare(shape_space *space)
{
  arena scratch = {0};
  forms *l = ARENA_NEW(&space->memory, forms, 1);
  space->state = l;
  exm_status const status = l ? build(space, &scratch, l) : status_no_memory("the shape space");
  arena_release(&scratch);
  return status;
}

static void release(shape_space *space)
{
  forms *l = space->state;
  if (l) {
    surface_release(&l->whole);
    frame_graph_release(&l->graph);
  }
}

static exm_status encode(shape_space *space, const float *positions, const double *like, double *coordinates)
{
  forms *l = space->state;
  const surface *s = &l->whole;
  size_t const E = s->edges.count;
  find_frames(l, positions);
  for (size_t v = 0; v < s->reference->vertex_count; v++) {
    const double *B = l->graph.frames[v], normal[3] = {B[2], B[5], B[8]};
    for (uint32_t i = l->offsets[v]; i < l->offsets[v + 1]; i++) {
      double vector[3];
      spoke_vector(positions, v, &l->spokes[i], vector);
      coordinates[l->spokes[i].edge] = l->length_scale * sqrt(dot(vector, vector));
      coordinates[height_at(l, l->spokes[i].edge, (uint32_t)v)] = l->length_scale * dot(normal, vector);
    }
  }
  double *anchors = coordinates + 3 * E;
  frame_graph_put_anchors(&l->graph, s->turn, like ? like + 3 * E : NULL, anchors);
  surface_put_centres(s, positions, anchors + 3 * l->graph.part_count);
  return EXM_OK;
}

static exm_status decode(shape_space *space, const double *coordinates, double *positions)
{
  forms *l = space->state;
  surface *s = &l->whole;
  size_t const E = s->edges.count;
  for (size_t v = 0; v < s->reference->vertex_count; v++) {
    lay_out(l, (uint32_t)v, coordinates);
  }
  for (size_t e = 0; e < E; e++) {
    find_turn(l, e);
  }
  rotation_fit3(E, &l->graph.turns[0][0], &l->graph.turns[0][0]);
  frame_graph_take_anchors(&l->graph, s->turn, coordinates + 3 * E);
  TRY(frame_graph_solve(&l->graph));
  surface_begin(s);
  for (size_t f = 0; f < s->reference->triangle_count; f++) {
    const uint32_t *t = s->reference->triangles[f];
    double edges[9];
    for (size_t i = 0; i < 3; i++) {
      uint32_t const a = t[(i + 1) % 3], b = t[(i + 2) % 3];
      const double *forth = spoke_to(l, a, b), *back = spoke_to(l, b, a);
      for (size_t k = 0; k < 3; k++) { /* an edge is what its two ends say in the mean */
        edges[3 * i + k] = (dot(l->graph.frames[a] + 3 * k, forth) - dot(l->graph.frames[b] + 3 * k, back)) / 2;
      }
    }
    surface_add_face(s, f, edges);
  }
  surface_take_centres(s, coordinates + 3 * E + 3 * l->graph.part_count, l->centres);
  return surface_solve(s, l->centres, positions);
}

const shape_space_methods shape_space_linear_rotation_invariant = {.name = "linear rotation-invariant coordinates",
                                                                   .prepare = prepare,
                                                                   .encode = encode,
                                                                   .decode = decode,
                                                                   .release = release};
