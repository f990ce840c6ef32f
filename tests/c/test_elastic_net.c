/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The elastic net by its optimality conditions, computed from the data rather than the Gram matrix; k-medoids by trying
 * all. */
#include "numeric/elastic_net.h"

#include "harness.h"
#include "numeric/medoids.h"

enum { ROWS = 12, COUNT = 30 };

typedef struct problem {
  double A[ROWS][COUNT], y[ROWS], gram[COUNT * COUNT], product[COUNT], ridge[COUNT], lasso[COUNT];
} problem;

static void make(problem *p, uint64_t seed, double ridge, double lasso)
{
  test_random random = {seed};
  memset(p, 0, sizeof *p);
  for (size_t r = 0; r < ROWS; r++) {
    p->y[r] = test_uniform(&random) - 0.5;
    for (size_t j = 0; j < COUNT; j++) {
      /* The second half resembles the first: nearly collinear columns. */
      p->A[r][j] = j < COUNT / 2 ? test_uniform(&random) - 0.5 : p->A[r][j - COUNT / 2] + 0.2 * test_uniform(&random);
    }
  }
  for (size_t i = 0; i < COUNT; i++) {
    p->ridge[i] = ridge;
    p->lasso[i] = i == 0 ? 0 : lasso; /* the first is not penalised */
    for (size_t r = 0; r < ROWS; r++) {
      p->product[i] += p->A[r][i] * p->y[r];
      for (size_t j = 0; j < COUNT; j++) {
        p->gram[i * COUNT + j] += p->A[r][i] * p->A[r][j];
      }
    }
  }
}

static size_t solve(const problem *p, double *x)
{
  double scratch[COUNT];
  elastic_net const net = {.count = COUNT,
                           .gram = p->gram,
                           .ridge = p->ridge,
                           .lasso = p->lasso,
                           .path_count = 10,
                           .sweep_limit = 20000,
                           .tolerance = 1e-10};
  CHECK(elastic_net_solve(&net, p->product, scratch, x) < 1e-6);
  size_t used = 0;
  for (size_t j = 0; j < COUNT; j++) {
    used += x[j] != 0;
  }
  return used;
}

TEST(subgradients_vanish)
{
  static problem p;
  double x[COUNT];
  for (uint64_t seed = 1; seed < 20; seed++) {
    double const lasso = 0.02 * (double)(seed % 5);
    make(&p, seed, 1e-2, lasso);
    test_about("seed %d", (int)seed);
    solve(&p, x);
    for (size_t j = 0; j < COUNT; j++) {
      double slope = p.ridge[j] * x[j];
      for (size_t r = 0; r < ROWS; r++) {
        double residual = -p.y[r];
        for (size_t i = 0; i < COUNT; i++) {
          residual += p.A[r][i] * x[i];
        }
        slope += p.A[r][j] * residual;
      }
      if (x[j] != 0) {
        CHECK_NEAR(slope, -copysign(p.lasso[j], x[j]), 1e-6);
      } else {
        CHECK(fabs(slope) <= p.lasso[j] + 1e-6);
      }
    }
  }
  test_about(NULL);
}

TEST(more_lasso_means_fewer_unknowns)
{
  static problem p;
  double x[COUNT];
  make(&p, 3, 1e-2, 0);
  CHECK(solve(&p, x) == COUNT);
  make(&p, 3, 1e-2, 0.15);
  size_t const some = solve(&p, x);
  CHECK(some > 1 && some < ROWS);
  make(&p, 3, 1e-2, 100);
  CHECK(solve(&p, x) == 1 && x[0] != 0);
}

TEST(empty_columns_and_nothing_to_fit)
{
  static problem p;
  double x[COUNT], scratch[COUNT];
  make(&p, 5, 1e-2, 0.01);
  p.ridge[4] = 0;
  for (size_t i = 0; i < COUNT; i++) {
    p.gram[4 * COUNT + i] = p.gram[i * COUNT + 4] = 0;
  }
  p.product[4] = 0;
  solve(&p, x);
  CHECK(x[4] == 0);
  memset(p.product, 0, sizeof p.product);
  elastic_net const net = {.count = COUNT,
                           .gram = p.gram,
                           .ridge = p.ridge,
                           .lasso = p.lasso,
                           .path_count = 1,
                           .sweep_limit = 10,
                           .tolerance = 1e-6};
  CHECK(elastic_net_solve(&net, p.product, scratch, x) == 0);
  for (size_t j = 0; j < COUNT; j++) {
    CHECK(x[j] == 0);
  }
}

/* --------------------------------------------------------------------------------------------------------- medoids */

enum { POINTS = 12, WANTED = 3 };

static double cost_of(const double *distances, size_t count, const size_t *medoids, size_t wanted)
{
  double sum = 0;
  for (size_t i = 0; i < count; i++) {
    double least = INFINITY;
    for (size_t m = 0; m < wanted; m++) {
      least = fmin(least, distances[medoids[m] * count + i]);
    }
    sum += least;
  }
  return sum;
}

static void spread(test_random *random, double *distances)
{
  double places[POINTS][2];
  for (size_t i = 0; i < POINTS; i++) {
    places[i][0] = test_uniform(random) + 5 * (double)(i % WANTED);
    places[i][1] = test_uniform(random);
  }
  for (size_t i = 0; i < POINTS; i++) {
    for (size_t j = 0; j < POINTS; j++) {
      distances[i * POINTS + j] = hypot(places[i][0] - places[j][0], places[i][1] - places[j][1]);
    }
  }
}

TEST(medoids_of_clusters_are_the_best_there_are)
{
  double distances[POINTS * POINTS];
  test_random random = {11};
  for (int round = 0; round < 10; round++) {
    size_t found[WANTED];
    double best = INFINITY;
    spread(&random, distances);
    CHECK(medoids_find(POINTS, distances, 0, WANTED, found) == EXM_OK);
    for (size_t a = 0; a < POINTS; a++) {
      for (size_t b = a + 1; b < POINTS; b++) {
        for (size_t c = b + 1; c < POINTS; c++) {
          size_t const tried[WANTED] = {a, b, c};
          best = fmin(best, cost_of(distances, POINTS, tried, WANTED));
        }
      }
    }
    CHECK_NEAR(cost_of(distances, POINTS, found, WANTED), best, 1e-9);
    CHECK(found[0] < found[1] && found[1] < found[2]);
  }
}

TEST(fixed_medoids_stay)
{
  double distances[POINTS * POINTS];
  size_t found[WANTED + 1];
  test_random random = {12};
  spread(&random, distances);
  CHECK(medoids_find(POINTS, distances, 2, WANTED + 1, found) == EXM_OK);
  CHECK(found[0] == 0 && found[1] == 1);
  CHECK(medoids_find(POINTS, distances, 2, 2, found) == EXM_OK);
  CHECK(found[0] == 0 && found[1] == 1);
}
