/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sparse assembly against dense sums, and factorisations by their residuals. */
#include "allocation.h"
#include "harness.h"
#include "linalg/cholesky.h"
#include "linalg/sparse.h"
#include "mesh/mesh.h"
#include "zoo.h"

/* [size][size] of a lower triangle; of a whole matrix where `whole`. */
static double *to_dense(const sparse *a, bool whole)
{
  double *dense = test_array(a->size * a->size, sizeof *dense);
  memset(dense, 0, a->size * a->size * sizeof *dense);
  for (size_t j = 0; j < a->size; ++j) {
    for (int32_t e = a->starts[j]; e < a->starts[j + 1]; ++e) {
      size_t const i = (size_t)a->rows[e];
      CHECK(e == a->starts[j] || a->rows[e - 1] < a->rows[e]);
      CHECK(whole || i >= j);
      dense[i * a->size + j] = a->values[e];
      if (!whole) {
        dense[j * a->size + i] = a->values[e];
      }
    }
  }
  return dense;
}

static void check_equal(size_t count, const double *a, const double *b, double tolerance)
{
  for (size_t i = 0; i < count; ++i) {
    CHECK_NEAR(a[i], b[i], tolerance);
  }
}

TEST(triplets_add_up)
{
  enum { SIZE = 17, COUNT = 400 };
  test_random random = {1};
  uint32_t rows[COUNT], columns[COUNT];
  double values[COUNT], expected[SIZE * SIZE] = {0};
  for (size_t e = 0; e < COUNT; ++e) {
    rows[e] = (uint32_t)(test_uniform(&random) * SIZE);
    columns[e] = (uint32_t)(test_uniform(&random) * SIZE);
    values[e] = test_uniform(&random) - 0.5;
    expected[rows[e] * SIZE + columns[e]] += values[e];
    if (rows[e] != columns[e]) {
      expected[columns[e] * SIZE + rows[e]] += values[e];
    }
  }
  arena memory = {0};
  sparse lower, whole;
  REQUIRE(sparse_from_triplets(&memory, SIZE, COUNT, rows, columns, values, &lower) == EXM_OK);
  REQUIRE(sparse_whole(&memory, &lower, &whole) == EXM_OK);
  double *a = to_dense(&lower, false), *b = to_dense(&whole, true);
  check_equal(SIZE * SIZE, a, expected, 1e-14);
  check_equal(SIZE * SIZE, b, expected, 1e-14);
  free(a);
  free(b);
  arena_release(&memory);
}

TEST(empty_and_diagonal_matrices)
{
  arena memory = {0};
  sparse lower, whole;
  uint32_t const index[2] = {0, 2};
  double const value[2] = {4, 5};
  REQUIRE(sparse_from_triplets(&memory, 3, 2, index, index, value, &lower) == EXM_OK);
  CHECK(lower.starts[3] == 2 && lower.rows[1] == 2);
  REQUIRE(sparse_from_triplets(&memory, 3, 0, NULL, NULL, NULL, &lower) == EXM_OK);
  REQUIRE(sparse_whole(&memory, &lower, &whole) == EXM_OK);
  CHECK(whole.starts[3] == 0);
  CHECK_STATUS(sparse_from_triplets(&memory, SIZE_MAX / 2, 0, NULL, NULL, NULL, &lower), EXM_ERROR_OUT_OF_MEMORY);
  CHECK_STATUS(sparse_laplacian(&memory, 3, SIZE_MAX / 2, NULL, NULL, &lower), EXM_ERROR_OUT_OF_MEMORY);
  arena_release(&memory);
}

static exm_status laplacian_of(arena *memory, const mesh *m, sparse *lower, sparse *whole)
{
  TRY(sparse_laplacian(memory, m->vertex_count, m->triangle_count, (const uint32_t(*)[3])m->triangles,
                       (const double(*)[3])m->cotangents, lower));
  return sparse_whole(memory, lower, whole);
}

/* x'Lx is the sum over triangles that it is assembled from; constants cost nothing. */
TEST(laplacian_on_the_zoo)
{
  size_t count;
  const zoo_mesh *animals = zoo(&count);
  for (size_t a = 0; a < count; ++a) {
    test_about("%s", animals[a].name);
    exm_mesh *m = zoo_create(&animals[a]);
    arena memory = {0};
    sparse lower, whole;
    REQUIRE(m && laplacian_of(&memory, m, &lower, &whole) == EXM_OK);
    test_random random = {a};
    double *x = test_array(2 * m->vertex_count, sizeof *x), *y = test_array(2 * m->vertex_count, sizeof *y);
    double expected = 0, energy = 0, scale = 0;
    for (size_t v = 0; v < m->vertex_count; ++v) {
      x[v] = test_uniform(&random);
      x[m->vertex_count + v] = 1;
    }
    for (size_t f = 0; f < m->triangle_count; ++f) {
      for (int i = 0; i < 3; ++i) {
        double const d = x[m->triangles[f][(i + 1) % 3]] - x[m->triangles[f][(i + 2) % 3]];
        expected += m->cotangents[f][i] * d * d;
        scale += fabs(m->cotangents[f][i]);
      }
    }
    sparse_multiply(&whole, 2, x, y);
    for (size_t v = 0; v < m->vertex_count; ++v) {
      energy += x[v] * y[v];
      CHECK_NEAR(y[m->vertex_count + v], 0, 1e-14 * scale);
      CHECK(lower.rows[lower.starts[v]] == (int32_t)v); /* diagonals are there, of loose vertices too */
    }
    CHECK_NEAR(energy, expected, 1e-13 * scale);
    free(x);
    free(y);
    arena_release(&memory);
    exm_mesh_destroy(m);
  }
}

