/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Small bound meshes for the tests of AMRAP: a mesh of the zoo or its makers, exemplars made from it by formula, and
 * handles. Functions are inline so that a test may leave some of them unused. */
#ifndef EXM_TESTS_AMRAP_FIXTURE_H
#define EXM_TESTS_AMRAP_FIXTURE_H

#include "harness.h"
#include "zoo.h"

enum { FIXTURE_HANDLES = 128, FIXTURE_HELD = 1024 };

typedef struct fixture {
  zoo_mesh shape;
  exm_mesh *reference;
  size_t vertex_count, exemplar_count;
  float *exemplars; /* [S][V][3] */
  double diagonal;
  size_t handle_count;
  int32_t kinds[FIXTURE_HANDLES];
  size_t offsets[FIXTURE_HANDLES + 1];
  uint32_t vertices[FIXTURE_HELD];
  exm_amrap_bind_settings settings;
  exm_deformer *deformer;
} fixture;

static inline double fixture_diagonal(const float *positions, size_t vertex_count)
{
  double square = 0;
  for (size_t k = 0; k < 3; ++k) {
    double low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < vertex_count; ++v) {
      low = fmin(low, (double)positions[3 * v + k]);
      high = fmax(high, (double)positions[3 * v + k]);
    }
    square += (high - low) * (high - low);
  }
  return sqrt(square);
}

/* How exemplar s bends, twists and swells; exemplar 0 is the reference. In the plane where is_planar. */
static inline void fixture_pose(size_t s, int is_planar, const float from[3], double size, float to[3])
{
  double const x = (double)from[0] / size, y = (double)from[1] / size, z = (double)from[2] / size;
  double const k = (double)s, bend = s ? 1.3 * sin(1.7 * k) : 0, twist = s && !is_planar ? 1.1 * cos(2.3 * k) : 0;
  double const puff = s ? 1 + 0.35 * sin(3.1 * k) : 1, wave = s && !is_planar ? 0.06 * sin(5 * k) : 0;
  double const swell = 1 + (puff - 1) * sin(M_PI * fmin(fmax(x, 0), 1));
  double const cosine = cos(twist * x), sine = sin(twist * x);
  double const b = swell * (cosine * y - sine * z), c = swell * (sine * y + cosine * z) + wave * sin(9 * x + 4 * y);
  double const turn = bend * x, radius = fabs(bend) > 1e-9 ? 1 / bend : 0;
  double const along = radius != 0 ? (radius - b) * sin(turn) : x;
  double const across = radius != 0 ? radius - (radius - b) * cos(turn) : b;
  to[0] = (float)(size * along);
  to[1] = (float)(size * across);
  to[2] = (float)(size * c);
}

/* `shape` now belongs to the fixture. */
static inline fixture *fixture_new(zoo_mesh shape, size_t exemplar_count, int is_planar)
{
  fixture *f = test_array(1, sizeof *f);
  f->shape = shape;
  f->vertex_count = shape.vertex_count;
  f->exemplar_count = exemplar_count;
  f->exemplars = test_array(exemplar_count * f->vertex_count * 3, sizeof(float));
  f->diagonal = fixture_diagonal(shape.positions[0], f->vertex_count);
  for (size_t s = 0; s < exemplar_count; ++s) {
    for (size_t v = 0; v < f->vertex_count; ++v) {
      fixture_pose(s, is_planar, shape.positions[v], f->diagonal, f->exemplars + (s * f->vertex_count + v) * 3);
    }
  }
  exm_amrap_bind_settings_init(&f->settings);
  return f;
}

static inline fixture *fixture_bar(size_t exemplar_count)
{
  return fixture_new(zoo_bar(8, 2), exemplar_count, 0);
}

static inline fixture *fixture_grid(size_t exemplar_count)
{
  return fixture_new(zoo_grid(12, 6, 2, 1), exemplar_count, 1);
}

