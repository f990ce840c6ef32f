/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sums over sets that overlap, y_k = sum_(i in set k) x_i, and their transpose, x_i = sum_(k : i in set k) y_k, for
 * rows of nine numbers: a sparse matrix of zeros and ones, and as many rows as columns.
 *
 * A set is stored as its difference from that of a neighbour, its base: a ball of radius R on a surface has about 3 R^2
 * members, two of them about an edge differ by 4 R. With P the matrix that picks bases, the matrix is (I - P)^-1 Delta,
 * so its transpose is the transpose of Delta after sums over subtrees. Chains of bases are kept within runs, of bounded
 * length, which threads share out; results do not depend on their number. */
#ifndef EXM_LINALG_SET_SUMS_H
#define EXM_LINALG_SET_SUMS_H

#include <stdint.h>

#include "base/memory.h"
#include "base/status.h"
#include "linalg/four.h"

/** A row of nine numbers, three by three, each three with a fourth that is carried along. */
typedef struct row12 {
  four part[3];
} row12;

/** What is added and what is taken away, for each of `count` rows: entries[starts[2 k] .. starts[2 k + 1]) are added,
 *  those up to starts[2 k + 2] taken away. */
typedef struct signed_lists {
  uint32_t *starts;  /* [2 count + 1] */
  uint32_t *entries; /* [starts[2 count]] */
} signed_lists;

typedef struct set_sums {
  size_t count;
  int is_identity; /* every set is its own index alone: nothing below is there */
  size_t run_count;
  uint32_t *run_starts; /* [run_count + 1] into `order` */
  uint32_t *order;      /* [count] sets, run by run, bases before those that use them */
  uint32_t *bases;      /* [count] of set k: a set of the same run, or SET_SUMS_NONE */
  signed_lists rows;    /* of set k: its difference from its base */
  signed_lists columns; /* the transpose of `rows` */
} set_sums;

#define SET_SUMS_NONE UINT32_MAX

/** Fill in `columns`. */
exm_status set_sums_transpose(arena *owner, set_sums *s);

/** y = A x; x and y [count], not the same. */
void set_sums_apply(const set_sums *s, int thread_count, const row12 *x, row12 *y);

/** x = A' y; scratch [count] is overwritten. No two are the same. */
void set_sums_apply_transposed(const set_sums *s, int thread_count, const row12 *y, row12 *scratch, row12 *x);

#endif
