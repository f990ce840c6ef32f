/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Dense algebra against loops that one can read, on sizes below, at and above every threshold in it. */
#include "harness.h"
#include "linalg/dense.h"

static double *random_matrix(test_random *random, size_t rows, size_t columns)
{
  double *A = test_array(rows * columns, sizeof *A);
  for (size_t i = 0; i < rows * columns; ++i) {
    A[i] = 2 * test_uniform(random) - 1;
  }
  return A;
}

static double *copy_of(const double *A, size_t count)
{
  double *copy = test_array(count, sizeof *copy);
  memcpy(copy, A, count * sizeof *copy);
  return copy;
}

/* A'B for A [rows][n], B [rows][m]: [n][m]. */
static double *gram(size_t rows, size_t n, size_t m, const double *A, const double *B)
{
  double *out = test_array(n * m, sizeof *out);
  for (size_t r = 0; r < rows; ++r) {
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j < m; ++j) {
        out[i * m + j] += A[r * n + i] * B[r * m + j];
      }
    }
  }
  return out;
}

static void check_same(size_t count, const double *a, const double *b, double tolerance)
{
  double worst = 0;
  for (size_t i = 0; i < count; ++i) {
    worst = fabs(a[i] - b[i]) <= worst ? worst : fabs(a[i] - b[i]); /* a NaN stays */
  }
  CHECK_NEAR(worst, 0, tolerance);
}

static void check_orthonormal_rows(size_t n, size_t length, const double *V)
{
  double worst = 0;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      worst = fmax(worst, fabs(dense_dot(length, V + i * length, V + j * length) - (i == j)));
    }
  }
  CHECK_NEAR(worst, 0, 1e-13 * (double)(length + 1));
}

/* ------------------------------------------------------------------------------------------------------- products */

TEST(vectors)
{
  test_random random = {1};
  for (size_t n = 0; n < 70; ++n) {
    double *x = random_matrix(&random, n, 1), *y = random_matrix(&random, n, 1), *sum = copy_of(y, n);
    double dot = 0;
    for (size_t i = 0; i < n; ++i) {
      dot += x[i] * y[i];
      sum[i] += -1.5 * x[i];
    }
    test_about("%zu entries", n);
    CHECK_NEAR(dense_dot(n, x, y), dot, 1e-14);
    dense_axpy(n, -1.5, x, y);
    check_same(n, y, sum, 1e-15);
    free(x);
    free(y);
    free(sum);
  }
}

TEST(thin_products)
{
  test_random random = {2};
  size_t const sizes[] = {0, 1, 3, 64, 65, 130};
  for (size_t i = 0; i < 6; ++i) {
    for (size_t j = 0; j < 6; ++j) {
      for (size_t d = 1; d <= 4; ++d) {
        size_t const n = sizes[i], m = sizes[j];
        double *A = random_matrix(&random, n, m), *x = random_matrix(&random, m, d);
        double *out = random_matrix(&random, n, d), *expected = test_array(n * d, sizeof *expected);
        for (size_t a = 0; a < n; ++a) {
          for (size_t b = 0; b < m; ++b) {
            for (size_t k = 0; k < d; ++k) {
              expected[a * d + k] += A[a * m + b] * x[b * d + k];
            }
          }
        }
        test_about("%zu x %zu times %zu columns", n, m, d);
        dense_times(n, m, d, A, x, out);
        check_same(n * d, out, expected, 1e-13);
        free(A);
        free(x);
        free(out);
        free(expected);
      }
    }
  }
}

