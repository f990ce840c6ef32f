/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lloyd's algorithm, seeded as in Arthur and Vassilvitskii, "k-means++: the advantages of careful seeding", 2007, with
 * a few candidates a seed of which the best is taken.
 *
 * The nearest centre is the one of smallest |c|^2 - 2 x.c, which is computed for all centres at once and for the
 * nonzero entries of x alone: rows of skinning weights have few. That is fast enough to do without bounds on distances.
 * Large inputs are clustered by a sample first, and then corrected in a few rounds. */
#include "numeric/clustering.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/simd.h"

enum {
  SAMPLE = 8192,       /* rows, at most twice that */
  CANDIDATES = 3,      /* a seed */
  SAMPLE_ROUNDS = 100, /* of Lloyd's algorithm */
  FULL_ROUNDS = 10,    /* after the sample's */
  VECTOR = 16          /* floats; centres are padded to a multiple of it */
};

typedef struct clusterer {
  const float *rows;
  const double *masses;
  size_t count, dimension;
  size_t stride; /* 1: all rows; n: every n-th, while sampling */
  size_t clusters, padded;
  double *centres; /* [clusters][dimension] */
  float *columns;  /* [dimension][padded] centres, transposed */
  float *offsets;  /* [padded] |c|^2 */
  float *scores;   /* [padded] */
  double *weights; /* [clusters] */
  uint32_t *labels;
} clusterer;

/* --------------------------------------------------------------------------------------------------------- seeding */

/* Knuth's multiplier (MMIX); the high bits are the good ones. */
static double next_uniform(uint64_t *state)
{
  *state = *state * 6364136223846793005u + 1442695040888963407u;
  return (double)(*state >> 11) * 0x1p-53;
}

/* distances[i] = min(limits[i], |x_i - x_chosen|^2) for the transposed sample [dimension][n]; exactly 0 where rows are
 * equal. */
SIMD_CLONES static void distances_to(const float *sample, size_t n, size_t dimension, size_t chosen,
                                     const float *limits, float *distances)
{
  memset(distances, 0, n * sizeof *distances);
  for (size_t d = 0; d < dimension; d++) {
    const float *column = sample + d * n;
    float const centre = column[chosen];
    for (size_t i = 0; i < n; i++) {
      float const difference = column[i] - centre;
      distances[i] += difference * difference;
    }
  }
  for (size_t i = 0; i < n; i++) {
    distances[i] = limits[i] < distances[i] ? limits[i] : distances[i];
  }
}

/* An index drawn with probability mass x distance; `total` is their sum. */
static size_t draw(const float *distances, const double *masses, size_t n, double total, uint64_t *state)
{
  double left = next_uniform(state) * total;
  size_t last = 0;
  for (size_t i = 0; i < n; i++) {
    double const share = masses[i] * (double)distances[i];
    if (share > 0) {
      last = i;
      left -= share;
      if (left < 0) {
        break;
      }
    }
  }
  return last;
}

static double potential(const float *distances, const double *masses, size_t n)
{
  double total = 0;
  for (size_t i = 0; i < n; i++) {
    total += masses[i] * (double)distances[i];
  }
  return total;
}

static void swap(float **a, float **b)
{
  float *const kept = *a;
  *a = *b;
  *b = kept;
}

/* Centres from a transposed sample; fewer where it has fewer different rows. */
static exm_status seed(arena *scratch, clusterer *c, const float *sample, const double *masses, size_t n)
{
  size_t const wanted = c->clusters;
  uint64_t state = 1;
  float *ones = ARENA_NEW(scratch, float, n);
  float *distances = ARENA_NEW(scratch, float, n);
  float *tried = ARENA_NEW(scratch, float, n);
  float *best = ARENA_NEW(scratch, float, n);
  if (!ones || !distances || !tried || !best) {
    return status_no_memory("clustering");
  }
  for (size_t i = 0; i < n; i++) {
    ones[i] = 1;
    distances[i] = INFINITY;
  }
  const float *odds = ones; /* the first is drawn by mass alone */
  double total = potential(odds, masses, n);
  for (c->clusters = 0; c->clusters < wanted && total > 0; c->clusters++) {
    double lowest = INFINITY;
    size_t chosen = 0;
    for (int candidate = 0; candidate < CANDIDATES; candidate++) {
      size_t const i = draw(odds, masses, n, total, &state);
      distances_to(sample, n, c->dimension, i, distances, tried);
      double const after = potential(tried, masses, n);
      if (after < lowest) {
        lowest = after;
        chosen = i;
        swap(&tried, &best);
      }
    }
    swap(&distances, &best);
    odds = distances;
    total = lowest;
    for (size_t d = 0; d < c->dimension; d++) {
      c->centres[c->clusters * c->dimension + d] = (double)sample[d * n + chosen];
    }
  }
  return EXM_OK;
}

