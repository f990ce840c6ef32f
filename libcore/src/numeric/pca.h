/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Principal components of a few long rows: rows are n, of d numbers, n much smaller than d. The n x n Gram matrix of
 * the centred rows has the left singular vectors and the squares of the singular values; the right ones are
 * combinations of the rows. That costs n^2 d instead of the several times more of a singular value decomposition, and
 * reads the rows twice, in blocks of columns.
 *
 * A Gram matrix loses singular values below 1e-8 of the largest in rounding, which is below the rounding of rows in
 * single precision; they are left out. */
#ifndef EXM_NUMERIC_PCA_H
#define EXM_NUMERIC_PCA_H

#include "base/memory.h"
#include "base/progress.h"

typedef struct pca {
  size_t row_count, dimension;
  size_t component_count; /* m */
  float *mean;            /* [d] */
  float *basis;           /* [m][d] orthonormal */
  double *coordinates;    /* [n][m] of the rows; columns by falling length */
  double total, rest;     /* sum of squares of the centred rows, and the part of it that the components leave */
} pca;

/**
 * rows        [n][d]
 * components  m wanted, at most n - 1 are taken; 0: as few as leave no more than `limit` of the sum of squares
 *
 * Components of length zero to rounding are left out. The largest coordinate of every component is positive, so that
 * the result does not depend on how an eigensolver chooses signs.
 */
exm_status pca_fit(arena *owner, size_t row_count, size_t dimension, const float *const *rows, size_t components,
                   double limit, const progress *report, pca *out);

/** Coordinates [m] of the row that is closest to one of any numbers [d]; gives the squared distance between the two. */
double pca_project(const pca *p, const float *row, double *coordinates);

/** out [d] = mean + sum_j coordinates[j] basis[j] */
void pca_combine(const pca *p, const double *coordinates, double *out);
void pca_combine_single(const pca *p, const double *coordinates, float *out);

/** out [d] = sum_j coordinates[j] basis[j]: the linear part alone, for derivatives. */
void pca_combine_linear(const pca *p, const double *coordinates, double *out);

#endif