TEST(thin_products_of_part_of_a_transposed_matrix)
{
  test_random random = {3};
  size_t const sizes[] = {0, 1, 3, 64, 65, 130};
  for (size_t i = 0; i < 6; ++i) {
    for (size_t j = 0; j < 6; ++j) {
      for (size_t d = 1; d <= 4; ++d) {
        size_t const n = sizes[i], m = sizes[j], stride = m + i;
        double *A = random_matrix(&random, n, stride), *x = random_matrix(&random, n, d);
        double *out = random_matrix(&random, m, d), *expected = test_array(m * d, sizeof *expected);
        for (size_t a = 0; a < n; ++a) {
          for (size_t b = 0; b < m; ++b) {
            for (size_t k = 0; k < d; ++k) {
              expected[b * d + k] += A[a * stride + b] * x[a * d + k];
            }
          }
        }
        test_about("%zu x %zu of %zu, transposed, times %zu columns", n, m, stride, d);
        dense_times_transposed(n, m, d, A, stride, x, out);
        check_same(m * d, out, expected, 1e-13);
        free(A);
        free(x);
        free(out);
        free(expected);
      }
    }
  }
}

static double entry(const double *A, int is_transposed, size_t rows, size_t columns, size_t i, size_t j)
{
  return is_transposed ? A[j * rows + i] : A[i * columns + j];
}

static void check_multiply(test_random *random, int ta, int tb, size_t n, size_t m, size_t k, double alpha, double beta)
{
  double *A = random_matrix(random, n, k), *B = random_matrix(random, k, m), *C = random_matrix(random, n, m);
  double *expected = copy_of(C, n * m);
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < m; ++j) {
      expected[i * m + j] *= beta;
      for (size_t a = 0; a < k; ++a) {
        expected[i * m + j] += alpha * entry(A, ta, n, k, i, a) * entry(B, tb, k, m, a, j);
      }
    }
  }
  test_about("[%zu][%zu] = %s [%zu] %s", n, m, ta ? "A'" : "A", k, tb ? "B'" : "B");
  dense_multiply(ta, tb, n, m, k, alpha, A, B, beta, C);
  check_same(n * m, C, expected, 1e-13);
  free(A);
  free(B);
  free(C);
  free(expected);
}

TEST(matrix_products)
{
  test_random random = {4};
  size_t const sizes[] = {0, 1, 5, 17};
  for (int transposes = 0; transposes < 4; ++transposes) {
    for (size_t i = 0; i < 64; ++i) {
      check_multiply(&random, transposes & 1, transposes >> 1, sizes[i % 4], sizes[i / 4 % 4], sizes[i / 16], 1, 0);
      check_multiply(&random, transposes & 1, transposes >> 1, sizes[i % 4], sizes[i / 4 % 4], sizes[i / 16], -2, 0.5);
    }
  }
}

/* ------------------------------------------------------------------------------------------------------- Cholesky */

static double *definite_matrix(test_random *random, size_t n, size_t rank)
{
  double *C = random_matrix(random, rank, n);
  double *A = gram(rank, n, n, C, C);
  free(C);
  return A;
}

TEST(cholesky_factors_and_solves)
{
  test_random random = {5};
  size_t const sizes[] = {0, 1, 2, 7, 50, 95, 96, 97, 130};
  for (size_t t = 0; t < sizeof sizes / sizeof *sizes; ++t) {
    size_t const n = sizes[t];
    double *A = definite_matrix(&random, n, n + 40), *L = copy_of(A, n * n);
    double *x = random_matrix(&random, n, 1), *b = test_array(n, sizeof *b);
    test_about("%zu unknowns", n);
    CHECK(dense_cholesky(n, L));
    double worst = 0;
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j <= i; ++j) {
        worst = fmax(worst, fabs(dense_dot(j + 1, L + i * n, L + j * n) - A[i * n + j]));
      }
      b[i] = dense_dot(n, A + i * n, x);
    }
    CHECK_NEAR(worst, 0, 1e-12);
    dense_cholesky_forward(n, L, b);
    dense_cholesky_backward(n, L, b);
    check_same(n, b, x, 1e-9);
    free(A);
    free(L);
    free(x);
    free(b);
  }
}

