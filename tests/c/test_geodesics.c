/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Geodesic discs: exact in the plane, converging on the sphere, a little long in clouds. */
#include "mesh/geodesics.h"

#include "harness.h"
#include "mesh/normals.h"
#include "mesh/triangle.h"
#include "zoo.h"

typedef struct ground {
  arena memory;
  geodesics ways;
  double (*positions)[3];
} ground;

static void ground_create(const zoo_mesh *m, ground *g)
{
  *g = (ground){.positions = test_array(m->vertex_count, sizeof *g->positions)};
  for (size_t i = 0; i < 3 * m->vertex_count; i++) {
    g->positions[i / 3][i % 3] = (double)m->positions[i / 3][i % 3];
  }
  CHECK(geodesics_create(&g->memory, (const double(*)[3])g->positions, m->vertex_count,
                         (const uint32_t(*)[3])m->triangles, m->triangle_count, &g->ways) == EXM_OK);
}

static void ground_free(ground *g)
{
  arena_release(&g->memory);
  free(g->positions);
}

static double straight(const double a[3], const double b[3])
{
  return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

TEST(the_plane_is_exact)
{
  zoo_mesh grid = zoo_grid(20, 30, 2, 3);
  ground g;
  ground_create(&grid, &g);
  for (uint32_t source = 0; source < grid.vertex_count; source += 97) {
    size_t within = 0;
    geodesics_disc(&g.ways, source, 1.1);
    for (size_t v = 0; v < grid.vertex_count; v++) {
      double const distance = straight(g.positions[source], g.positions[v]);
      within += distance < 1.1 - 1e-9;
      if (distance < 1.1 - 1e-6) {
        CHECK_NEAR(g.ways.distances[v], distance, 1e-6);
      }
    }
    CHECK(g.ways.count >= within);
  }
  ground_free(&g);
  zoo_free(&grid);
}

TEST(a_sphere_is_approached)
{
  double worst[2];
  for (int level = 0; level < 2; level++) {
    zoo_mesh sphere = zoo_sphere(3 + level);
    ground g;
    ground_create(&sphere, &g);
    worst[level] = 0;
    geodesics_disc(&g.ways, 5, 2.5);
    for (size_t i = 0; i < g.ways.count; i++) {
      uint32_t const v = g.ways.vertices[i];
      double const arc = 2 * asin(straight(g.positions[5], g.positions[v]) / 2);
      worst[level] = fmax(worst[level], fabs(g.ways.distances[v] - arc));
    }
    CHECK(g.ways.count < sphere.vertex_count);
    ground_free(&g);
    zoo_free(&sphere);
  }
  CHECK(worst[0] < 0.05);
  CHECK(worst[1] < 0.6 * worst[0]);
  test_about("%g %g", worst[0], worst[1]);
}

TEST(discs_do_not_cross_gaps_and_forget_the_last)
{
  size_t count, at = 0;
  const zoo_mesh *all = zoo(&count);
  while (at < count && (all[at].components != 2 || all[at].loose_vertices > 0)) {
    at++;
  }
  REQUIRE(at < count);
  const zoo_mesh *two = &all[at];
  ground g;
  ground_create(two, &g);
  geodesics_disc(&g.ways, 0, 1e9);
  size_t const first = g.ways.count;
  CHECK(first > 1 && first < two->vertex_count);
  geodesics_disc(&g.ways, 0, 0);
  CHECK(g.ways.count == 1 && g.ways.vertices[0] == 0);
  for (size_t v = 1; v < two->vertex_count; v++) {
    CHECK(isinf(g.ways.distances[v]));
  }
  geodesics_disc(&g.ways, 0, 1e9);
  CHECK(g.ways.count == first);
  ground_free(&g);
}

TEST(clouds_follow_their_graph)
{
  double const points[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {5, 5, 5}};
  uint32_t const neighbors[4][2] = {{1, UINT32_MAX}, {0, 2}, {1, UINT32_MAX}, {UINT32_MAX, UINT32_MAX}};
  arena memory = {0};
  geodesics ways;
  REQUIRE(geodesics_create_cloud(&memory, points, 4, &neighbors[0][0], 2, &ways) == EXM_OK);
  geodesics_disc(&ways, 0, 10);
  CHECK(ways.count == 3);
  CHECK_NEAR(ways.distances[2], 2, 1e-15);
  CHECK(isinf(ways.distances[3]));
  arena_release(&memory);
}

/** The place on a triangle by walking over it. */
static double by_walking(double p[3][3], const double query[3])
{
  enum { STEPS = 200 };
  double least = INFINITY;
  for (int i = 0; i <= STEPS; i++) {
    for (int j = 0; i + j <= STEPS; j++) {
      double at[3];
      for (int k = 0; k < 3; k++) {
        at[k] = (p[0][k] * i + p[1][k] * j + p[2][k] * (STEPS - i - j)) / STEPS;
      }
      least = fmin(least, straight(at, query));
    }
  }
  return least;
}

TEST(the_nearest_place_on_a_triangle)
{
  test_random random = {11};
  for (int round = 0; round < 300; round++) {
    test_about("round %d", round);
    double p[3][3], query[3], weights[3], at[3] = {0};
    for (int k = 0; k < 9; k++) {
      p[k / 3][k % 3] = test_uniform(&random);
    }
    for (int k = 0; k < 3; k++) {
      query[k] = 3 * test_uniform(&random) - 1;
      p[2][k] = round % 10 == 0 ? p[0][k] : p[2][k];               /* an edge */
      p[1][k] = round % 30 == 0 ? p[0][k] : p[1][k];               /* a point */
      p[2][k] = round % 10 == 1 ? 2 * p[1][k] - p[0][k] : p[2][k]; /* on a line */
    }
    double const squared = triangle_nearest(p[0], p[1], p[2], query, weights);
    CHECK_NEAR(weights[0] + weights[1] + weights[2], 1, 1e-12);
    for (int c = 0; c < 3; c++) {
      CHECK(weights[c] >= 0);
      for (int k = 0; k < 3; k++) {
        at[k] += weights[c] * p[c][k];
      }
    }
    CHECK_NEAR(sqrt(squared), straight(at, query), 1e-9);
    double const walked = by_walking(p, query);
    CHECK(sqrt(squared) <= walked + 1e-9 && sqrt(squared) >= walked - 0.02);
  }
}

TEST(normals_of_a_sphere_point_outward)
{
  zoo_mesh sphere = zoo_sphere(4);
  ground g;
  ground_create(&sphere, &g);
  double(*normals)[3] = test_array(sphere.vertex_count, sizeof *normals);
  mesh_vertex_normals((const double(*)[3])g.positions, sphere.vertex_count, (const uint32_t(*)[3])sphere.triangles,
                      sphere.triangle_count, normals);
  for (size_t v = 0; v < sphere.vertex_count; v++) {
    CHECK_NEAR(straight(normals[v], g.positions[v]), 0, 0.01);
  }
  free(normals);
  ground_free(&g);
  zoo_free(&sphere);
}
