/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Nearest points: a balanced k-d tree whose leaves lie side by side, eight points each [Friedman, Bentley and Finkel,
 * "An algorithm for finding best matches in logarithmic expected time", 1977; distances to cells are kept up to date
 * axis by axis as by Arya and Mount, 1993]. */
#ifndef EXM_NUMERIC_NEAREST_H
#define EXM_NUMERIC_NEAREST_H

#include <stdint.h>

#include "base/memory.h"
#include "base/status.h"

#define NEAREST_NONE UINT32_MAX

typedef struct nearest {
  size_t count, leaf_count;
  struct nearest_node *nodes;
  double *blocks;    /* [leaf_count][3][8], padded with points that are infinitely far */
  uint32_t *indices; /* [leaf_count][8] */
} nearest;

/** Points to be passed over. Directions of length 1, or 0 where unknown, which agree with all. */
typedef struct nearest_filter {
  const double (*normals)[3]; /* [count] of the points; NULL: all agree */
  double least_cosine;        /* between a point's direction and the query's */
  int is_unsigned;            /* opposite directions agree as well */
} nearest_filter;

/** points [count][3], finite, copied. Everything is allocated from `owner`. */
exm_status nearest_create(arena *owner, const double (*points)[3], size_t count, nearest *out);

/**
 * The nearest point to each of the queries [count][3].
 *
 * directions  [count][3] the queries', for the filter; NULL without one
 * filter      may be NULL
 * reach       points farther away are not looked at; INFINITY: all are
 * indices     [count] out, NEAREST_NONE where there is none; the lowest index of equally near ones
 * squared     [count] out; may be NULL
 */
void nearest_find(const nearest *tree, const double (*queries)[3], size_t count, const double (*directions)[3],
                  const nearest_filter *filter, double reach, int thread_count, uint32_t *indices, double *squared);

/** The `wanted` nearest points to each query, nearest first, NEAREST_NONE behind the last: indices, squared
 *  [count][wanted]. */
void nearest_find_several(const nearest *tree, const double (*queries)[3], size_t count, size_t wanted,
                          int thread_count, uint32_t *indices, double *squared);

#endif