TEST(cholesky_reads_the_lower_triangle_only)
{
  test_random random = {6};
  for (size_t n = 20; n <= 120; n += 100) {
    double *A = definite_matrix(&random, n, n + 10), *dirty = copy_of(A, n * n);
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = i + 1; j < n; ++j) {
        dirty[i * n + j] = NAN;
      }
    }
    CHECK(dense_cholesky(n, A));
    CHECK(dense_cholesky(n, dirty));
    for (size_t i = 0; i < n; ++i) {
      check_same(i + 1, A + i * n, dirty + i * n, 0);
    }
    free(A);
    free(dirty);
  }
}

TEST(cholesky_refuses_what_is_not_definite)
{
  test_random random = {7};
  for (size_t n = 3; n <= 103; n += 100) {
    double *A = definite_matrix(&random, n, n + 10);
    test_about("%zu unknowns", n);
    double *changed = copy_of(A, n * n);
    changed[(n - 1) * n + n - 1] = -1;
    CHECK(!dense_cholesky(n, changed));
    memset(changed, 0, n * n * sizeof *changed);
    CHECK(!dense_cholesky(n, changed));
    memcpy(changed, A, n * n * sizeof *changed);
    changed[n + 1] = NAN;
    CHECK(!dense_cholesky(n, changed));
    free(A);
    free(changed);
  }
}

/* -------------------------------------------------------------------------------------------------- orthogonal maps */

TEST(qr_keeps_the_gram_matrix)
{
  test_random random = {8};
  size_t const shapes[][2] = {{1, 1}, {5, 3}, {3, 5}, {40, 40}, {200, 30}, {30, 200}};
  for (size_t t = 0; t < 6; ++t) {
    size_t const rows = shapes[t][0], columns = shapes[t][1], kept = rows < columns ? rows : columns;
    double *A = random_matrix(&random, rows, columns), *before = gram(rows, columns, columns, A, A);
    test_about("%zu x %zu", rows, columns);
    CHECK_STATUS(dense_qr_factor(rows, columns, A), EXM_OK);
    double *after = gram(kept, columns, columns, A, A);
    check_same(columns * columns, after, before, 1e-11);
    for (size_t i = 0; i < kept; ++i) {
      for (size_t j = 0; j < i; ++j) {
        CHECK(A[i * columns + j] == 0);
      }
    }
    free(A);
    free(before);
    free(after);
  }
}

/* E [rows][columns] of a given rank. */
static double *of_rank(test_random *random, size_t rows, size_t columns, size_t rank)
{
  double *left = random_matrix(random, rows, rank), *right = random_matrix(random, rank, columns);
  double *E = test_array(rows * columns, sizeof *E);
  for (size_t i = 0; i < rows; ++i) {
    for (size_t j = 0; j < columns; ++j) {
      for (size_t k = 0; k < rank; ++k) {
        E[i * columns + j] += left[i * rank + k] * right[k * columns + j];
      }
    }
  }
  free(left);
  free(right);
  return E;
}

TEST(rotated_rows_keep_every_product_and_bring_the_rank_out)
{
  test_random random = {9};
  size_t const cases[][4] = {{1, 1, 1, 1},  {6, 4, 2, 3},   {4, 6, 4, 3},   {50, 9, 9, 20},
                             {9, 50, 5, 1}, {30, 12, 0, 4}, {30, 12, 1, 0}, {60, 6, 6, 60}};
  for (size_t t = 0; t < 8; ++t) {
    size_t const rows = cases[t][0], columns = cases[t][1], rank = cases[t][2], width = cases[t][3];
    double *E = of_rank(&random, rows, columns, rank), *others = random_matrix(&random, rows, width);
    double *EE = gram(rows, columns, columns, E, E), *EO = gram(rows, columns, width, E, others);
    double *OO = gram(rows, width, width, others, others);
    size_t found = 99;
    test_about("%zu x %zu of rank %zu with %zu others", rows, columns, rank, width);
    CHECK_STATUS(dense_rotate_rows(rows, columns, E, width, others, 1e-11, &found), EXM_OK);
    CHECK(found == rank);
    double *EE2 = gram(found, columns, columns, E, E), *EO2 = gram(found, columns, width, E, others);
    double *OO2 = gram(rows, width, width, others, others);
    check_same(columns * columns, EE2, EE, 1e-11);
    check_same(columns * width, EO2, EO, 1e-11);
    check_same(width * width, OO2, OO, 1e-11);
    for (size_t i = found * columns; i < rows * columns; ++i) {
      CHECK(E[i] == 0);
    }
    double *const all[] = {E, others, EE, EO, OO, EE2, EO2, OO2};
    for (size_t i = 0; i < 8; ++i) {
      free(all[i]);
    }
  }
}

