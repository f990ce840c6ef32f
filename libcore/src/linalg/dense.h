/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Dense matrices. Large ones, at bind time, go to BLAS and LAPACK (this is their only user); the small ones of a solve
 * are multiplied here, because a library call costs more than the work. */
#ifndef EXM_LINALG_DENSE_H
#define EXM_LINALG_DENSE_H

#include "base/status.h"

/** y += a x */
void dense_axpy(size_t count, double a, const double *x, double *y);

/** out[n][d] = A[n][m] x[m][d], all row-major, d of 1 to 3 or more. */
void dense_times(size_t n, size_t m, size_t d, const double *A, const double *x, double *out);

/** out[m][d] = A'[m][n] x[n][d] with A [n][m] row-major, its rows `stride` apart. */
void dense_times_transposed(size_t n, size_t m, size_t d, const double *A, size_t stride, const double *x, double *out);

/** to [columns][rows] = from [rows][columns] transposed. */
void dense_transpose(size_t rows, size_t columns, const double *from, double *to);

/** Sum of products of two arrays. */
double dense_dot(size_t count, const double *a, const double *b);

/** Factor the lower triangle of A [n][n] row-major in place, A = L L'; 0 where A is not positive definite. */
int dense_cholesky(size_t n, double *A);
/** x <- L^-1 x and x <- L'^-1 x. */
void dense_cholesky_forward(size_t n, const double *L, double *x);
void dense_cholesky_backward(size_t n, const double *L, double *x);

/** C[n][m] = alpha op(A) op(B) + beta C, row-major; op transposes where its flag is set; k is the inner size. */
void dense_multiply(int transpose_a, int transpose_b, size_t n, size_t m, size_t k, double alpha, const double *A,
                    const double *B, double beta, double *C);

/** Lower triangle of C[n][n] += A A' with A [n][k]; what is above the diagonal stays. */
void dense_add_gram(size_t n, size_t k, const double *A, double *C);

/**
 * Thin QR without Q: the factor R of A [rows][columns] row-major, A'A = R'R. R [min(rows, columns)][columns] is left in
 * the first rows of A.
 */
exm_status dense_qr_factor(size_t rows, size_t columns, double *A);

/**
 * QR with column pivoting of E [rows][columns], its orthogonal factor applied to other matrices of as many rows.
 *
 * E      overwritten: the first *rank rows hold Q'E (columns in their own order), the rest are zero
 * others [other_columns] row-major [rows][other_columns]: overwritten by Q' others
 */
exm_status dense_rotate_rows(size_t rows, size_t columns, double *E, size_t other_columns, double *others,
                             double tolerance, size_t *rank);

/** Eigenvalues, rising, and eigenvectors of a symmetric A [n][n]: row i of A becomes the vector of values[i]. */
exm_status dense_eigen(size_t n, double *A, double *values);

/** Singular values, falling, and right singular vectors of A [rows][columns] (rows >= columns), destroyed:
 *  row i of V [columns][columns] is the vector of values[i]. */
exm_status dense_right_singular(size_t rows, size_t columns, double *A, double *values, double *V);

#endif
