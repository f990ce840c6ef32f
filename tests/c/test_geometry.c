/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laws that cotangents, areas and masses obey on any mesh, and second routes to the same numbers. */
#include "harness.h"
#include "mesh/cotangents.h"
#include "mesh/mesh.h"
#include "zoo.h"

static void subtract(const double a[3], const double b[3], double out[3])
{
  for (int k = 0; k < 3; ++k) {
    out[k] = a[k] - b[k];
  }
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double distance(const double a[3], const double b[3])
{
  double d[3];
  subtract(a, b, d);
  return sqrt(dot(d, d));
}

/* By Heron's formula in Kahan's order; our code takes a cross product. */
static double heron(double a, double b, double c)
{
  double const high = fmax(a, fmax(b, c)), low = fmin(a, fmin(b, c)), middle = a + b + c - high - low;
  double const product =
      (high + (middle + low)) * (low - (high - middle)) * (low + (high - middle)) * (high + (middle - low));
  return product > 0 ? sqrt(product) / 4 : 0;
}

static double triangle_area(const mesh *m, size_t f)
{
  const uint32_t *t = m->triangles[f];
  return heron(distance(m->positions[t[0]], m->positions[t[1]]), distance(m->positions[t[1]], m->positions[t[2]]),
               distance(m->positions[t[2]], m->positions[t[0]]));
}

/* sum_i w_i (x_j - x_k)^2 */
static double triangle_energy(const double w[3], const double x[3])
{
  double energy = 0;
  for (int i = 0; i < 3; ++i) {
    double const difference = x[(i + 1) % 3] - x[(i + 2) % 3];
    energy += w[i] * difference * difference;
  }
  return energy;
}

static void random_point(test_random *random, double p[3])
{
  for (int k = 0; k < 3; ++k) {
    p[k] = 2 * test_uniform(random) - 1;
  }
}

/* The specimens whose geometry is nowhere floored. */
static bool is_regular(const zoo_mesh *specimen)
{
  return specimen->degenerate_faces == 0;
}

#define FOR_EACH_REGULAR(specimen, made)                                                                               \
  for (size_t zoo_count_ = 0, zoo_i_ = (zoo(&zoo_count_), 0); zoo_i_ < zoo_count_; ++zoo_i_)                           \
    for (const zoo_mesh *specimen = zoo(&zoo_count_) + zoo_i_; specimen && is_regular(specimen); specimen = NULL)      \
      for (exm_mesh *made = (test_about("%s", specimen->name), zoo_create(specimen)); made;                            \
           exm_mesh_destroy(made), made = NULL)

/* ------------------------------------------------------------------------------------------------- known, by hand */

TEST(known_triangles)
{
  double const a[3] = {0, 0, 0}, b[3] = {1, 0, 0}, c[3] = {0, 1, 0}, top[3] = {0.5, sqrt(3) / 2, 0};
  triangle_measure const right = triangle_measure_of(a, b, c);
  CHECK_NEAR(right.cotangents[0], 0, 1e-15);
  CHECK_NEAR(right.cotangents[1], 0.5, 1e-15);
  CHECK_NEAR(right.cotangents[2], 0.5, 1e-15);
  CHECK_NEAR(right.area, 0.5, 1e-15);
  triangle_measure const regular = triangle_measure_of(a, b, top);
  for (int i = 0; i < 3; ++i) {
    CHECK_NEAR(regular.cotangents[i], 0.5 / sqrt(3), 1e-15);
  }
  triangle_measure const point = triangle_measure_of(b, b, b);
  CHECK(point.degenerate && point.area == 0);
  for (int i = 0; i < 3; ++i) {
    CHECK_NEAR(point.cotangents[i], 0.5 / sqrt(3), 1e-15); /* like the equilateral one */
  }
}

TEST(api_hands_out_what_the_mesh_holds)
{
  exm_mesh *made = zoo_create(zoo_find("bar"));
  double(*cotangents)[3] = test_array(made->triangle_count, sizeof *cotangents);
  CHECK_STATUS(exm_mesh_cotangents(made, cotangents[0]), EXM_OK);
  CHECK(memcmp(cotangents, made->cotangents, made->triangle_count * sizeof *cotangents) == 0);
  free(cotangents);
  exm_mesh_destroy(made);
}

/* ------------------------------------------------------------------------------------------------------------- laws */

TEST(angles_of_a_triangle_sum_to_pi)
{
  FOR_EACH_REGULAR(specimen, made)
  {
    for (size_t f = 0; f < made->triangle_count; ++f) {
      double sum = 0;
      for (int i = 0; i < 3; ++i) {
        sum += atan2(1, 2 * made->cotangents[f][i]);
      }
      CHECK_NEAR(sum, M_PI, 1e-10);
    }
  }
}

TEST(gauss_bonnet)
{
  /* sum over vertices of (2 pi - angles) - pi x boundary edges = 2 pi chi, where no edge has three triangles. */
  FOR_EACH_REGULAR(specimen, made)
  {
    if (made->report.non_manifold_edge_count) {
      continue;
    }
    double defect = 2 * M_PI * (double)(made->vertex_count - made->report.loose_vertex_count) -
                    M_PI * (double)made->report.boundary_edge_count;
    for (size_t f = 0; f < made->triangle_count; ++f) {
      for (int i = 0; i < 3; ++i) {
        defect -= atan2(1, 2 * made->cotangents[f][i]);
      }
    }
    CHECK_NEAR(defect, 2 * M_PI * specimen->euler_characteristic, 1e-8);
  }
}

TEST(three_routes_to_the_area)
{
  FOR_EACH_REGULAR(specimen, made)
  {
    double by_sides = 0, by_cotangents = 0, by_masses = 0, loose = 0;
    for (size_t f = 0; f < made->triangle_count; ++f) {
      by_sides += triangle_area(made, f);
      for (int i = 0; i < 3; ++i) { /* sum_i cot_i l_i^2 = 4 A */
        const uint32_t *t = made->triangles[f];
        double const side = distance(made->positions[t[(i + 1) % 3]], made->positions[t[(i + 2) % 3]]);
        by_cotangents += made->cotangents[f][i] * side * side / 2;
      }
    }
    for (size_t v = 0; v < made->vertex_count; ++v) {
      bool const is_loose = made->neighbor_offsets[v] == made->neighbor_offsets[v + 1];
      *(is_loose ? &loose : &by_masses) += made->masses[v];
    }
    CHECK_NEAR(by_cotangents, by_sides, 1e-9 * by_sides);
    CHECK_NEAR(by_masses, by_sides, 1e-9 * by_sides);
    CHECK(loose <= 1e-6 * by_sides);
  }
}

TEST(known_areas)
{
  const char *const names[] = {"grid", "cube", "bar"};
  double const expected[] = {5 * 3, 6, 2 * 2 * 2 + 4 * 2 * 8};
  for (size_t n = 0; n < 3; ++n) {
    exm_mesh *made = zoo_create(zoo_find(names[n]));
    double area = 0;
    for (size_t v = 0; v < made->vertex_count; ++v) {
      area += made->masses[v];
    }
    CHECK_NEAR(area, expected[n], 1e-12 * expected[n]);
    exm_mesh_destroy(made);
  }
}

/* out = L x by the whole-triangle rule. */
static void apply_laplacian(const mesh *m, const double *x, size_t stride, double *out)
{
  memset(out, 0, m->vertex_count * sizeof *out);
  for (size_t f = 0; f < m->triangle_count; ++f) {
    for (int i = 0; i < 3; ++i) {
      uint32_t const j = m->triangles[f][(i + 1) % 3], k = m->triangles[f][(i + 2) % 3];
      double const flow = m->cotangents[f][i] * (x[j * stride] - x[k * stride]);
      out[j] += flow;
      out[k] -= flow;
    }
  }
}

static bool is_interior_of_grid(const mesh *m, size_t v)
{
  double angle = 0;
  for (size_t f = 0; f < m->triangle_count; ++f) {
    for (int i = 0; i < 3; ++i) {
      angle += m->triangles[f][i] == v ? atan2(1, 2 * m->cotangents[f][i]) : 0;
    }
  }
  return angle > 2 * M_PI - 1e-6;
}

TEST(laplacian_of_a_linear_function_vanishes_in_the_plane)
{
  const char *const names[] = {"grid", "grid with hole", "slivers"};
  for (size_t n = 0; n < 3; ++n) {
    test_about("%s", names[n]);
    exm_mesh *made = zoo_create(zoo_find(names[n]));
    double *out = test_array(made->vertex_count, sizeof *out);
    size_t interior = 0;
    for (size_t axis = 0; axis < 2; ++axis) {
      apply_laplacian(made, &made->positions[0][axis], 3, out);
      for (size_t v = 0; v < made->vertex_count; ++v) {
        if (is_interior_of_grid(made, v)) {
          CHECK_NEAR(out[v], 0, 1e-10);
          ++interior;
        }
      }
    }
    CHECK(interior > 0);
    free(out);
    exm_mesh_destroy(made);
  }
}

TEST(laplacian_of_the_sphere_is_its_curvature)
{
  /* L x = -(mean curvature vector) x mass: on the unit sphere L x = 2 M x, up to the mesh's coarseness. */
  zoo_mesh sphere = zoo_sphere(4);
  exm_mesh *made = zoo_create(&sphere);
  double *out = test_array(made->vertex_count, sizeof *out);
  double error = 0, size = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    apply_laplacian(made, &made->positions[0][axis], 3, out);
    for (size_t v = 0; v < made->vertex_count; ++v) {
      double const expected = 2 * made->masses[v] * made->positions[v][axis];
      error += (out[v] - expected) * (out[v] - expected);
      size += expected * expected;
    }
  }
  CHECK(sqrt(error / size) < 0.02);
  free(out);
  exm_mesh_destroy(made);
  zoo_free(&sphere);
}