TEST(rotating_no_rows_is_nothing)
{
  double none = 0;
  size_t rank = 7;
  CHECK_STATUS(dense_rotate_rows(0, 3, &none, 2, &none, 1e-11, &rank), EXM_OK);
  CHECK(rank == 0);
}

/* --------------------------------------------------------------------------------------------------------- spectra */

TEST(eigenvectors_by_rows)
{
  test_random random = {10};
  size_t const sizes[] = {1, 2, 3, 10, 60};
  for (size_t t = 0; t < 5; ++t) {
    size_t const n = sizes[t];
    double *A = definite_matrix(&random, n, n / 2 + 1), *V = copy_of(A, n * n);
    double *values = test_array(n, sizeof *values), trace = 0, sum = 0, worst = 0;
    test_about("%zu x %zu", n, n);
    CHECK_STATUS(dense_eigen(n, V, values), EXM_OK);
    check_orthonormal_rows(n, n, V);
    for (size_t i = 0; i < n; ++i) {
      CHECK(i == 0 || values[i] >= values[i - 1]);
      for (size_t j = 0; j < n; ++j) {
        worst = fmax(worst, fabs(dense_dot(n, A + j * n, V + i * n) - values[i] * V[i * n + j]));
      }
      trace += A[i * n + i];
      sum += values[i];
    }
    CHECK_NEAR(worst, 0, 1e-12);
    CHECK_NEAR(sum, trace, 1e-12);
    free(A);
    free(V);
    free(values);
  }
}

TEST(singular_vectors_by_rows)
{
  test_random random = {11};
  size_t const shapes[][3] = {{1, 1, 1}, {3, 3, 2}, {20, 4, 4}, {90, 30, 12}, {40, 40, 40}};
  for (size_t t = 0; t < 5; ++t) {
    size_t const rows = shapes[t][0], n = shapes[t][1], rank = shapes[t][2];
    double *A = of_rank(&random, rows, n, rank), *destroyed = copy_of(A, rows * n);
    double *values = test_array(n, sizeof *values), *V = test_array(n * n, sizeof *V), *AA = gram(rows, n, n, A, A);
    test_about("%zu x %zu of rank %zu", rows, n, rank);
    CHECK_STATUS(dense_right_singular(rows, n, destroyed, values, V), EXM_OK);
    check_orthonormal_rows(n, n, V);
    for (size_t i = 0; i < n; ++i) {
      CHECK(values[i] >= 0 && (i == 0 || values[i] <= values[i - 1]));
      CHECK((values[i] > 1e-9) == (i < rank));
      for (size_t j = 0; j < n; ++j) {
        CHECK_NEAR(dense_dot(n, AA + j * n, V + i * n), values[i] * values[i] * V[i * n + j], 1e-10);
      }
    }
    free(A);
    free(destroyed);
    free(values);
    free(V);
    free(AA);
  }
}

/* LAPACK prints a complaint about these, and a library may not. */
TEST(empty_matrices_are_fine)
{
  double none = 0;
  CHECK_STATUS(dense_eigen(0, &none, &none), EXM_OK);
  CHECK_STATUS(dense_qr_factor(0, 3, &none), EXM_OK);
  CHECK_STATUS(dense_qr_factor(3, 0, &none), EXM_OK);
  CHECK_STATUS(dense_right_singular(3, 0, &none, &none, &none), EXM_OK);
  CHECK(dense_cholesky(0, &none));
}