static exm_status seed_from_sample(clusterer *c)
{
  arena scratch = {0};
  size_t const n = (c->count + c->stride - 1) / c->stride;
  float *sample = ARENA_NEW(&scratch, float, n * c->dimension);
  double *masses = ARENA_NEW(&scratch, double, n);
  exm_status status = sample && masses ? EXM_OK : status_no_memory("clustering");
  if (status == EXM_OK) {
    for (size_t i = 0; i < n; i++) {
      masses[i] = c->masses[i * c->stride];
      for (size_t d = 0; d < c->dimension; d++) {
        sample[d * n + i] = c->rows[i * c->stride * c->dimension + d];
      }
    }
    status = seed(&scratch, c, sample, masses, n);
  }
  arena_release(&scratch);
  return status;
}

/* ---------------------------------------------------------------------------------------------------------- rounds */

static void transpose_centres(clusterer *c)
{
  for (size_t k = 0; k < c->padded; k++) {
    double square = 0;
    for (size_t d = 0; d < c->dimension; d++) {
      double const value = k < c->clusters ? c->centres[k * c->dimension + d] : 0;
      c->columns[d * c->padded + k] = (float)value;
      square += value * value;
    }
    c->offsets[k] = k < c->clusters ? (float)square : INFINITY;
  }
}

/* The first index of the smallest score; several running minima, for the sake of SIMD. */
INLINE uint32_t smallest(const float *scores, size_t padded)
{
  float low[VECTOR];
  uint32_t where[VECTOR];
  for (uint32_t lane = 0; lane < VECTOR; lane++) {
    low[lane] = scores[lane];
    where[lane] = lane;
  }
  for (uint32_t k = VECTOR; k < padded; k += VECTOR) {
    for (uint32_t lane = 0; lane < VECTOR; lane++) {
      float const score = scores[k + lane];
      where[lane] = score < low[lane] ? k + lane : where[lane];
      low[lane] = score < low[lane] ? score : low[lane];
    }
  }
  uint32_t first = 0;
  for (uint32_t lane = 1; lane < VECTOR; lane++) {
    int const is_lower = low[lane] < low[first] || (low[lane] == low[first] && where[lane] < where[first]);
    first = is_lower ? lane : first;
  }
  return where[first];
}

/* Label the rows; returns how many labels changed. */
SIMD_CLONES static size_t assign(clusterer *c)
{
  size_t changed = 0;
  float *scores = c->scores;
  for (size_t i = 0; i < c->count; i += c->stride) {
    const float *row = c->rows + i * c->dimension;
    memcpy(scores, c->offsets, c->padded * sizeof *scores);
    for (size_t d = 0; d < c->dimension; d++) {
      float const twice = -2 * row[d];
      const float *column = c->columns + d * c->padded;
      if (twice == 0) {
        continue;
      }
      for (size_t k = 0; k < c->padded; k++) {
        scores[k] += twice * column[k];
      }
    }
    uint32_t const nearest = smallest(scores, c->padded);
    changed += c->labels[i] != nearest;
    c->labels[i] = nearest;
  }
  return changed;
}

static double distance_to_centre(const clusterer *c, size_t i)
{
  double total = 0;
  for (size_t d = 0; d < c->dimension; d++) {
    double const difference = (double)c->rows[i * c->dimension + d] - c->centres[c->labels[i] * c->dimension + d];
    total += difference * difference;
  }
  return total;
}