TEST(energy_is_that_of_the_gradient)
{
  /* sum_i w_i (x_j - x_k)^2 = A |grad x|^2; the gradient from a 2 x 2 system in the triangle's plane. */
  test_random random = {11};
  for (int round = 0; round < 1000; ++round) {
    double p[3][3], u[3], v[3], x[3];
    for (int i = 0; i < 3; ++i) {
      random_point(&random, p[i]);
    }
    random_point(&random, x);
    subtract(p[1], p[0], u);
    subtract(p[2], p[0], v);
    double const uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), determinant = uu * vv - uv * uv;
    double const du = x[1] - x[0], dv = x[2] - x[0];
    double const gradient_squared = (vv * du * du - 2 * uv * du * dv + uu * dv * dv) / determinant;
    triangle_measure const measure = triangle_measure_of(p[0], p[1], p[2]);
    if (measure.area < 1e-3) {
      continue; /* the determinant has lost too many digits to compare */
    }
    double const expected = sqrt(determinant) / 2 * gradient_squared;
    CHECK_NEAR(triangle_energy(measure.cotangents, x), expected, 1e-9 * (1 + expected));
  }
}

/* ------------------------------------------------------------------------------------------------- any triangle at all
 */

/* From fat to collinear to coinciding, at any scale. */
static void nasty_triangle(test_random *random, double p[3][3])
{
  double const flatness = pow(10, -20 * test_uniform(random)), scale = pow(10, 60 * test_uniform(random) - 30);
  double along[3], across[3];
  random_point(random, p[0]);
  random_point(random, along);
  random_point(random, across);
  double const where = test_uniform(random) < 0.2 ? 0 : 2 * test_uniform(random);
  for (int k = 0; k < 3; ++k) {
    p[1][k] = p[0][k] + along[k];
    p[2][k] = p[0][k] + where * along[k] + flatness * across[k];
  }
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      p[i][k] *= scale;
    }
  }
}

