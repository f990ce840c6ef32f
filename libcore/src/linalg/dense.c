/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/dense.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/simd.h"
#include "linalg/single_blas.h"

/* LAPACK's and BLAS's Fortran entries: every implementation has them, their C interfaces differ. The trailing lengths
 * of character arguments may be left out on the platforms we build for. */
void dgemm_(const char *ta, const char *tb, const int *m, const int *n, const int *k, const double *alpha,
            const double *a, const int *lda, const double *b, const int *ldb, const double *beta, double *c,
            const int *ldc);
void dsyrk_(const char *uplo, const char *trans, const int *n, const int *k, const double *alpha, const double *a,
            const int *lda, const double *beta, double *c, const int *ldc);
void dpotrf_(const char *uplo, const int *n, double *a, const int *lda, int *info);
void dtrsv_(const char *uplo, const char *trans, const char *diag, const int *n, const double *a, const int *lda,
            double *x, const int *incx);
void dgelqf_(const int *m, const int *n, double *a, const int *lda, double *tau, double *work, const int *lwork,
             int *info);
void dgeqp3_(const int *m, const int *n, double *a, const int *lda, int *jpvt, double *tau, double *work,
             const int *lwork, int *info);
void dormqr_(const char *side, const char *trans, const int *m, const int *n, const int *k, const double *a,
             const int *lda, const double *tau, double *c, const int *ldc, double *work, const int *lwork, int *info);
void dsyevd_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w, double *work,
             const int *lwork, int *iwork, const int *liwork, int *info);
void dgesdd_(const char *jobz, const int *m, const int *n, double *a, const int *lda, double *s, double *u,
             const int *ldu, double *vt, const int *ldvt, double *work, const int *lwork, int *iwork, int *info);

/* Above this a LAPACK call is worth its overhead. */
enum { SMALL = 96 };

SIMD_CLONES void dense_axpy(size_t count, double a, const double *x, double *y)
{
  for (size_t i = 0; i < count; i++) {
    y[i] += a * x[i];
  }
}

SIMD_CLONES double dense_dot(size_t count, const double *a, const double *b)
{
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (size_t i = 0; i < count; i++) {
    sum += a[i] * b[i];
  }
  return sum;
}

/* Columns that three-column products take at a time: their part of x, one array a coordinate, stays in the first-level
 * cache. */
enum { TILE = 384 };

/* Three columns at once: the usual case, positions. */
SIMD_CLONES static void times_three(size_t n, size_t m, const double *A, const double *x, double *out)
{
  double x0[TILE], x1[TILE], x2[TILE];
  memset(out, 0, 3 * n * sizeof(double));
  for (size_t first = 0; first < m; first += TILE) {
    size_t const width = m - first < TILE ? m - first : TILE;
    for (size_t j = 0; j < width; j++) {
      x0[j] = x[3 * (first + j)];
      x1[j] = x[3 * (first + j) + 1];
      x2[j] = x[3 * (first + j) + 2];
    }
    for (size_t i = 0; i < n; i++) {
      const double *row = A + i * m + first;
      double a = 0, b = 0, c = 0;
#pragma omp simd reduction(+ : a, b, c)
      for (size_t j = 0; j < width; j++) {
        a += row[j] * x0[j];
        b += row[j] * x1[j];
        c += row[j] * x2[j];
      }
      out[3 * i] += a;
      out[3 * i + 1] += b;
      out[3 * i + 2] += c;
    }
  }
}

void dense_times(size_t n, size_t m, size_t d, const double *A, const double *x, double *out)
{
  if (d == 3) {
    times_three(n, m, A, x, out);
    return;
  }
  for (size_t i = 0; i < n; i++) {
    for (size_t k = 0; k < d; k++) {
      out[i * d + k] = 0;
    }
    for (size_t j = 0; j < m; j++) {
      for (size_t k = 0; k < d; k++) {
        out[i * d + k] += A[i * m + j] * x[j * d + k];
      }
    }
  }
}

SIMD_CLONES static void times_three_transposed(size_t n, size_t m, const double *A, size_t stride, const double *x,
                                               double *out)
{
  double a[TILE], b[TILE], c[TILE];
  for (size_t first = 0; first < m; first += TILE) {
    size_t const width = m - first < TILE ? m - first : TILE;
    memset(a, 0, width * sizeof *a);
    memset(b, 0, width * sizeof *b);
    memset(c, 0, width * sizeof *c);
    for (size_t i = 0; i < n; i++) {
      const double *row = A + i * stride + first;
      double const x0 = x[3 * i], x1 = x[3 * i + 1], x2 = x[3 * i + 2];
      for (size_t j = 0; j < width; j++) {
        a[j] += row[j] * x0;
        b[j] += row[j] * x1;
        c[j] += row[j] * x2;
      }
    }
    for (size_t j = 0; j < width; j++) {
      out[3 * (first + j)] = a[j];
      out[3 * (first + j) + 1] = b[j];
      out[3 * (first + j) + 2] = c[j];
    }
  }
}