/* An empty cluster starts again at the row that costs most where it is. */
static void refill(clusterer *c, size_t cluster)
{
  size_t worst = 0;
  double most = -1;
  for (size_t i = 0; i < c->count; i += c->stride) {
    double const cost = c->masses[i] * distance_to_centre(c, i);
    if (cost > most) {
      most = cost;
      worst = i;
    }
  }
  for (size_t d = 0; d < c->dimension; d++) {
    c->centres[cluster * c->dimension + d] = (double)c->rows[worst * c->dimension + d];
  }
  c->labels[worst] = (uint32_t)cluster; /* not to be taken twice */
}

static void move_centres(clusterer *c)
{
  memset(c->centres, 0, c->clusters * c->dimension * sizeof *c->centres);
  memset(c->weights, 0, c->clusters * sizeof *c->weights);
  for (size_t i = 0; i < c->count; i += c->stride) {
    const float *row = c->rows + i * c->dimension;
    double *centre = c->centres + c->labels[i] * c->dimension;
    c->weights[c->labels[i]] += c->masses[i];
    for (size_t d = 0; d < c->dimension; d++) {
      centre[d] += c->masses[i] * (double)row[d];
    }
  }
  for (size_t k = 0; k < c->clusters; k++) {
    for (size_t d = 0; d < c->dimension && c->weights[k] > 0; d++) {
      c->centres[k * c->dimension + d] /= c->weights[k];
    }
  }
  for (size_t k = 0; k < c->clusters; k++) {
    if (!(c->weights[k] > 0)) {
      refill(c, k);
    }
  }
}

static void run(clusterer *c, int rounds)
{
  for (int round = 0; round < rounds; round++) {
    transpose_centres(c);
    if (assign(c) == 0 && round > 0) {
      break;
    }
    move_centres(c);
  }
  transpose_centres(c);
  assign(c);
}

/* Number clusters by their lowest member, and leave out those that rounding keeps empty. */
static exm_status renumber(const clusterer *c, size_t *made)
{
  arena scratch = {0};
  uint32_t *numbers = ARENA_NEW(&scratch, uint32_t, c->clusters);
  if (!numbers) {
    return status_no_memory("clustering");
  }
  uint32_t next = 0;
  for (size_t i = 0; i < c->count; i++) {
    uint32_t *number = &numbers[c->labels[i]];
    if (*number == 0) {
      *number = ++next;
    }
    c->labels[i] = *number - 1;
  }
  arena_release(&scratch);
  *made = next;
  return EXM_OK;
}

exm_status clustering_kmeans(const float *rows, size_t count, size_t dimension, const double *masses, size_t clusters,
                             uint32_t *labels, size_t *made)
{
  arena memory = {0};
  clusterer c = {.rows = rows, .masses = masses, .count = count, .dimension = dimension};
  c.labels = labels;
  c.clusters = clusters < count ? clusters : count;
  c.padded = (c.clusters + VECTOR - 1) / VECTOR * VECTOR;
  c.stride = count / SAMPLE > 1 ? count / SAMPLE : 1;
  if (c.clusters > SAMPLE / 4) {
    c.stride = 1; /* a sample would not know them all */
  }
  c.centres = ARENA_NEW(&memory, double, c.clusters *dimension);
  c.columns = ARENA_NEW(&memory, float, c.padded *dimension);
  c.offsets = ARENA_NEW(&memory, float, c.padded);
  c.scores = ARENA_NEW(&memory, float, c.padded);
  c.weights = ARENA_NEW(&memory, double, c.clusters);
  exm_status status =
      c.centres && c.columns && c.offsets && c.scores && c.weights ? EXM_OK : status_no_memory("clustering");
  if (status == EXM_OK && (status = seed_from_sample(&c)) == EXM_OK) {
    run(&c, SAMPLE_ROUNDS);
    if (c.stride > 1) {
      c.stride = 1;
      run(&c, FULL_ROUNDS);
    }
    status = renumber(&c, made);
  }
  arena_release(&memory);
  return status;
}
