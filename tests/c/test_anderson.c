/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Anderson mixing, on maps whose fixed points are known. */
#include "harness.h"
#include "numeric/anderson.h"

enum { N = 6 };

/* x -> M x + b, a contraction with fixed point `solution`. */
typedef struct linear_map {
  double M[N][N], b[N], solution[N];
} linear_map;

static linear_map random_map(test_random *random, double contraction)
{
  linear_map map;
  for (int i = 0; i < N; ++i) {
    map.solution[i] = 2 * test_uniform(random) - 1;
    for (int j = 0; j < N; ++j) {
      map.M[i][j] = contraction * (2 * test_uniform(random) - 1) / N;
    }
    map.M[i][i] += contraction * (0.2 + 0.1 * i);
  }
  for (int i = 0; i < N; ++i) {
    map.b[i] = map.solution[i];
    for (int j = 0; j < N; ++j) {
      map.b[i] -= map.M[i][j] * map.solution[j];
    }
  }
  return map;
}

static void apply(const linear_map *map, const double x[N], double image[N])
{
  for (int i = 0; i < N; ++i) {
    image[i] = map->b[i];
    for (int j = 0; j < N; ++j) {
      image[i] += map->M[i][j] * x[j];
    }
  }
}

static double error_of(const linear_map *map, const double x[N])
{
  double error = 0;
  for (int i = 0; i < N; ++i) {
    error = fmax(error, fabs(x[i] - map->solution[i]));
  }
  return error;
}

TEST(a_linear_map_of_n_unknowns_takes_n_steps_and_one)
{
  test_random random = {1};
  for (int round = 0; round < 20; ++round) {
    linear_map const map = random_map(&random, 0.9);
    arena memory = {0};
    anderson mixing;
    double x[N] = {0}, image[N], plain[N] = {0};
    test_about("round %d", round);
    CHECK_STATUS(anderson_create(&memory, N, N, &mixing), EXM_OK);
    for (int step = 0; step <= N; ++step) {
      apply(&map, x, image);
      anderson_mix(&mixing, image, x);
      apply(&map, plain, image);
      memcpy(plain, image, sizeof plain);
    }
    /* The regularisation leaves a little, which shrinks with every further step. */
    CHECK_NEAR(error_of(&map, x), 0, 1e-4);
    CHECK(error_of(&map, x) < 0.01 * error_of(&map, plain));
    for (int step = 0; step < 6; ++step) {
      apply(&map, x, image);
      anderson_mix(&mixing, image, x);
    }
    CHECK_NEAR(error_of(&map, x), 0, 1e-9);
    arena_release(&memory);
  }
}

TEST(a_short_memory_still_beats_the_plain_iteration)
{
  test_random random = {2};
  linear_map const map = random_map(&random, 1.0);
  arena memory = {0};
  anderson mixing;
  double x[N] = {0}, plain[N] = {0}, image[N];
  CHECK_STATUS(anderson_create(&memory, N, 2, &mixing), EXM_OK);
  for (int step = 0; step < 30; ++step) {
    apply(&map, x, image);
    anderson_mix(&mixing, image, x);
    apply(&map, plain, image);
    memcpy(plain, image, sizeof plain);
  }
  CHECK(error_of(&map, x) < 0.1 * error_of(&map, plain));
  arena_release(&memory);
}

TEST(the_first_step_and_the_first_after_a_reset_are_plain)
{
  test_random random = {3};
  linear_map const map = random_map(&random, 0.8);
  arena memory = {0};
  anderson mixing;
  double x[N] = {0}, image[N];
  CHECK_STATUS(anderson_create(&memory, N, 4, &mixing), EXM_OK);
  for (int round = 0; round < 3; ++round) {
    apply(&map, x, image);
    anderson_mix(&mixing, image, x);
    CHECK(memcmp(x, image, sizeof x) == 0);
    for (int step = 0; step < 3; ++step) {
      apply(&map, x, image);
      anderson_mix(&mixing, image, x);
      CHECK(memcmp(x, image, sizeof x) != 0);
    }
    anderson_reset(&mixing);
  }
  arena_release(&memory);
}

/* At a fixed point nothing changes any more, and residual steps of zero length are not divided by. */
TEST(it_stays_at_a_fixed_point)
{
  test_random random = {4};
  linear_map const map = random_map(&random, 0.5);
  arena memory = {0};
  anderson mixing;
  double x[N], image[N];
  memcpy(x, map.solution, sizeof x);
  CHECK_STATUS(anderson_create(&memory, N, 4, &mixing), EXM_OK);
  for (int step = 0; step < 50; ++step) {
    memcpy(image, map.solution, sizeof image);
    anderson_mix(&mixing, image, x);
    CHECK_NEAR(error_of(&map, x), 0, 1e-15);
  }
  arena_release(&memory);
}

/* Mixed iterates are affine combinations of the images: what every image satisfies, they satisfy. */
TEST(affine_constraints_of_the_map_are_kept)
{
  test_random random = {5};
  arena memory = {0};
  anderson mixing;
  double x[N] = {1}, image[N];
  CHECK_STATUS(anderson_create(&memory, N, 5, &mixing), EXM_OK);
  for (int step = 0; step < 40; ++step) {
    double sum = 0, mixed = 0;
    for (int i = 0; i < N; ++i) {
      image[i] = 0.5 * cos(x[i]) + 0.3 * x[(i + 1) % N] + 0.1 * test_uniform(&random);
      sum += image[i];
    }
    image[N - 1] += 1 - sum;
    anderson_mix(&mixing, image, x);
    for (int i = 0; i < N; ++i) {
      mixed += x[i];
    }
    CHECK_NEAR(mixed, 1, 1e-10);
  }
  arena_release(&memory);
}
