/* SPDX-License-Identifier: GPL-3.0-or-later */
/* k-means by its laws: a partition, at a local optimum, no worse than plain farthest-point clusters. */
#include "allocation.h"
#include "harness.h"
#include "numeric/clustering.h"

typedef struct input {
  size_t count, dimension;
  float *rows;
  double *masses;
  uint32_t *labels;
} input;

static input input_create(size_t count, size_t dimension)
{
  return (input){count, dimension, test_array(count * dimension, sizeof(float)), test_array(count, sizeof(double)),
                 test_array(count, sizeof(uint32_t))};
}

static void input_free(input *in)
{
  free(in->rows);
  free(in->masses);
  free(in->labels);
}

/* Rows like those of skinning weights: few entries, that sum to 1. */
static input random_weights(size_t count, size_t dimension, uint64_t seed)
{
  test_random random = {seed};
  input in = input_create(count, dimension);
  memset(in.rows, 0, count * dimension * sizeof(float));
  for (size_t i = 0; i < count; ++i) {
    double const t = test_uniform(&random) * (double)(dimension - 1);
    size_t const first = (size_t)t;
    in.rows[i * dimension + first] = (float)(1 - (t - (double)first));
    in.rows[i * dimension + first + 1] = (float)(t - (double)first);
    in.masses[i] = 0.1 + test_uniform(&random);
  }
  return in;
}

static double distance2(const input *in, size_t i, const double *centre)
{
  double total = 0;
  for (size_t d = 0; d < in->dimension; ++d) {
    double const difference = (double)in->rows[i * in->dimension + d] - centre[d];
    total += difference * difference;
  }
  return total;
}

/* Centres of mass [made][dimension] of the labelled clusters. */
static double *centres_of(const input *in, size_t made)
{
  double *centres = test_array(made * in->dimension, sizeof *centres), *weights = test_array(made, sizeof *weights);
  memset(centres, 0, made * in->dimension * sizeof *centres);
  memset(weights, 0, made * sizeof *weights);
  for (size_t i = 0; i < in->count; ++i) {
    weights[in->labels[i]] += in->masses[i];
    for (size_t d = 0; d < in->dimension; ++d) {
      centres[in->labels[i] * in->dimension + d] += in->masses[i] * (double)in->rows[i * in->dimension + d];
    }
  }
  for (size_t k = 0; k < made * in->dimension; ++k) {
    centres[k] /= weights[k / in->dimension];
  }
  free(weights);
  return centres;
}

static void check_partition(const input *in, size_t made)
{
  uint32_t next = 0;
  for (size_t i = 0; i < in->count; ++i) {
    CHECK(in->labels[i] <= next); /* numbered by lowest member */
    next += in->labels[i] == next;
  }
  CHECK(next == made); /* none is empty */
}

TEST(a_partition_at_a_local_optimum)
{
  for (uint64_t seed = 0; seed < 5; ++seed) {
    input in = random_weights(2000, 6, seed);
    size_t made = 0;
    test_about("seed %d", (int)seed);
    REQUIRE(clustering_kmeans(in.rows, in.count, in.dimension, in.masses, 12, in.labels, &made) == EXM_OK);
    CHECK(made == 12);
    check_partition(&in, made);
    double *centres = centres_of(&in, made);
    for (size_t i = 0; i < in.count; ++i) {
      double const own = distance2(&in, i, centres + in.labels[i] * in.dimension);
      for (size_t k = 0; k < made; ++k) {
        CHECK(own <= distance2(&in, i, centres + k * in.dimension) + 1e-5);
      }
    }
    free(centres);
    input_free(&in);
  }
}

