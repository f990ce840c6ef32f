/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/shape_spaces/surface.h"

#include <math.h>
#include <string.h>

#include "base/simd.h"
#include "mesh/cotangents.h"

/* Height over length of a triangle below which its plane is not looked at: rounding of single precision has made it. */
static double const FLATTEST = 1e-6;

static void cross(const double a[3], const double b[3], double out[3])
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void surface_edge(const surface *s, size_t f, size_t i, double edge[3])
{
  const uint32_t *t = s->reference->triangles[f];
  for (int k = 0; k < 3; k++) {
    edge[k] = s->reference->positions[t[(i + 2) % 3]][k] - s->reference->positions[t[(i + 1) % 3]][k];
  }
}

/** Inverse of the matrix with columns a, b and their unit normal; zero where they span no plane. */
static void invert_frame(const double a[3], const double b[3], double inverse[9])
{
  double normal[3], u[3], v[3];
  cross(a, b, normal);
  double const squared = dot(normal, normal), longest = fmax(dot(a, a), dot(b, b));
  memset(inverse, 0, 9 * sizeof(double));
  if (!(squared > FLATTEST * FLATTEST * longest * longest)) {
    return;
  }
  cross(b, normal, u);
  cross(normal, a, v);
  for (int k = 0; k < 3; k++) { /* the rows of the inverse are the dual basis */
    inverse[k] = u[k] / squared;
    inverse[3 + k] = v[k] / squared;
    inverse[6 + k] = normal[k] / sqrt(squared);
  }
}

static exm_status measure(surface *s)
{
  const mesh *m = s->reference;
  double total = 0, squared = 0, centre[3] = {0};
  for (size_t f = 0; f < m->triangle_count; f++) {
    const uint32_t *t = m->triangles[f];
    double a[3], b[3];
    surface_edge(s, f, 2, a);
    surface_edge(s, f, 1, b);
    for (int k = 0; k < 3; k++) {
      b[k] = -b[k];
    }
    invert_frame(a, b, s->frames[f]);
    s->face_weights[f] = triangle_measure_of(m->positions[t[0]], m->positions[t[1]], m->positions[t[2]]).area;
    total += s->face_weights[f];
  }
  for (size_t f = 0; f < m->triangle_count; f++) { /* a point of a triangle has a weight that can be divided by */
    s->face_weights[f] = sqrt(fmax(s->face_weights[f] / total, 1e-12));
  }
  for (size_t i = 0; i < 3 * m->vertex_count; i++) {
    centre[i % 3] += m->positions[i / 3][i % 3] / (double)m->vertex_count;
  }
  for (size_t i = 0; i < 3 * m->vertex_count; i++) {
    double const away = m->positions[i / 3][i % 3] - centre[i % 3];
    squared += away * away;
  }
  s->turn = sqrt(squared);
  return EXM_OK;
}

/** The Laplacian with one vertex a part held: the right-hand sides have no part in what that decides, so any weight
 *  does. */
static exm_status factor(surface *s, arena *scratch)
{
  const mesh *m = s->reference;
  uint32_t last = 0;
  sparse laplacian;
  TRY(sparse_laplacian(scratch, m->vertex_count, m->triangle_count, (const uint32_t(*)[3])m->triangles,
                       (const double(*)[3])m->cotangents, &laplacian));
  for (size_t v = 0; v < m->vertex_count; v++) {
    s->counts[m->components[v]]++;
    if (m->components[v] == last) { /* numbered in the order of their lowest vertex */
      double *diagonal = &laplacian.values[laplacian.starts[v]];
      *diagonal = *diagonal > 0 ? 2 * *diagonal : 1;
      last++;
    }
  }
  return cholesky_create(&laplacian, &s->factor);
}

