/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laplace-Beltrami eigenfunctions: residuals, orthonormality, spectra that are known. */
#include "allocation.h"
#include "harness.h"
#include "linalg/sparse.h"
#include "mesh/mesh.h"
#include "zoo.h"

/** Largest residual |L f - lambda M f| in the norm of 1/M, beside the largest eigenvalue; and of F M F' - 1. */
static void check_pairs(const exm_mesh *surface, size_t count, const double *values, const double *functions)
{
  size_t const V = surface->vertex_count;
  arena scratch = {0};
  sparse lower, whole;
  double *image = ARENA_NEW(&scratch, double, count *V);
  CHECK(sparse_laplacian(&scratch, V, surface->triangle_count, (const uint32_t(*)[3])surface->triangles,
                         (const double(*)[3])surface->cotangents, &lower) == EXM_OK);
  CHECK(sparse_whole(&scratch, &lower, &whole) == EXM_OK);
  sparse_multiply(&whole, count, functions, image);
  for (size_t i = 0; i < count; i++) {
    double residual = 0;
    for (size_t v = 0; v < V; v++) {
      double const wrong = image[i * V + v] - values[i] * surface->masses[v] * functions[i * V + v];
      residual += wrong * wrong / surface->masses[v];
    }
    CHECK_NEAR(sqrt(residual), 0, 1e-7 * (values[count - 1] + 1e-6));
    for (size_t j = 0; j <= i; j++) {
      double product = 0;
      for (size_t v = 0; v < V; v++) {
        product += surface->masses[v] * functions[i * V + v] * functions[j * V + v];
      }
      CHECK_NEAR(product, i == j, 1e-9);
    }
    CHECK(i == 0 || values[i] >= values[i - 1]);
  }
  arena_release(&scratch);
}

static void check_mesh(exm_mesh *surface, size_t count, double *values)
{
  double *functions = test_array(count * surface->vertex_count, sizeof(double));
  CHECK(exm_weights_eigenfunctions(surface, count, NULL, NULL, values, functions) == EXM_OK);
  check_pairs(surface, count, values, functions);
  for (size_t v = 1; v < surface->vertex_count; v++) {
    CHECK_NEAR(functions[v], functions[0], 1e-12 * fabs(functions[0]));
  }
  free(functions);
}

TEST(pairs_of_the_zoo)
{
  size_t count;
  double values[8];
  const zoo_mesh *all = zoo(&count);
  for (size_t i = 0; i < count; i++) {
    test_about("%s", all[i].name);
    exm_mesh *surface = NULL;
    CHECK(exm_mesh_create(&all[i].positions[0][0], all[i].vertex_count, &all[i].triangles[0][0], all[i].triangle_count,
                          &surface) >= EXM_OK ||
          !all[i].sound);
    if (surface && surface->report.degenerate_face_count == 0) {
      check_mesh(surface, surface->vertex_count < 8 ? surface->vertex_count : 8, values);
      for (size_t c = 0; c < surface->report.component_count && c < 8 && c < surface->vertex_count; c++) {
        CHECK_NEAR(values[c], 0, 1e-12);
      }
    }
    exm_mesh_destroy(surface);
  }
  test_about(NULL);
}

TEST(the_sphere_has_multiple_eigenvalues)
{
  double values[16];
  zoo_mesh sphere = zoo_sphere(4); /* sparse: 2562 vertices */
  exm_mesh *surface = zoo_create(&sphere);
  REQUIRE(surface != NULL);
  check_mesh(surface, 16, values);
  for (size_t i = 0; i < 16; i++) {
    double const l = floor(sqrt((double)i)); /* l (l + 1), 2 l + 1 times */
    CHECK_NEAR(values[i], l * (l + 1), 0.01 * (l * (l + 1)) + 1e-9);
  }
  exm_mesh_destroy(surface);
  zoo_free(&sphere);
}