TEST(separate_heaps_are_found)
{
  enum { HEAPS = 9, EACH = 40 };
  test_random random = {3};
  input in = input_create(HEAPS * EACH, 3);
  for (size_t i = 0; i < in.count; ++i) {
    for (size_t d = 0; d < 3; ++d) {
      double const heap = d == 0 ? (double)(i % HEAPS % 3) : d == 1 ? (double)(i % HEAPS / 3) : 0;
      in.rows[3 * i + d] = (float)(heap + 0.1 * test_uniform(&random));
    }
    in.masses[i] = 1;
  }
  size_t made = 0;
  REQUIRE(clustering_kmeans(in.rows, in.count, 3, in.masses, HEAPS, in.labels, &made) == EXM_OK);
  CHECK(made == HEAPS);
  for (size_t i = 0; i < in.count; ++i) {
    CHECK(in.labels[i] == i % HEAPS);
  }
  input_free(&in);
}

TEST(fewer_rows_than_clusters)
{
  input in = input_create(30, 4);
  size_t made = 0;
  memset(in.rows, 0, 30 * 4 * sizeof(float));
  for (size_t i = 0; i < 30; ++i) {
    in.rows[4 * i + i % 3] = 1;
    in.masses[i] = 1;
  }
  REQUIRE(clustering_kmeans(in.rows, 30, 4, in.masses, 8, in.labels, &made) == EXM_OK);
  CHECK(made == 3);
  for (uint32_t i = 0; i < 30; ++i) {
    CHECK(in.labels[i] == i % 3);
  }
  REQUIRE(clustering_kmeans(in.rows, 2, 4, in.masses, 100, in.labels, &made) == EXM_OK);
  CHECK(made == 2);
  REQUIRE(clustering_kmeans(in.rows, 30, 4, in.masses, 1, in.labels, &made) == EXM_OK);
  CHECK(made == 1);
  input_free(&in);
}

TEST(masses_count)
{
  /* Two clusters of three points on a line: the heavy pair decides where the cut is. */
  float const rows[] = {0, 1, 2};
  double const left[] = {1000, 1000, 1}, right[] = {1, 1000, 1000};
  uint32_t labels[3];
  size_t made;
  REQUIRE(clustering_kmeans(rows, 3, 1, left, 2, labels, &made) == EXM_OK);
  CHECK(labels[0] == 0 && labels[1] == 1 && labels[2] == 1);
  REQUIRE(clustering_kmeans(rows, 3, 1, right, 2, labels, &made) == EXM_OK);
  CHECK(labels[0] == 0 && labels[1] == 0 && labels[2] == 1);
}

TEST(large_inputs_and_determinism)
{
  input in = random_weights(50000, 20, 8), again = random_weights(50000, 20, 8);
  size_t made, made_again;
  REQUIRE(clustering_kmeans(in.rows, in.count, in.dimension, in.masses, 40, in.labels, &made) == EXM_OK);
  REQUIRE(clustering_kmeans(again.rows, in.count, in.dimension, in.masses, 40, again.labels, &made_again) == EXM_OK);
  CHECK(made == 40 && made_again == 40);
  CHECK(memcmp(in.labels, again.labels, in.count * sizeof *in.labels) == 0);
  check_partition(&in, made);
  /* Weights that change hands evenly along a line: forty pieces of a nineteenth of the line's length over forty have a
   * variance of about this each; twice as much would be poor. */
  double *centres = centres_of(&in, made), cost = 0, mass = 0;
  for (size_t i = 0; i < in.count; ++i) {
    cost += in.masses[i] * distance2(&in, i, centres + in.labels[i] * in.dimension);
    mass += in.masses[i];
  }
  double const piece = 19.0 / 40;
  CHECK(cost / mass < 2 * 2 * piece * piece / 12);
  free(centres);
  input_free(&in);
  input_free(&again);
}

static exm_status cluster(void *context)
{
  const input *in = context;
  size_t made;
  return clustering_kmeans(in->rows, in->count, in->dimension, in->masses, 5, in->labels, &made);
}

TEST(every_allocation_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  input in = random_weights(100, 4, 1);
  CHECK(for_each_failed_allocation(cluster, &in) >= 8);
  input_free(&in);
}
