/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sparse Cholesky factorisation of symmetric positive definite matrices. */
#ifndef EXM_LINALG_CHOLESKY_H
#define EXM_LINALG_CHOLESKY_H

#include "linalg/sparse.h"

/** A factor and its solver's workspace; one thread at a time. */
typedef struct cholesky cholesky;

/**
 * Analyse and factor.
 *
 * lower  copied
 * out    NULL on failure; release with cholesky_destroy
 *
 * Errors: EXM_ERROR_NUMERIC (not positive definite to working precision, or not finite), EXM_ERROR_OUT_OF_MEMORY,
 * EXM_ERROR_INTERNAL.
 */
exm_status cholesky_create(const sparse *lower, cholesky **out);

/** Factor another matrix of the pattern that `like` has, by its analysis; `like` is as it was. out and errors: as
 * above. */
exm_status cholesky_create_like(const cholesky *like, const sparse *lower, cholesky **out);

/** Factor another matrix of the same pattern, without analysing it again. A factor whose refactoring failed solves
 *  nothing until one succeeds. Errors: as above. */
exm_status cholesky_refactor(cholesky *factor, const sparse *lower);

/**
 * Solve A x = b in place. One pass over the factor serves up to sixteen right-hand sides, so solve for several at once.
 *
 * columns  [count][size] right-hand sides in, solutions out
 *
 * Errors: EXM_ERROR_NUMERIC (there is no factorisation).
 */
exm_status cholesky_solve(cholesky *factor, size_t count, double *columns);

/** The same for right-hand sides side by side, which saves a transposition. rows [size][count]. */
exm_status cholesky_solve_rows(cholesky *factor, size_t count, double *rows);

/** The halves of a solve, with C C' = A a root of the matrix (rows of C in an order of the factor's own): x <- C^-1 x,
 *  and x <- C'^-1 x. One after the other they are cholesky_solve_rows. */
exm_status cholesky_solve_root_rows(cholesky *factor, size_t count, double *rows);
exm_status cholesky_solve_root_transposed_rows(cholesky *factor, size_t count, double *rows);

void cholesky_destroy(cholesky *factor);

#endif