exm_status surface_create(arena *owner, const mesh *reference, surface *out)
{
  arena scratch = {0};
  *out = (surface){.reference = reference};
  out->right = ARENA_NEW(owner, double, 3 * reference->vertex_count);
  out->counts = ARENA_NEW(owner, double, reference->report.component_count);
  out->face_weights = ARENA_NEW(owner, double, reference->triangle_count);
  out->frames = arena_array(owner, reference->triangle_count, sizeof *out->frames);
  if (!out->right || !out->counts || !out->face_weights || !out->frames) {
    return status_no_memory("the shape space");
  }
  TRY(mesh_edges_find(owner, reference, &out->edges));
  TRY(face_order_find(owner, reference, &out->edges, &out->order));
  TRY(measure(out));
  exm_status const status = factor(out, &scratch);
  arena_release(&scratch);
  return status;
}

void surface_release(surface *s)
{
  cholesky_destroy(s->factor);
  s->factor = NULL;
}

/** The turn of smallest angle from the direction of a to that of b, times the ratio of their lengths. */
static void stretch_between(const double a[3], const double b[3], double out[9])
{
  double axis[3];
  double const la = sqrt(dot(a, a)), lb = sqrt(dot(b, b)), scale = la > 0 ? lb / la : 0;
  cross(a, b, axis);
  double const cosine = la * lb > 0 ? dot(a, b) / (la * lb) : 1, c = cosine > -1 + 1e-12 ? 1 / (1 + cosine) : 0;
  for (int k = 0; k < 3; k++) {
    axis[k] = la * lb > 0 ? axis[k] / (la * lb) : 0;
  }
  double const R[9] = {
      cosine + c * axis[0] * axis[0],  c * axis[0] * axis[1] - axis[2], c * axis[0] * axis[2] + axis[1],
      c * axis[0] * axis[1] + axis[2], cosine + c * axis[1] * axis[1],  c * axis[1] * axis[2] - axis[0],
      c * axis[0] * axis[2] - axis[1], c * axis[1] * axis[2] + axis[0], cosine + c * axis[2] * axis[2]};
  for (int k = 0; k < 9; k++) {
    out[k] = scale * R[k];
  }
}

/** A triangle without a plane: its longest edge is taken along, and nothing else is known. */
static void line_gradient(const surface *s, const float *positions, size_t f, double gradient[9])
{
  const uint32_t *t = s->reference->triangles[f];
  double edge[3], longest[3] = {0}, now[3] = {0};
  for (size_t i = 0; i < 3; i++) {
    surface_edge(s, f, i, edge);
    if (dot(edge, edge) > dot(longest, longest)) {
      memcpy(longest, edge, sizeof longest);
      vector_between(positions, t[(i + 1) % 3], t[(i + 2) % 3], now);
    }
  }
  stretch_between(longest, now, gradient);
}

void surface_gradient(const surface *s, const float *positions, size_t f, double gradient[9])
{
  const uint32_t *t = s->reference->triangles[f];
  const double *inverse = s->frames[f];
  double a[3], b[3], normal[3];
  if (inverse[6] == 0 && inverse[7] == 0 && inverse[8] == 0) {
    line_gradient(s, positions, f, gradient);
    return;
  }
  vector_between(positions, t[0], t[1], a);
  vector_between(positions, t[0], t[2], b);
  cross(a, b, normal);
  double const length = sqrt(dot(normal, normal));
  for (int i = 0; i < 3; i++) {
    double const n = length > 0 ? normal[i] / length : 0;
    for (int k = 0; k < 3; k++) {
      gradient[3 * i + k] = a[i] * inverse[k] + b[i] * inverse[3 + k] + n * inverse[6 + k];
    }
  }
}

void surface_begin(surface *s)
{
  memset(s->right, 0, 3 * s->reference->vertex_count * sizeof(double));
}