TEST(energy_of_any_triangle_is_positive_semidefinite)
{
  test_random random = {3};
  for (int round = 0; round < 100000; ++round) {
    double p[3][3];
    nasty_triangle(&random, p);
    triangle_measure const m = triangle_measure_of(p[0], p[1], p[2]);
    const double *w = m.cotangents;
    double const largest = fmax(fabs(w[0]), fmax(fabs(w[1]), fabs(w[2])));
    CHECK(isfinite(largest) && largest <= 25000 * (1 + 1e-12));
    /* With the constants taken out, a 2 x 2 form: semidefinite where trace and determinant are not negative. */
    CHECK(w[0] + w[1] + w[2] >= 0);
    double const a = w[2] + w[1], b = w[2] + w[0], c = -w[2];
    CHECK(a >= -1e-12 * largest && b >= -1e-12 * largest);
    CHECK(a * b - c * c >= -1e-12 * largest * largest);
  }
}

TEST(weights_do_not_depend_on_scale_or_on_the_first_corner)
{
  test_random random = {5};
  for (int round = 0; round < 10000; ++round) {
    double p[3][3], scaled[3][3];
    nasty_triangle(&random, p);
    for (int i = 0; i < 9; ++i) {
      scaled[i / 3][i % 3] = 0x1p40 * p[i / 3][i % 3];
    }
    triangle_measure const one = triangle_measure_of(p[0], p[1], p[2]);
    triangle_measure const turned = triangle_measure_of(p[1], p[2], p[0]);
    triangle_measure const large = triangle_measure_of(scaled[0], scaled[1], scaled[2]);
    CHECK(large.degenerate == one.degenerate);
    for (int i = 0; i < 3; ++i) {
      CHECK(large.cotangents[i] == one.cotangents[i]);
      CHECK_NEAR(turned.cotangents[i], one.cotangents[(i + 1) % 3], 1e-6 * (1 + fabs(turned.cotangents[i])));
    }
  }
}

TEST(degenerate_means_within_the_rounding_of_the_coordinates)
{
  /* The same small triangle near the origin, and so far out that its corners are a few rounding steps apart. */
  double near[3][3] = {{0, 0, 0}, {1e-3, 0, 0}, {0.5e-3, 1e-5, 0}}, far[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      far[i][k] = near[i][k] + 1000;
    }
  }
  CHECK(!triangle_measure_of(near[0], near[1], near[2]).degenerate);
  CHECK(triangle_measure_of(far[0], far[1], far[2]).degenerate);
}

TEST(masses_are_positive_everywhere)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  for (size_t n = 0; n < count; ++n) {
    test_about("%s", all[n].name);
    exm_mesh *made = zoo_create(&all[n]);
    for (size_t v = 0; v < made->vertex_count; ++v) {
      CHECK(made->masses[v] > 0 && isfinite(made->masses[v]));
    }
    exm_mesh_destroy(made);
  }
}
