/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The lowest eigenpairs of large sparse symmetric matrices. */
#ifndef EXM_LINALG_EIGEN_H
#define EXM_LINALG_EIGEN_H

#include "linalg/sparse.h"

/** A x = lambda M x, A positive semidefinite, M a positive diagonal. */
typedef struct eigen_problem {
  const sparse *lower;  /* A */
  const double *masses; /* [size] M */
  double shift;         /* > 0: A + shift M is what gets factored; small beside the eigenvalues wanted */
  size_t known_count;
  const double *known; /* [known_count][size] M-orthonormal eigenvectors; those found are orthogonal to them */
  /* Asked between steps, where there is one; anything but 0 stops the search. */
  int (*stop)(void *user);
  void *user;
} eigen_problem;

/**
 * The `count` lowest eigenpairs that are not known yet. Copies of a multiple eigenvalue are all found: the search is
 * repeated in the complement of what it found until nothing lower turns up there.
 *
 * count    at most size - known_count
 * values   [count] out, rising, not below zero
 * vectors  [count][size] out, M-orthonormal
 *
 * Errors: EXM_ERROR_NUMERIC, EXM_ERROR_OUT_OF_MEMORY, EXM_ERROR_CANCELLED.
 */
exm_status eigen_lowest(const eigen_problem *problem, size_t count, double *values, double *vectors);

#endif