TEST(the_rectangle_has_cosines)
{
  double values[6];
  double const expected[6] = {0, 0.25, 1, 1, 1.25, 2}; /* (m / 2)^2 + n^2, times pi^2 */
  zoo_mesh grid = zoo_grid(80, 40, 2, 1);
  exm_mesh *surface = zoo_create(&grid);
  REQUIRE(surface != NULL);
  check_mesh(surface, 6, values);
  for (size_t i = 0; i < 6; i++) {
    CHECK_NEAR(values[i] / (M_PI * M_PI), expected[i], 0.01);
  }
  exm_mesh_destroy(surface);
  zoo_free(&grid);
}

TEST(parts_are_known_and_equal_ones_do_not_confuse)
{
  double values[11];
  zoo_mesh sphere = zoo_sphere(3);
  size_t const V = sphere.vertex_count, F = sphere.triangle_count;
  float *positions = test_array(3 * V * 3, sizeof(float));
  uint32_t *triangles = test_array(3 * F * 3, sizeof(uint32_t));
  for (size_t part = 0; part < 3; part++) {
    for (size_t v = 0; v < 3 * V; v++) {
      positions[part * 3 * V + v] = (&sphere.positions[0][0])[v] + 4 * (float)part;
    }
    for (size_t t = 0; t < 3 * F; t++) {
      triangles[part * 3 * F + t] = (&sphere.triangles[0][0])[t] + (uint32_t)(part * V);
    }
  }
  exm_mesh *surface = NULL;
  REQUIRE(exm_mesh_create(positions, 3 * V, triangles, 3 * F, &surface) == EXM_OK);
  check_mesh(surface, 11, values);
  for (size_t i = 0; i < 11; i++) {
    CHECK_NEAR(values[i], i < 3 ? 0 : 2, 0.03); /* nine copies of 2, of which eight are asked for */
  }
  exm_mesh_destroy(surface);
  free(positions);
  free(triangles);
  zoo_free(&sphere);
}

static int cancel(void *user, double fraction, const char *stage)
{
  (void)stage;
  CHECK(fraction >= 0 && fraction <= 1);
  return ++*(int *)user > 5;
}

TEST(arguments_and_cancelling)
{
  double values[3];
  int calls = 0;
  zoo_mesh sphere = zoo_sphere(4);
  exm_mesh *surface = zoo_create(&sphere);
  REQUIRE(surface != NULL);
  double *functions = test_array(3 * sphere.vertex_count, sizeof(double));
  CHECK_STATUS(exm_weights_eigenfunctions(NULL, 3, NULL, NULL, values, functions), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_weights_eigenfunctions(surface, 3, NULL, NULL, NULL, functions), EXM_ERROR_ARGUMENT,
               "values is NULL");
  CHECK_STATUS(exm_weights_eigenfunctions(surface, 3, NULL, NULL, values, NULL), EXM_ERROR_ARGUMENT,
               "functions is NULL");
  CHECK_STATUS(exm_weights_eigenfunctions(surface, 0, NULL, NULL, values, functions), EXM_ERROR_ARGUMENT, "count is 0");
  CHECK_STATUS(exm_weights_eigenfunctions(surface, 1000000, NULL, NULL, values, functions), EXM_ERROR_ARGUMENT,
               "count is 1000000");
  CHECK_STATUS(exm_weights_eigenfunctions(surface, 3, cancel, &calls, values, functions), EXM_ERROR_CANCELLED,
               "eigenfunctions");
  exm_mesh_destroy(surface);
  free(functions);
  zoo_free(&sphere);
}

typedef struct job {
  exm_mesh *surface;
  double values[5], *functions;
} job;

static exm_status find(void *context)
{
  job *j = context;
  return exm_weights_eigenfunctions(j->surface, 5, NULL, NULL, j->values, j->functions);
}

TEST(every_allocation_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail in this build");
  }
  zoo_mesh sphere = zoo_sphere(3);
  job j = {.surface = zoo_create(&sphere)};
  REQUIRE(j.surface != NULL);
  j.functions = test_array(5 * sphere.vertex_count, sizeof(double));
  CHECK(for_each_failed_allocation(find, &j) > 5);
  exm_mesh_destroy(j.surface);
  free(j.functions);
  zoo_free(&sphere);
}