/* Multiply every exemplar by a matrix, and move it. */
static inline void fixture_move(fixture *f, const double matrix[3][3], const double offset[3])
{
  for (size_t i = 0; i < f->exemplar_count * f->vertex_count; ++i) {
    float *p = f->exemplars + 3 * i;
    double const x[3] = {(double)p[0], (double)p[1], (double)p[2]};
    for (int k = 0; k < 3; ++k) {
      p[k] = (float)(matrix[k][0] * x[0] + matrix[k][1] * x[1] + matrix[k][2] * x[2] + offset[k]);
    }
  }
}

static inline void fixture_handle(fixture *f, exm_handle_kind kind, size_t count, const uint32_t *vertices)
{
  size_t const first = f->offsets[f->handle_count];
  memcpy(f->vertices + first, vertices, count * sizeof *vertices);
  f->kinds[f->handle_count++] = (int32_t)kind;
  f->offsets[f->handle_count] = first + count;
}

static inline int fixture_is_held(const fixture *f, uint32_t vertex)
{
  int found = 0;
  for (size_t i = 0; i < f->offsets[f->handle_count]; ++i) {
    found |= f->vertices[i] == vertex;
  }
  return found;
}

/* The unheld vertex that is closest to a point of the reference's bounding box, in shares of the diagonal from its
 * lowest corner; with the vertices that share a triangle with it where is_patch. */
static inline void fixture_handle_near(fixture *f, exm_handle_kind kind, double x, double y, double z, int is_patch)
{
  double low[3] = {INFINITY, INFINITY, INFINITY}, best = INFINITY;
  double const at[3] = {x, y, z};
  uint32_t chosen[64] = {0};
  size_t count = 1;
  for (size_t v = 0; v < f->vertex_count; ++v) {
    for (int k = 0; k < 3; ++k) {
      low[k] = fmin(low[k], (double)f->shape.positions[v][k]);
    }
  }
  for (uint32_t v = 0; v < f->vertex_count; ++v) {
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      double const d = ((double)f->shape.positions[v][k] - low[k]) / f->diagonal - at[k];
      square += d * d;
    }
    if (square < best && !fixture_is_held(f, v)) {
      best = square;
      chosen[0] = v;
    }
  }
  for (size_t t = 0; t < f->shape.triangle_count && is_patch; ++t) {
    const uint32_t *corners = f->shape.triangles[t];
    if (corners[0] != chosen[0] && corners[1] != chosen[0] && corners[2] != chosen[0]) {
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      int is_new = !fixture_is_held(f, corners[k]);
      for (size_t i = 0; i < count; ++i) {
        is_new &= chosen[i] != corners[k];
      }
      if (is_new && count < 64) {
        chosen[count++] = corners[k];
      }
    }
  }
  fixture_handle(f, kind, count, chosen);
}

/* Two ends, a middle and a side: enough to hold a pose in space. */
static inline void fixture_usual_handles(fixture *f, exm_handle_kind kind, int is_patch)
{
  fixture_handle_near(f, kind, 0, 0, 0, is_patch);
  fixture_handle_near(f, kind, 1, 0.1, 0.1, is_patch);
  fixture_handle_near(f, kind, 0.45, 0.3, 0, is_patch);
  fixture_handle_near(f, kind, 0.05, 0.3, 0.25, is_patch);
  fixture_handle_near(f, kind, 0.9, 0.4, 0.3, is_patch);
}

static inline exm_handles fixture_handles(const fixture *f)
{
  return (exm_handles){
      .count = f->handle_count, .kinds = f->kinds, .vertex_offsets = f->offsets, .vertices = f->vertices};
}

/* Exemplar 0 is the reference. False, and a failure in the harness's books, where binding fails. */
static inline int fixture_bind(fixture *f)
{
  exm_handles const handles = fixture_handles(f);
  exm_status status =
      exm_mesh_create(f->exemplars, f->vertex_count, f->shape.triangles[0], f->shape.triangle_count, &f->reference);
  f->diagonal = fixture_diagonal(f->exemplars, f->vertex_count);
  if (status >= 0) {
    status = exm_amrap_create(f->reference, f->exemplars, f->exemplar_count, &handles, &f->settings, NULL, NULL,
                              &f->deformer);
  }
  if (status < 0) {
    test_fail(__FILE__, __LINE__, "binding returned %d: %s", status, exm_last_error());
  }
  return status >= 0;
}