void surface_add_face(surface *s, size_t f, const double edges[9])
{
  const uint32_t *t = s->reference->triangles[f];
  const double *weights = s->reference->cotangents[f];
  for (size_t k = 0; k < 3; k++) { /* edge i pulls its end corner i + 2 and pushes its beginning, corner i + 1 */
    double const e0 = weights[0] * edges[k], e1 = weights[1] * edges[3 + k], e2 = weights[2] * edges[6 + k];
    s->right[3 * (size_t)t[0] + k] += e1 - e2;
    s->right[3 * (size_t)t[1] + k] += e2 - e0;
    s->right[3 * (size_t)t[2] + k] += e0 - e1;
  }
}

void surface_add_gradient(surface *s, size_t f, const double gradient[9])
{
  double edges[9], reference[3];
  for (size_t i = 0; i < 3; i++) {
    surface_edge(s, f, i, reference);
    for (size_t k = 0; k < 3; k++) {
      edges[3 * i + k] = dot(gradient + 3 * k, reference);
    }
  }
  surface_add_face(s, f, edges);
}

/** Scale to length one, or take `otherwise`. */
static void normalise(double a[3], double smallest, const double otherwise[3])
{
  double const length = sqrt(dot(a, a));
  for (int k = 0; k < 3; k++) {
    a[k] = length > smallest ? a[k] / length : otherwise[k];
  }
}

void surface_orthonormal(double axes[3][3])
{
  double const x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
  double const longest = sqrt(fmax(dot(axes[0], axes[0]), dot(axes[1], axes[1])));
  double other[3];
  normalise(axes[0], 0, x);
  cross(axes[0], axes[1], axes[2]);
  cross(axes[0], fabs(axes[0][0]) < 0.7 ? x : y, other);
  normalise(other, 0, y);
  normalise(axes[2], FLATTEST * FLATTEST * longest, other);
  cross(axes[2], axes[0], axes[1]);
}

exm_status surface_solve(surface *s, const double *centres, double *positions)
{
  const mesh *m = s->reference;
  size_t const parts = m->report.component_count;
  arena scratch = {0};
  double *shift = ARENA_NEW(&scratch, double, 3 * parts);
  exm_status status = shift ? cholesky_solve_rows(s->factor, 3, s->right) : status_no_memory("the shape space");
  if (status >= 0) {
    for (size_t i = 0; i < 3 * m->vertex_count; i++) {
      size_t const part = m->components[i / 3];
      shift[3 * part + i % 3] += s->right[i] / s->counts[part];
    }
    for (size_t i = 0; i < 3 * m->vertex_count; i++) {
      size_t const at = 3 * (size_t)m->components[i / 3] + i % 3;
      positions[i] = s->right[i] - shift[at] + centres[at];
    }
  }
  arena_release(&scratch);
  return status;
}

void surface_put_centres(const surface *s, const float *positions, double *coordinates)
{
  const mesh *m = s->reference;
  memset(coordinates, 0, 3 * m->report.component_count * sizeof(double));
  for (size_t i = 0; i < 3 * m->vertex_count; i++) {
    size_t const part = m->components[i / 3];
    coordinates[3 * part + i % 3] += (double)positions[i] / sqrt(s->counts[part]);
  }
}

void surface_take_centres(const surface *s, const double *coordinates, double *centres)
{
  for (size_t i = 0; i < 3 * s->reference->report.component_count; i++) {
    centres[i] = coordinates[i] / sqrt(s->counts[i / 3]);
  }
}

double surface_length_scale(const surface *s)
{
  double squared = 0;
  for (size_t e = 0; e < s->edges.count; e++) {
    const uint32_t *ends = s->edges.edges[e].ends;
    for (int k = 0; k < 3; k++) {
      double const d = s->reference->positions[ends[1]][k] - s->reference->positions[ends[0]][k];
      squared += d * d;
    }
  }
  return s->turn / sqrt(squared);
}

float *surface_positions(const surface *s, arena *owner)
{
  size_t const count = 3 * s->reference->vertex_count;
  float *positions = ARENA_NEW(owner, float, count);
  for (size_t i = 0; i < count && positions; i++) {
    positions[i] = (float)s->reference->positions[i / 3][i % 3];
  }
  return positions;
}
