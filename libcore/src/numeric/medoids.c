/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/medoids.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"

enum { ROUNDS = 50 };

/* The member that lowers the sum of distances to the nearest medoid most; nearest [count] is what it is now. */
static size_t best_addition(size_t count, const double *distances, const double *nearest,
                            const unsigned char *is_medoid)
{
  size_t best = count;
  double most = -1;
  for (size_t candidate = 0; candidate < count; candidate++) {
    double gain = 0;
    for (size_t i = 0; i < count && !is_medoid[candidate]; i++) {
      gain += fmax(nearest[i] - distances[candidate * count + i], 0);
    }
    if (!is_medoid[candidate] && gain > most) {
      most = gain;
      best = candidate;
    }
  }
  return best;
}

static void begin(size_t count, const double *distances, size_t fixed, size_t wanted, double *nearest,
                  unsigned char *is_medoid, size_t *medoids)
{
  for (size_t i = 0; i < count; i++) {
    nearest[i] = 2; /* what the first medoid is measured against: any number for all alike */
    for (size_t j = 0; j < count; j++) {
      nearest[i] = fmax(nearest[i], distances[i * count + j]);
    }
  }
  for (size_t m = 0; m < wanted; m++) {
    size_t const next = m < fixed ? m : best_addition(count, distances, nearest, is_medoid);
    medoids[m] = next;
    is_medoid[next] = 1;
    for (size_t i = 0; i < count; i++) {
      nearest[i] = fmin(nearest[i], distances[next * count + i]);
    }
  }
}

static void assign(size_t count, const double *distances, size_t wanted, const size_t *medoids, size_t *labels)
{
  for (size_t i = 0; i < count; i++) {
    labels[i] = 0;
    for (size_t m = 1; m < wanted; m++) {
      if (distances[medoids[m] * count + i] < distances[medoids[labels[i]] * count + i]) {
        labels[i] = m;
      }
    }
  }
}

/* The member of each cluster with the least sum of distances to the others. Returns whether any changed. */
static int choose(size_t count, const double *distances, size_t fixed, size_t wanted, const size_t *labels,
                  size_t *medoids)
{
  int changed = 0;
  for (size_t m = fixed; m < wanted; m++) {
    double least = INFINITY;
    size_t best = medoids[m];
    for (size_t candidate = 0; candidate < count; candidate++) {
      double sum = 0;
      for (size_t i = 0; i < count && labels[candidate] == m; i++) {
        sum += labels[i] == m ? distances[candidate * count + i] : 0;
      }
      if (labels[candidate] == m && sum < least * (1 - 1e-12)) {
        least = sum;
        best = candidate;
      }
    }
    changed |= best != medoids[m];
    medoids[m] = best;
  }
  return changed;
}

static int compare(const void *left, const void *right)
{
  size_t const a = *(const size_t *)left, b = *(const size_t *)right;
  return (a > b) - (a < b);
}

exm_status medoids_find(size_t count, const double *distances, size_t fixed, size_t wanted, size_t *medoids)
{
  arena scratch = {0};
  double *nearest = ARENA_NEW(&scratch, double, count);
  unsigned char *is_medoid = ARENA_NEW(&scratch, unsigned char, count);
  size_t *labels = ARENA_NEW(&scratch, size_t, count);
  exm_status const status = nearest && is_medoid && labels ? EXM_OK : status_no_memory("the reduction of atoms");
  if (status == EXM_OK) {
    begin(count, distances, fixed, wanted, nearest, is_medoid, medoids);
    for (int round = 0; round < ROUNDS; round++) {
      assign(count, distances, wanted, medoids, labels);
      if (!choose(count, distances, fixed, wanted, labels, medoids)) {
        break;
      }
    }
    qsort(medoids, wanted, sizeof *medoids, compare);
  }
  arena_release(&scratch);
  return status;
}
