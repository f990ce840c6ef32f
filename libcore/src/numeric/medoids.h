/* SPDX-License-Identifier: GPL-3.0-or-later */
/* k-medoids [Kaufman and Rousseeuw, "Clustering by means of medoids", 1987]: like k-means, with centres that are
 * members. Begun greedily, then members are assigned and medoids chosen anew until nothing changes. */
#ifndef EXM_NUMERIC_MEDOIDS_H
#define EXM_NUMERIC_MEDOIDS_H

#include <stddef.h>

#include "base/status.h"

/**
 * distances  [count][count] symmetric, not negative
 * fixed      the members 0 .. fixed are medoids whatever they cost
 * wanted     medoids in all, fixed ones included; at most count
 * medoids    [wanted] out, rising
 *
 * Errors: EXM_ERROR_OUT_OF_MEMORY.
 */
exm_status medoids_find(size_t count, const double *distances, size_t fixed, size_t wanted, size_t *medoids);

#endif