void dense_times_transposed(size_t n, size_t m, size_t d, const double *A, size_t stride, const double *x, double *out)
{
  if (d == 3) {
    times_three_transposed(n, m, A, stride, x, out);
    return;
  }
  memset(out, 0, m * d * sizeof(double));
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < m; j++) {
      for (size_t k = 0; k < d; k++) {
        out[j * d + k] += A[i * stride + j] * x[i * d + k];
      }
    }
  }
}

static int small_cholesky(size_t n, double *A)
{
  for (size_t i = 0; i < n; i++) {
    double *row = A + i * n;
    for (size_t j = 0; j < i; j++) {
      row[j] = (row[j] - dense_dot(j, row, A + j * n)) / A[j * n + j];
    }
    double const pivot = row[i] - dense_dot(i, row, row);
    if (!(pivot > 0)) {
      return 0;
    }
    row[i] = sqrt(pivot);
  }
  return 1;
}

int dense_cholesky(size_t n, double *A)
{
  if (n <= SMALL) {
    return small_cholesky(n, A);
  }
  int const size = (int)n;
  int info = 0;
  /* Row-major lower is column-major upper. */
  SINGLE_BLAS(dpotrf_("U", &size, A, &size, &info));
  /* OpenBLAS takes a NaN for a pivot like any other. */
  for (size_t i = 0; i < n && info == 0; i++) {
    info = !(A[i * n + i] > 0);
  }
  return info == 0;
}

void dense_cholesky_forward(size_t n, const double *L, double *x)
{
  for (size_t i = 0; i < n; i++) {
    x[i] = (x[i] - dense_dot(i, L + i * n, x)) / L[i * n + i];
  }
}

void dense_cholesky_backward(size_t n, const double *L, double *x)
{
  for (size_t i = n; i-- > 0;) {
    x[i] /= L[i * n + i];
    dense_axpy(i, -x[i], L + i * n, x);
  }
}

void dense_multiply(int transpose_a, int transpose_b, size_t n, size_t m, size_t k, double alpha, const double *A,
                    const double *B, double beta, double *C)
{
  /* C' = op(B)' op(A)' in Fortran's order. */
  int const rows = (int)m, columns = (int)n, inner = (int)k;
  int const ldb = transpose_b ? inner : rows, lda = transpose_a ? columns : inner;
  if (n == 0 || m == 0) {
    return;
  }
  int const lda_safe = lda > 0 ? lda : 1, ldb_safe = ldb > 0 ? ldb : 1;
  SINGLE_BLAS(dgemm_(transpose_b ? "T" : "N", transpose_a ? "T" : "N", &rows, &columns, &inner, &alpha, B, &ldb_safe, A,
                     &lda_safe, &beta, C, &rows));
}

void dense_add_gram(size_t n, size_t k, const double *A, double *C)
{
  int const size = (int)n, inner = (int)k;
  double const one = 1;
  if (n > 0 && k > 0) {
    /* Row-major lower is column-major upper. */
    SINGLE_BLAS(dsyrk_("U", "T", &size, &inner, &one, A, &inner, &one, C, &size));
  }
}

static exm_status lapack_failed(const char *routine, int info)
{
  return status_set(EXM_ERROR_NUMERIC, "%s did not converge (info %d)", routine, info);
}

exm_status dense_qr_factor(size_t rows, size_t columns, double *A)
{
  if (rows == 0 || columns == 0) {
    return EXM_OK;
  }
  /* Row-major A is Fortran's A', whose LQ factor is R'. */
  int const m = (int)columns, n = (int)rows;
  int query = -1, info = 0;
  double best = 0;
  arena scratch = {0};
  size_t const diagonal = rows < columns ? rows : columns;
  SINGLE_BLAS(dgelqf_(&m, &n, A, &m, &best, &best, &query, &info));
  int const length = (int)best;
  double *tau = ARENA_NEW(&scratch, double, diagonal);
  double *work = ARENA_NEW(&scratch, double, (size_t)length);
  exm_status status = EXM_OK;
  if (!tau || !work) {
    status = status_no_memory("a QR factorisation");
    goto done;
  }
  SINGLE_BLAS(dgelqf_(&m, &n, A, &m, tau, work, &length, &info));
  for (size_t i = 0; i < diagonal; i++) {
    memset(A + i * columns, 0, i * sizeof(double));
  }
done:
  arena_release(&scratch);
  return status;
}