TEST(square_is_the_product)
{
  enum { SIZE = 40 };
  test_random random = {4};
  uint32_t rows[100], columns[100];
  double values[100], diagonal[SIZE];
  for (size_t e = 0; e < 100; ++e) {
    rows[e] = (uint32_t)(test_uniform(&random) * SIZE);
    columns[e] = e < SIZE ? 0 : (uint32_t)(test_uniform(&random) * SIZE); /* one dense row and column */
    values[e] = test_uniform(&random) - 0.5;
  }
  for (size_t i = 0; i < SIZE; ++i) {
    diagonal[i] = 1 + test_uniform(&random);
  }
  arena memory = {0};
  sparse lower, whole, square, plain;
  REQUIRE(sparse_from_triplets(&memory, SIZE, 100, rows, columns, values, &lower) == EXM_OK);
  REQUIRE(sparse_whole(&memory, &lower, &whole) == EXM_OK);
  REQUIRE(sparse_square(&memory, &whole, diagonal, &square) == EXM_OK);
  REQUIRE(sparse_square(&memory, &whole, NULL, &plain) == EXM_OK);
  double *a = to_dense(&whole, true), *s = to_dense(&square, false), *p = to_dense(&plain, false);
  for (size_t i = 0; i < SIZE; ++i) {
    for (size_t j = 0; j < SIZE; ++j) {
      double weighed = 0, sum = 0;
      for (size_t k = 0; k < SIZE; ++k) {
        weighed += a[i * SIZE + k] * diagonal[k] * a[k * SIZE + j];
        sum += a[i * SIZE + k] * a[k * SIZE + j];
      }
      CHECK_NEAR(s[i * SIZE + j], weighed, 1e-14);
      CHECK_NEAR(p[i * SIZE + j], sum, 1e-14);
    }
  }
  free(a);
  free(s);
  free(p);
  arena_release(&memory);
}

/* A positive definite matrix on a bar: its Laplacian and the masses. */
typedef struct fixture {
  arena memory;
  sparse lower, whole;
} fixture;

static exm_status fixture_create(fixture *f)
{
  zoo_mesh bar = zoo_bar(30, 6);
  exm_mesh *m = NULL;
  *f = (fixture){0};
  exm_status status = exm_mesh_create(bar.positions[0], bar.vertex_count, bar.triangles[0], bar.triangle_count, &m);
  if (status >= 0) {
    status = laplacian_of(&f->memory, m, &f->lower, &f->whole);
  }
  for (size_t v = 0; status >= 0 && v < m->vertex_count; ++v) {
    f->lower.values[f->lower.starts[v]] += m->masses[v];
  }
  if (status >= 0) {
    status = sparse_whole(&f->memory, &f->lower, &f->whole);
  }
  exm_mesh_destroy(m);
  zoo_free(&bar);
  return status;
}

static double residual(const sparse *whole, size_t count, const double *x, const double *b)
{
  double *y = test_array(count * whole->size, sizeof *y), worst = 0;
  sparse_multiply(whole, count, x, y);
  for (size_t i = 0; i < count * whole->size; ++i) {
    worst = fmax(worst, fabs(y[i] - b[i]));
  }
  free(y);
  return worst;
}