static inline void fixture_free(fixture *f)
{
  exm_deformer_destroy(f->deformer);
  exm_mesh_destroy(f->reference);
  zoo_free(&f->shape);
  free(f->exemplars);
  free(f);
}

static inline double *fixture_targets(const fixture *f)
{
  return test_array(f->handle_count * 12, sizeof(double));
}

static inline double *fixture_positions(const fixture *f)
{
  double *positions = test_array(3 * f->vertex_count, sizeof *positions);
  CHECK_STATUS(exm_deformer_positions_f64(f->deformer, positions), EXM_OK);
  return positions;
}

/* Solve and read the positions; free them. */
static inline double *fixture_solve(const fixture *f, const double *targets, const exm_amrap_solve_settings *settings,
                                    exm_solve_report *report)
{
  CHECK(exm_amrap_solve(f->deformer, targets, settings, report) >= 0);
  return fixture_positions(f);
}

/* Largest distance of two sets of points. NaN where there is one. */
static inline double fixture_distance(size_t count, const double *a, const double *b)
{
  double worst = 0;
  for (size_t v = 0; v < count; ++v) {
    double square = 0;
    for (size_t k = 0; k < 3; ++k) {
      square += (a[3 * v + k] - b[3 * v + k]) * (a[3 * v + k] - b[3 * v + k]);
    }
    worst = sqrt(square) <= worst ? worst : sqrt(square);
  }
  return worst;
}

static inline double fixture_distance_to_exemplar(const fixture *f, size_t s, const double *positions)
{
  double *exemplar = test_array(3 * f->vertex_count, sizeof *exemplar);
  for (size_t i = 0; i < 3 * f->vertex_count; ++i) {
    exemplar[i] = (double)f->exemplars[s * 3 * f->vertex_count + i];
  }
  double const distance = fixture_distance(f->vertex_count, positions, exemplar);
  free(exemplar);
  return distance;
}

/* Targets between exemplars s and t, and `noise` off, in diagonals; linear parts stay those of the mixture. */
static inline void fixture_mix(const fixture *f, size_t s, size_t t, double share, double noise, test_random *random,
                               double *targets)
{
  double *other = fixture_targets(f);
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, s, targets), EXM_OK);
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, t, other), EXM_OK);
  for (size_t i = 0; i < 12 * f->handle_count; ++i) {
    targets[i] = (1 - share) * targets[i] + share * other[i];
    if (i % 4 == 3) {
      targets[i] += noise * f->diagonal * (2 * test_uniform(random) - 1);
    }
  }
  free(other);
}

/* A rotation by an angle about an axis. */
static inline void fixture_rotation(double x, double y, double z, double angle, double out[3][3])
{
  double const length = sqrt(x * x + y * y + z * z), n[3] = {x / length, y / length, z / length};
  double const cosine = cos(angle), sine = sin(angle);
  double const cross[3][3] = {{0, -n[2], n[1]}, {n[2], 0, -n[0]}, {-n[1], n[0], 0}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      out[i][j] = cosine * (i == j) + (1 - cosine) * n[i] * n[j] + sine * cross[i][j];
    }
  }
}

/* p -> R p + t of points, and of targets. */
static inline void fixture_move_points(size_t count, const double R[3][3], const double t[3], double *points)
{
  for (size_t v = 0; v < count; ++v) {
    double const p[3] = {points[3 * v], points[3 * v + 1], points[3 * v + 2]};
    for (size_t k = 0; k < 3; ++k) {
      points[3 * v + k] = R[k][0] * p[0] + R[k][1] * p[1] + R[k][2] * p[2] + t[k];
    }
  }
}

static inline void fixture_move_targets(const fixture *f, const double R[3][3], const double t[3], double *targets)
{
  for (size_t h = 0; h < f->handle_count; ++h) {
    double before[12], *after = targets + 12 * h;
    memcpy(before, after, sizeof before);
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 4; ++j) {
        after[4 * i + j] = j == 3 ? t[i] : 0;
        for (size_t k = 0; k < 3; ++k) {
          after[4 * i + j] += R[i][k] * before[4 * k + j];
        }
      }
    }
  }
}

#endif