void dense_transpose(size_t rows, size_t columns, const double *from, double *to)
{
  for (size_t i = 0; i < rows; i++) {
    for (size_t j = 0; j < columns; j++) {
      to[j * rows + i] = from[i * columns + j];
    }
  }
}

exm_status dense_rotate_rows(size_t rows, size_t columns, double *E, size_t other_columns, double *others,
                             double tolerance, size_t *rank)
{
  *rank = 0;
  if (rows == 0) {
    return EXM_OK;
  }
  arena scratch = {0};
  exm_status status = EXM_OK;
  int const m = (int)rows, n = (int)columns, c = (int)other_columns;
  int const reflectors = m < n ? m : n;
  int const length = 64 * (m + n + c + 8);
  int info = 0;
  double *factor = ARENA_NEW(&scratch, double, rows *columns);
  double *turned = ARENA_NEW(&scratch, double, rows *other_columns);
  double *tau = ARENA_NEW(&scratch, double, (size_t)reflectors);
  double *work = ARENA_NEW(&scratch, double, (size_t)length);
  int *order = ARENA_NEW(&scratch, int, columns);
  if (!factor || !turned || !tau || !work || !order) {
    status = status_no_memory("a QR factorisation");
    goto done;
  }
  dense_transpose(rows, columns, E, factor);
  dense_transpose(rows, other_columns, others, turned);
  SINGLE_BLAS(dgeqp3_(&m, &n, factor, &m, order, tau, work, &length, &info));
  SINGLE_BLAS(dormqr_("L", "T", &m, &c, &reflectors, factor, &m, tau, turned, &m, work, &length, &info));
  dense_transpose(other_columns, rows, turned, others);
  size_t kept = 0;
  while (kept < (size_t)reflectors && fabs(factor[kept * rows + kept]) > tolerance * fabs(factor[0])) {
    kept++;
  }
  memset(E, 0, rows * columns * sizeof(double));
  for (size_t j = 0; j < columns; j++) {
    for (size_t i = 0; i < kept && i <= j; i++) {
      E[i * columns + (size_t)(order[j] - 1)] = factor[j * rows + i];
    }
  }
  *rank = kept;
done:
  arena_release(&scratch);
  return status;
}

exm_status dense_eigen(size_t n, double *A, double *values)
{
  if (n == 0) {
    return EXM_OK; /* LAPACK would print a complaint */
  }
  arena scratch = {0};
  exm_status status = EXM_OK;
  int const size = (int)n;
  int query = -1, info = 0, best_integer = 0;
  double best = 0;
  SINGLE_BLAS(dsyevd_("V", "U", &size, A, &size, values, &best, &query, &best_integer, &query, &info));
  int const length = (int)best, integers = best_integer;
  double *work = ARENA_NEW(&scratch, double, (size_t)length);
  int *integer_work = ARENA_NEW(&scratch, int, (size_t)integers);
  if (!work || !integer_work) {
    status = status_no_memory("an eigenvalue problem");
    goto done;
  }
  SINGLE_BLAS(dsyevd_("V", "U", &size, A, &size, values, work, &length, integer_work, &integers, &info));
  if (info != 0) {
    status = lapack_failed("dsyevd", info);
  }
done:
  arena_release(&scratch);
  return status;
}

exm_status dense_right_singular(size_t rows, size_t columns, double *A, double *values, double *V)
{
  if (columns == 0) {
    return EXM_OK;
  }
  /* Reduce to the triangle first: the vectors of R are those of A. */
  TRY(dense_qr_factor(rows, columns, A));
  arena scratch = {0};
  exm_status status = EXM_OK;
  int const n = (int)columns;
  int query = -1, info = 0;
  double best = 0;
  int *integers = ARENA_NEW(&scratch, int, 8 * columns);
  double *other = ARENA_NEW(&scratch, double, columns *columns);
  if (!integers || !other) {
    status = status_no_memory("a singular value problem");
    goto done;
  }
  /* Fortran sees R'; its left vectors are our right ones, stored one after the other: rows of V. */
  SINGLE_BLAS(dgesdd_("S", &n, &n, A, &n, values, V, &n, other, &n, &best, &query, integers, &info));
  int const length = (int)best;
  double *work = ARENA_NEW(&scratch, double, (size_t)length);
  if (!work) {
    status = status_no_memory("a singular value problem");
    goto done;
  }
  SINGLE_BLAS(dgesdd_("S", &n, &n, A, &n, values, V, &n, other, &n, work, &length, integers, &info));
  if (info != 0) {
    status = lapack_failed("dgesdd", info);
  }
done:
  arena_release(&scratch);
  return status;
}