TEST(solutions_solve)
{
  fixture f;
  cholesky *factor;
  test_random random = {5};
  REQUIRE(fixture_create(&f) == EXM_OK);
  REQUIRE(cholesky_create(&f.lower, &factor) == EXM_OK);
  size_t const n = f.lower.size;
  for (size_t count = 0; count <= 37; ++count) {
    double *b = test_array(count * n + 1, sizeof *b), *x = test_array(count * n + 1, sizeof *b);
    double *rows = test_array(count * n + 1, sizeof *b);
    for (size_t i = 0; i < count * n; ++i) {
      b[i] = x[i] = test_uniform(&random) - 0.5;
      rows[i % n * count + i / n] = b[i];
    }
    CHECK(cholesky_solve(factor, count, x) == EXM_OK);
    CHECK(residual(&f.whole, count, x, b) < 1e-12);
    CHECK(cholesky_solve_rows(factor, count, rows) == EXM_OK);
    for (size_t i = 0; i < count * n; ++i) {
      CHECK_NEAR(rows[i % n * count + i / n], x[i], 1e-12);
      rows[i % n * count + i / n] = b[i];
    }
    double energy = 0, half = 0;
    CHECK(cholesky_solve_root_rows(factor, count, rows) == EXM_OK);
    for (size_t i = 0; i < count * n; ++i) {
      half += rows[i] * rows[i]; /* b'A^-1 b = |C^-1 b|^2 */
      energy += b[i] * x[i];
    }
    CHECK_NEAR(half, energy, 1e-12 * energy);
    CHECK(cholesky_solve_root_transposed_rows(factor, count, rows) == EXM_OK);
    for (size_t i = 0; i < count * n; ++i) {
      CHECK_NEAR(rows[i % n * count + i / n], x[i], 1e-12);
    }
    free(b);
    free(x);
    free(rows);
  }
  cholesky_destroy(factor);
  arena_release(&f.memory);
}

TEST(refactoring)
{
  fixture f;
  cholesky *factor;
  REQUIRE(fixture_create(&f) == EXM_OK);
  REQUIRE(cholesky_create(&f.lower, &factor) == EXM_OK);
  size_t const n = f.lower.size;
  double *b = test_array(n, sizeof *b), *x = test_array(n, sizeof *x);
  for (size_t v = 0; v < n; ++v) {
    b[v] = x[v] = (double)(v % 7);
  }
  double const kept = f.lower.values[0];
  f.lower.values[0] = -kept;
  CHECK_STATUS(cholesky_refactor(factor, &f.lower), EXM_ERROR_NUMERIC, "not positive definite");
  CHECK_STATUS(cholesky_solve(factor, 1, x), EXM_ERROR_NUMERIC, "no factorisation");
  CHECK_STATUS(cholesky_solve_rows(factor, 1, x), EXM_ERROR_NUMERIC, "no factorisation");
  check_equal(n, x, b, 0);
  f.lower.values[0] = NAN;
  CHECK_STATUS(cholesky_refactor(factor, &f.lower), EXM_ERROR_NUMERIC, "not finite");
  f.lower.values[0] = kept + 3;
  REQUIRE(cholesky_refactor(factor, &f.lower) == EXM_OK);
  REQUIRE(sparse_whole(&f.memory, &f.lower, &f.whole) == EXM_OK);
  REQUIRE(cholesky_solve(factor, 1, x) == EXM_OK);
  CHECK(residual(&f.whole, 1, x, b) < 1e-12);
  sparse smaller = f.lower;
  smaller.size--;
  CHECK_STATUS(cholesky_refactor(factor, &smaller), EXM_ERROR_INTERNAL);
  free(b);
  free(x);
  cholesky_destroy(factor);
  arena_release(&f.memory);
}

TEST(what_cannot_be_factored)
{
  arena memory = {0};
  sparse lower;
  cholesky *factor = (cholesky *)&memory;
  uint32_t const rows[] = {0, 1, 1}, columns[] = {0, 0, 1};
  double const matrices[][3] = {{1, 2, 1}, {1, 1, 1}, {0, 0, 0}, {-1, 0, 1}, {1, NAN, 1}, {INFINITY, 0, 1}};
  for (size_t k = 0; k < sizeof matrices / sizeof *matrices; ++k) {
    test_about("matrix %zu", k);
    REQUIRE(sparse_from_triplets(&memory, 2, 3, rows, columns, matrices[k], &lower) == EXM_OK);
    CHECK(cholesky_create(&lower, &factor) == EXM_ERROR_NUMERIC);
    CHECK(factor == NULL);
    CHECK(exm_last_error()[0] != 0);
  }
  cholesky_destroy(NULL);
  arena_release(&memory);
}

static exm_status everything(void *context)
{
  const fixture *f = context;
  arena memory = {0};
  sparse whole, square;
  cholesky *factor = NULL;
  size_t const n = f->lower.size;
  double *x = ARENA_NEW(&memory, double, 7 * n);
  exm_status status = x ? EXM_OK : status_no_memory("a test");
  if (status < 0 || (status = sparse_whole(&memory, &f->lower, &whole)) < 0 ||
      (status = sparse_square(&memory, &whole, NULL, &square)) < 0 ||
      (status = cholesky_create(&square, &factor)) < 0 || (status = cholesky_refactor(factor, &square)) < 0 ||
      (status = cholesky_solve(factor, 7, x)) < 0) {
    goto done;
  }
  status = cholesky_solve_rows(factor, 7, x);
done:
  cholesky_destroy(factor);
  arena_release(&memory);
  return status;
}

TEST(every_allocation_fails_once)
{
  fixture f;
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  REQUIRE(fixture_create(&f) == EXM_OK);
  CHECK(for_each_failed_allocation(everything, &f) > 20);
  arena_release(&f.memory);
}
