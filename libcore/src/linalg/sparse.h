/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Symmetric sparse matrices. Two storages, both compressed columns with sorted rows: the lower triangle with the
 * diagonal, which factorisation reads, and the whole matrix, which products read. Indices are 32-bit; whatever does not
 * fit them is reported as out of memory. */
#ifndef EXM_LINALG_SPARSE_H
#define EXM_LINALG_SPARSE_H

#include <stdint.h>

#include "base/memory.h"
#include "base/status.h"

typedef struct sparse {
  size_t size;     /* rows and columns */
  int32_t *starts; /* [size + 1] */
  int32_t *rows;   /* [starts[size]] ascending in each column */
  double *values;
} sparse;

/**
 * The lower triangle of the matrix that is the sum of the triplets. An entry off the diagonal stands for its mirror
 * image as well, and is given once, on either side; repeated ones add up.
 *
 * rows, columns, values  [count]
 */
exm_status sparse_from_triplets(arena *owner, size_t size, size_t count, const uint32_t *rows, const uint32_t *columns,
                                const double *values, sparse *out);

/**
 * The lower triangle of sum_f sum_i c_fi (x_j - x_k)^2 as x'Lx: the cotangent Laplacian, positive semidefinite.
 * Every diagonal entry is present, also where a vertex has no triangle.
 *
 * triangles   [count][3] corners
 * cotangents  [count][3] weight of the edge opposite to each corner
 */
exm_status sparse_laplacian(arena *owner, size_t size, size_t count, const uint32_t (*triangles)[3],
                            const double (*cotangents)[3], sparse *out);

/** The whole matrix from its lower triangle. */
exm_status sparse_whole(arena *owner, const sparse *lower, sparse *out);

/** The lower triangle of A D A for a whole symmetric A and a diagonal D; of A A where `diagonal` is NULL. */
exm_status sparse_square(arena *owner, const sparse *whole, const double *diagonal, sparse *out);

/** y = A x for a whole symmetric A and `count` columns, x and y [count][size]. */
void sparse_multiply(const sparse *whole, size_t count, const double *x, double *y);

#endif
