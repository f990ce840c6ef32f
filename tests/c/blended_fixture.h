/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A bar that is bent, as a Blended deformer with point handles. */
#ifndef EXM_TESTS_BLENDED_FIXTURE_H
#define EXM_TESTS_BLENDED_FIXTURE_H

#include "harness.h"
#include "zoo.h"

enum { BAR_LENGTH = 10, BAR_SIDE = 2, BAR_HANDLES = 6, BAR_SHAPES = 4 };

typedef struct bent_bar {
  zoo_mesh shape;
  exm_mesh *mesh;
  float *exemplars; /* [BAR_SHAPES][V][3] */
  int32_t kinds[BAR_HANDLES];
  size_t offsets[BAR_HANDLES + 1];
  uint32_t vertices[BAR_HANDLES];
  exm_handles handles;
  double diagonal;
} bent_bar;

/** Shape s of the bar at x: bent about z by up to 1.2 s radians, and twisted. */
static inline void bar_bend(const float from[3], double bend, double twist, float to[3])
{
  double const u = (double)from[0] / BAR_LENGTH, angle = bend * u, roll = twist * u;
  double const y0 = (double)from[1] - BAR_SIDE / 2.0, z0 = (double)from[2] - BAR_SIDE / 2.0;
  double const y = y0 * cos(roll) - z0 * sin(roll), z = y0 * sin(roll) + z0 * cos(roll);
  double const radius = fabs(bend) > 1e-9 ? BAR_LENGTH / bend : 0;
  to[0] = (float)(radius != 0 ? (radius - y) * sin(angle) : (double)from[0]);
  to[1] = (float)(radius != 0 ? radius - (radius - y) * cos(angle) : y);
  to[2] = (float)z;
}

static inline uint32_t bar_nearest(const zoo_mesh *shape, double x, double y, double z)
{
  uint32_t best = 0;
  double least = INFINITY;
  for (size_t v = 0; v < shape->vertex_count; v++) {
    const float *p = shape->positions[v];
    double const a = (double)p[0] - x, b = (double)p[1] - y, c = (double)p[2] - z;
    double const distance = a * a + b * b + c * c;
    if (distance < least) {
      least = distance;
      best = (uint32_t)v;
    }
  }
  return best;
}

static inline bent_bar bar_make(void)
{
  static double const bends[BAR_SHAPES] = {0, 1.2, -0.9, 0.4}, twists[BAR_SHAPES] = {0, 0, 0.5, -0.8};
  bent_bar bar = {.shape = zoo_bar(BAR_LENGTH, BAR_SIDE)};
  size_t const V = bar.shape.vertex_count;
  bar.exemplars = test_array(BAR_SHAPES * V * 3, sizeof(float));
  for (size_t s = 0; s < BAR_SHAPES; s++) {
    for (size_t v = 0; v < V; v++) {
      bar_bend(bar.shape.positions[v], bends[s], twists[s], bar.exemplars + (s * V + v) * 3);
    }
  }
  CHECK(exm_mesh_create(bar.exemplars, V, &bar.shape.triangles[0][0], bar.shape.triangle_count, &bar.mesh) == EXM_OK);
  for (size_t h = 0; h < BAR_HANDLES; h++) {
    double const x = BAR_LENGTH * (double)(h / 2) / 2.0;
    bar.kinds[h] = EXM_HANDLE_PINNED;
    bar.offsets[h + 1] = h + 1;
    bar.vertices[h] = bar_nearest(&bar.shape, x, h % 2 ? 0 : BAR_SIDE, h % 2 ? 0 : (h / 2 == 1 ? 0 : BAR_SIDE));
  }
  bar.diagonal = sqrt(BAR_LENGTH * BAR_LENGTH + 2.0 * BAR_SIDE * BAR_SIDE);
  return bar;
}

/** After the bar has come to rest at its place in memory. */
static inline const exm_handles *bar_handles(bent_bar *bar)
{
  bar->handles = (exm_handles){
      .count = BAR_HANDLES, .kinds = bar->kinds, .vertex_offsets = bar->offsets, .vertices = bar->vertices};
  return &bar->handles;
}

static inline void bar_free(bent_bar *bar)
{
  exm_mesh_destroy(bar->mesh);
  free(bar->exemplars);
  zoo_free(&bar->shape);
}

/** Targets of single-vertex handles at a pose [V][3], moved by scale turn x + shift (turn about the axis (1, 2, 3)). */
static inline void bar_targets(const bent_bar *bar, const float *pose, double scale, double angle, double shift,
                               double *targets)
{
  double const n = sqrt(14.0), a[3] = {1 / n, 2 / n, 3 / n}, c = cos(angle), s = sin(angle);
  memset(targets, 0, BAR_HANDLES * 12 * sizeof(double));
  for (size_t h = 0; h < BAR_HANDLES; h++) {
    const float *p = pose + 3 * (size_t)bar->vertices[h];
    double const x[3] = {(double)p[0], (double)p[1], (double)p[2]};
    double const along = a[0] * x[0] + a[1] * x[1] + a[2] * x[2];
    double const cross[3] = {a[1] * x[2] - a[2] * x[1], a[2] * x[0] - a[0] * x[2], a[0] * x[1] - a[1] * x[0]};
    for (size_t k = 0; k < 3; k++) {
      targets[12 * h + 4 * k + k] = 1;
      targets[12 * h + 4 * k + 3] =
          scale * (c * x[k] + s * cross[k] + (1 - c) * along * a[k]) + shift * (double)(k + 1);
    }
  }
}

#endif
