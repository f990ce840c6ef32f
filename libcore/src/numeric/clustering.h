/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_NUMERIC_CLUSTERING_H
#define EXM_NUMERIC_CLUSTERING_H

#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

/**
 * k-means of the rows of a matrix, each counting by its mass. The same input gives the same clusters, always.
 *
 * rows      [count][dimension] finite; zeros are skipped, so sparse rows are cheap
 * masses    [count] positive
 * clusters  wanted, at least 1
 * labels    [count] out; clusters are numbered by their lowest member, and none is empty
 * made      out: how many there are; fewer than wanted where fewer rows are different
 *
 * Errors: EXM_ERROR_OUT_OF_MEMORY.
 */
exm_status clustering_kmeans(const float *rows, size_t count, size_t dimension, const double *masses, size_t clusters,
                             uint32_t *labels, size_t *made);

#endif
