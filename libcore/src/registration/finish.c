/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The full-resolution finish: as-rigid-as-possible [Rigidity, eq. 1 with r = 1 and eq. 2's weights], the fitted pose at
 * rest, with what is seen of the scan as soft constraints,
 *
 *     E = 1/2 sum_i sum_(j in N(i)) w_ij |(p'_i - p'_j) - R_i (p_i - p_j)|^2 + sum_i m_i |p'_i - y_i|^2,
 *
 * y_i where the scan's surface lies along its normal from p'_i. Vertices without a counterpart have m_i = 0 but for a
 * trace that keeps the matrix definite: they follow rigidly, and nothing is invented there. */
#include "registration/finish.h"

#include <math.h>
#include <string.h>

#include "linalg/cholesky.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"
#include "mesh/cotangents.h"
#include "mesh/triangle.h"

/* Detail of the scan finer than this share of the mesh's size is smoothed, at detail 1. */
static double const FINEST = 0.012;
/* How far the scan may be from the pose that the dictionary has reached. */
static double const REACH = 0.06;
static double const TRACE = 1e-7;
enum { ROUNDS = 6, REFACTORED = 3 };

typedef struct finish {
  const shape *surface;
  const fit_request *request;
  double size, reach;
  double (*rest)[3];       /* [V] */
  double (*cotangents)[3]; /* [F] none negative */
  double *moments;         /* [V][3][3], then rotations */
  double *weights;         /* [V] m */
  double (*targets)[3];    /* [V] y */
  double *right;           /* [V][3] */
  uint32_t *found;         /* [V] */
  double *squared;         /* [V] */
  int32_t *diagonal;       /* [V] places of the diagonal in the matrix */
  double *own;             /* [V] what stands there without the m */
  sparse matrix;
  cholesky *factor;
} finish;

static void measure(finish *f)
{
  const mesh *m = f->surface->r->reference;
  for (size_t t = 0; t < m->triangle_count; t++) {
    const uint32_t *corners = m->triangles[t];
    triangle_measure const own = triangle_measure_of(f->rest[corners[0]], f->rest[corners[1]], f->rest[corners[2]]);
    for (int c = 0; c < 3; c++) {
      f->cotangents[t][c] = fmax(own.cotangents[c], 0);
    }
  }
}

static exm_status allocate(arena *owner, finish *f)
{
  size_t const V = f->surface->r->reference->vertex_count, F = f->surface->r->reference->triangle_count;
  f->rest = arena_array(owner, V, sizeof *f->rest);
  f->cotangents = arena_array(owner, F, sizeof *f->cotangents);
  f->moments = ARENA_NEW(owner, double, 9 * V);
  f->weights = ARENA_NEW(owner, double, V);
  f->targets = arena_array(owner, V, sizeof *f->targets);
  f->right = ARENA_NEW(owner, double, 3 * V);
  f->found = ARENA_NEW(owner, uint32_t, V);
  f->squared = ARENA_NEW(owner, double, V);
  f->diagonal = ARENA_NEW(owner, int32_t, V);
  f->own = ARENA_NEW(owner, double, V);
  return f->rest && f->cotangents && f->moments && f->weights && f->targets && f->right && f->found && f->squared &&
                 f->diagonal && f->own
             ? EXM_OK
             : status_no_memory("the finish");
}

static exm_status prepare(arena *owner, finish *f)
{
  const mesh *m = f->surface->r->reference;
  size_t const V = m->vertex_count;
  TRY(allocate(owner, f));
  memcpy(f->rest, f->surface->positions, V * sizeof *f->rest);
  measure(f);
  TRY(sparse_laplacian(owner, V, m->triangle_count, (const uint32_t(*)[3])m->triangles,
                       (const double(*)[3])f->cotangents, &f->matrix));
  for (size_t v = 0; v < V; v++) {
    f->diagonal[v] = f->matrix.starts[v]; /* rows rise, and this is the lower triangle */
    f->own[v] = f->matrix.values[f->diagonal[v]] + TRACE;
  }
  return EXM_OK;
}

/** Where the scan's surface is nearest to a point: on the triangles around its nearest point, or in that one's tangent
 *  plane. */
static void scan_foot(const scan *s, uint32_t point, const double from[3], double out[3])
{
  double least = INFINITY, weights[3];
  const double *normal = s->normals[point];
  if (s->triangle_count == 0) {
    double height = 0;
    for (size_t k = 0; k < 3; k++) {
      height += normal[k] * (s->points[point][k] - from[k]);
    }
    int const is_known = normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
    for (size_t k = 0; k < 3; k++) {
      out[k] = is_known ? from[k] + height * normal[k] : s->points[point][k];
    }
    return;
  }
  memcpy(out, s->points[point], 3 * sizeof *out);
  for (uint32_t i = s->ways->offsets[point]; i < s->ways->offsets[point + 1]; i++) {
    const uint32_t *t = s->triangles[s->ways->faces[i]];
    double const squared = triangle_nearest(s->points[t[0]], s->points[t[1]], s->points[t[2]], from, weights);
    if (squared < least) {
      least = squared;
      for (size_t k = 0; k < 3; k++) {
        out[k] = weights[0] * s->points[t[0]][k] + weights[1] * s->points[t[1]][k] + weights[2] * s->points[t[2]][k];
      }
    }
  }
}

/** Counterparts of all vertices; `is_weighing`: their weights as well, which the matrix has to learn. */
static void correspond(finish *f, int is_weighing)
{
  const registration *r = f->surface->r;
  const scan *s = f->request->target;
  size_t const V = r->reference->vertex_count;
  double const stiffness = f->request->settings.detail / (FINEST * FINEST * f->size * f->size);
  nearest_filter const filter = {.normals = (const double(*)[3])s->normals,
                                 .least_cosine = cos(f->request->settings.max_angle * M_PI / 180),
                                 .is_unsigned = !s->report.signed_normals};
  nearest_find(&s->tree, (const double(*)[3])f->surface->positions, V, (const double(*)[3])f->surface->normals, &filter,
               f->reach, f->request->settings.thread_count, f->found, f->squared);
  double const share = f->size * f->size / (r->size * r->size);
  for (size_t v = 0; v < V; v++) {
    uint32_t const point = f->found[v];
    int const is_seen = point != NEAREST_NONE && !s->boundary[point];
    memcpy(f->targets[v], f->surface->positions[v], sizeof *f->targets);
    if (is_seen) {
      scan_foot(s, point, f->surface->positions[v], f->targets[v]);
    }
    if (is_weighing) {
      double const t = is_seen ? 1 - f->squared[v] / (f->reach * f->reach) : 0;
      f->weights[v] = t > 0 ? stiffness * r->areas[v] * share * t * t : 0;
    }
  }
}

static exm_status factor(finish *f)
{
  for (size_t v = 0; v < f->matrix.size; v++) {
    f->matrix.values[f->diagonal[v]] = f->own[v] + f->weights[v];
  }
  return f->factor ? cholesky_refactor(f->factor, &f->matrix) : cholesky_create(&f->matrix, &f->factor);
}

/** Rotations into f->moments. */
static void local_step(finish *f)
{
  const mesh *m = f->surface->r->reference;
  const double(*p)[3] = (const double(*)[3])f->surface->positions;
  memset(f->moments, 0, 9 * m->vertex_count * sizeof *f->moments);
  for (size_t t = 0; t < m->triangle_count; t++) {
    for (int c = 0; c < 3; c++) {
      size_t const i = m->triangles[t][(c + 1) % 3], j = m->triangles[t][(c + 2) % 3];
      double const w = f->cotangents[t][c];
      for (size_t k = 0; k < 9; k++) {
        double const product = w * (p[i][k / 3] - p[j][k / 3]) * (f->rest[i][k % 3] - f->rest[j][k % 3]);
        f->moments[9 * i + k] += product;
        f->moments[9 * j + k] += product;
      }
    }
  }
  rotation_fit3(m->vertex_count, f->moments, f->moments);
}

static exm_status global_step(finish *f, double (*positions)[3])
{
  const mesh *m = f->surface->r->reference;
  size_t const V = m->vertex_count;
  for (size_t i = 0; i < 3 * V; i++) {
    f->right[i] = f->weights[i / 3] * f->targets[i / 3][i % 3] + TRACE * f->rest[i / 3][i % 3];
  }
  for (size_t t = 0; t < m->triangle_count; t++) {
    for (int c = 0; c < 3; c++) {
      size_t const i = m->triangles[t][(c + 1) % 3], j = m->triangles[t][(c + 2) % 3];
      double const w = f->cotangents[t][c] / 2;
      for (size_t a = 0; a < 3; a++) {
        double sum = 0;
        for (size_t b = 0; b < 3; b++) {
          sum += (f->moments[9 * i + 3 * a + b] + f->moments[9 * j + 3 * a + b]) * (f->rest[i][b] - f->rest[j][b]);
        }
        f->right[3 * i + a] += w * sum;
        f->right[3 * j + a] -= w * sum;
      }
    }
  }
  TRY(cholesky_solve_rows(f->factor, 3, f->right));
  memcpy(positions, f->right, V * sizeof *positions);
  return EXM_OK;
}

exm_status finish_shape(shape *surface, const fit_request *request, double scale, const progress *report)
{
  arena scratch = {0};
  finish f = {.surface = surface, .request = request, .size = surface->r->size * scale};
  f.reach = fmax(REACH * f.size, 2 * request->target->report.spacing);
  exm_status status = prepare(&scratch, &f);
  for (int i = 0; i < ROUNDS && status == EXM_OK; i++) {
    int const is_weighing = i % REFACTORED == 0;
    correspond(&f, is_weighing);
    if ((is_weighing && (status = factor(&f)) < 0)) {
      break;
    }
    local_step(&f);
    if ((status = global_step(&f, surface->positions)) < 0 || (status = shape_refresh(surface)) < 0) {
      break;
    }
    status = progress_report(report, (double)(i + 1) / ROUNDS, "reaching for detail");
  }
  cholesky_destroy(f.factor);
  arena_release(&scratch);
  return status;
}
