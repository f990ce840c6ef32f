/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The cone program over simplices, against searches that know nothing of faces. Programs are made as the deformer's
 * are: q(B) = 1/2 |C B - y|^2 + rest. */
#include "harness.h"
#include "numeric/cone.h"

enum { MOST = 160, MOST_ROWS = 64, MOST_BLOCKS = 41 };

typedef struct random_program {
  size_t rows, offsets[MOST_BLOCKS + 1];
  double C[MOST_ROWS][MOST], y[MOST_ROWS];
  double Q[MOST * MOST], p[MOST], l[MOST];
  cone_program program;
} random_program;

/* Q, p and k from C, y and the rest. */
static void assemble(random_program *made, double rest)
{
  size_t const n = made->program.count;
  double k = rest;
  for (size_t i = 0; i < n; ++i) {
    made->p[i] = 0;
    for (size_t r = 0; r < made->rows; ++r) {
      made->p[i] += made->C[r][i] * made->y[r];
    }
    for (size_t j = 0; j < n; ++j) {
      made->Q[i * n + j] = 0;
      for (size_t r = 0; r < made->rows; ++r) {
        made->Q[i * n + j] += made->C[r][i] * made->C[r][j];
      }
    }
  }
  for (size_t r = 0; r < made->rows; ++r) {
    k += made->y[r] * made->y[r] / 2;
  }
  made->program.Q = made->Q;
  made->program.p = made->p;
  made->program.l = made->l;
  made->program.k = k;
  made->program.offsets = made->offsets;
}

static double signed_uniform(test_random *random)
{
  return 2 * test_uniform(random) - 1;
}

/* Blocks of `size` unknowns; y is at random, or what some feasible B gives. */
static void make(random_program *made, test_random *random, size_t blocks, size_t size, size_t rows, double lambda,
                 int is_reachable)
{
  memset(made, 0, sizeof *made);
  made->rows = rows;
  made->program.count = blocks * size;
  made->program.block_count = blocks;
  for (size_t b = 0; b <= blocks; ++b) {
    made->offsets[b] = b * size;
  }
  for (size_t r = 0; r < rows; ++r) {
    made->y[r] = is_reachable ? 0 : signed_uniform(random);
    for (size_t i = 0; i < blocks * size; ++i) {
      made->C[r][i] = signed_uniform(random);
      made->y[r] += is_reachable ? made->C[r][i] / (double)size : 0;
    }
  }
  for (size_t i = 0; i < blocks * size; ++i) {
    made->l[i] = lambda * test_uniform(random);
  }
  assemble(made, 0);
}

static double value_of(const random_program *made, const double *B)
{
  double square = 2 * made->program.k, cost = 0;
  for (size_t r = 0; r < made->rows; ++r) {
    square -= made->y[r] * made->y[r];
  }
  for (size_t r = 0; r < made->rows; ++r) {
    double residual = -made->y[r];
    for (size_t i = 0; i < made->program.count; ++i) {
      residual += made->C[r][i] * B[i];
    }
    square += residual * residual;
  }
  for (size_t i = 0; i < made->program.count; ++i) {
    cost += made->l[i] * B[i];
  }
  return sqrt(fmax(square, 0) / 2) + cost;
}

static void start_at(const random_program *made, double *B, size_t which)
{
  memset(B, 0, made->program.count * sizeof *B);
  for (size_t b = 0; b < made->program.block_count; ++b) {
    size_t const size = made->offsets[b + 1] - made->offsets[b];
    B[made->offsets[b] + which % size] = 1;
  }
}

static void start_inside(const random_program *made, double *B)
{
  for (size_t b = 0; b < made->program.block_count; ++b) {
    for (size_t i = made->offsets[b]; i < made->offsets[b + 1]; ++i) {
      B[i] = 1 / (double)(made->offsets[b + 1] - made->offsets[b]);
    }
  }
}

static void check_feasible(const random_program *made, const double *B)
{
  for (size_t b = 0; b < made->program.block_count; ++b) {
    double sum = 0;
    for (size_t i = made->offsets[b]; i < made->offsets[b + 1]; ++i) {
      CHECK(B[i] >= 0);
      sum += B[i];
    }
    CHECK_NEAR(sum, 1, 1e-14);
  }
}

static cone_result solve(const random_program *made, double *B)
{
  arena memory = {0};
  cone_workspace work;
  cone_result result = {0};
  CHECK_STATUS(cone_workspace_create(&memory, made->program.count, &work), EXM_OK);
  cone_solve(&made->program, &work, 1e-10, B, &result);
  arena_release(&memory);
  check_feasible(made, B);
  return result;
}

/* ------------------------------------------------------------------------------------------------- a second opinion */

/* The closest point of the simplex [Held, Wolfe, Crowder 1974], by bisection. */
static void project(size_t n, double *x)
{
  double low = -1e3, high = 1e3;
  for (size_t i = 0; i < n; ++i) {
    low = fmin(low, x[i] - 1);
    high = fmax(high, x[i]);
  }
  for (int step = 0; step < 100; ++step) {
    double const middle = (low + high) / 2;
    double sum = 0;
    for (size_t i = 0; i < n; ++i) {
      sum += fmax(x[i] - middle, 0);
    }
    *(sum > 1 ? &low : &high) = middle;
  }
  for (size_t i = 0; i < n; ++i) {
    x[i] = fmax(x[i] - (low + high) / 2, 0);
  }
}

/* Lower bound by duality: sqrt(q) >= <z, C B - y> / sqrt(2) + z0 sqrt(rest) for |(z, z0)| <= 1, and the rest is linear
 * in B. Subgradient ascent from the best primal point's own direction. */
static double lower_bound_of(const random_program *made, const double *z, double z0, double rest, double *gradient)
{
  double bound = z0 * sqrt(rest);
  for (size_t r = 0; r < made->rows; ++r) {
    bound -= z[r] * made->y[r] / sqrt(2);
    gradient[r] = -made->y[r] / sqrt(2);
  }
  for (size_t b = 0; b < made->program.block_count; ++b) {
    double lowest = INFINITY;
    size_t at = 0;
    for (size_t i = made->offsets[b]; i < made->offsets[b + 1]; ++i) {
      double slope = made->l[i];
      for (size_t r = 0; r < made->rows; ++r) {
        slope += z[r] * made->C[r][i] / sqrt(2);
      }
      if (slope < lowest) {
        lowest = slope;
        at = i;
      }
    }
    bound += lowest;
    for (size_t r = 0; r < made->rows; ++r) {
      gradient[r] += made->C[r][at] / sqrt(2);
    }
  }
  return bound;
}

static double best_lower_bound(const random_program *made)
{
  double z[MOST_ROWS] = {0}, gradient[MOST_ROWS], best = -INFINITY;
  for (int step = 0; step < 20000; ++step) {
    double square = 0, length = 0;
    best = fmax(best, lower_bound_of(made, z, 0, 0, gradient));
    for (size_t r = 0; r < made->rows; ++r) {
      length += gradient[r] * gradient[r];
    }
    if (length == 0) {
      break;
    }
    for (size_t r = 0; r < made->rows; ++r) {
      z[r] += gradient[r] / sqrt(length) / (1 + 0.02 * step);
      square += z[r] * z[r];
    }
    for (size_t r = 0; r < made->rows && square > 1; ++r) {
      z[r] /= sqrt(square);
    }
  }
  return best;
}

/* Projected gradient on sqrt(q + small^2), accelerated: an upper bound, close to the optimum. */
static double best_found(const random_program *made, const double *start)
{
  size_t const n = made->program.count;
  double B[MOST], ahead[MOST], next[MOST], gradient[MOST], trace = 0, best = INFINITY;
  memcpy(B, start, n * sizeof *B);
  for (size_t i = 0; i < n; ++i) {
    trace += made->Q[i * n + i];
  }
  for (double small = 0.3; small > 1e-5; small *= 0.5) {
    double momentum = 1;
    memcpy(ahead, B, n * sizeof *B);
    for (int step = 0; step < 200; ++step) {
      double q = made->program.k;
      for (size_t i = 0; i < n; ++i) {
        gradient[i] = -made->p[i];
        for (size_t j = 0; j < n; ++j) {
          gradient[i] += made->Q[i * n + j] * ahead[j];
        }
        q += ahead[i] * (gradient[i] - made->p[i]) / 2;
      }
      double const root = sqrt(fmax(q, 0) + small * small);
      for (size_t i = 0; i < n; ++i) {
        next[i] = ahead[i] - 2 * root / trace * (gradient[i] / (2 * root) + made->l[i]);
      }
      for (size_t b = 0; b < made->program.block_count; ++b) {
        project(made->offsets[b + 1] - made->offsets[b], next + made->offsets[b]);
      }
      double const later = (1 + sqrt(1 + 4 * momentum * momentum)) / 2;
      for (size_t i = 0; i < n; ++i) {
        ahead[i] = next[i] + (momentum - 1) / later * (next[i] - B[i]);
        B[i] = next[i];
      }
      momentum = later;
      best = fmin(best, value_of(made, B));
    }
  }
  return best;
}

/* f's own gradient where q > 0, from C: independent of Q's. */
static void gradient_at(const random_program *made, const double *B, double root, double *out)
{
  for (size_t i = 0; i < made->program.count; ++i) {
    out[i] = made->l[i];
  }
  for (size_t r = 0; r < made->rows; ++r) {
    double residual = -made->y[r];
    for (size_t i = 0; i < made->program.count; ++i) {
      residual += made->C[r][i] * B[i];
    }
    for (size_t i = 0; i < made->program.count; ++i) {
      out[i] += residual * made->C[r][i] / (2 * root);
    }
  }
}

/* In each block the gradient is lowest, and the same, on the unknowns in use. */
static void check_stationary(const random_program *made, const double *B, double root, double tolerance)
{
  double gradient[MOST];
  gradient_at(made, B, root, gradient);
  for (size_t b = 0; b < made->program.block_count; ++b) {
    double lowest = INFINITY;
    for (size_t i = made->offsets[b]; i < made->offsets[b + 1]; ++i) {
      lowest = fmin(lowest, gradient[i]);
    }
    for (size_t i = made->offsets[b]; i < made->offsets[b + 1]; ++i) {
      CHECK(B[i] < 1e-7 || gradient[i] - lowest <= tolerance);
    }
  }
}

/* -------------------------------------------------------------------------------------------------------- the tests */

static random_program made; /* too large for a stack */

static void start(size_t round, double *B)
{
  if (round % 3 == 0) {
    start_inside(&made, B);
  } else {
    start_at(&made, B, round);
  }
}

TEST(one_block_of_two_against_a_line_search)
{
  test_random random = {1};
  for (size_t round = 0; round < 300; ++round) {
    double const lambda = round % 4 == 0 ? 0 : 3 * test_uniform(&random);
    make(&made, &random, 1, 2, 1 + round % 4, lambda, round % 5 == 0);
    double B[2], best = INFINITY;
    for (int i = 0; i <= 20000; ++i) {
      double const at[2] = {i / 20000.0, 1 - i / 20000.0};
      best = fmin(best, value_of(&made, at));
    }
    test_about("round %zu", round);
    start(round, B);
    cone_result const result = solve(&made, B);
    CHECK_NEAR(result.value, value_of(&made, B), 1e-7);
    CHECK(value_of(&made, B) <= best + 1e-7); /* rounding of q where q is zero is 1e-16: its root is 1e-8 */
    CHECK(best <= value_of(&made, B) + 1e-4); /* the grid's own error, mind the kink */
    CHECK(result.gap >= value_of(&made, B) - best - 1e-7);
  }
}

TEST(two_blocks_of_two_and_one_of_three_against_a_grid)
{
  test_random random = {2};
  for (size_t round = 0; round < 60; ++round) {
    int const is_triangle = round % 2;
    make(&made, &random, is_triangle ? 1 : 2, is_triangle ? 3 : 2, 1 + round % 3, 2 * test_uniform(&random),
         round % 5 == 0);
    double B[4], best = INFINITY;
    for (int i = 0; i <= 300; ++i) {
      for (int j = 0; j <= 300; ++j) {
        double const a = i / 300.0, b = j / 300.0;
        double const square[4] = {a, 1 - a, b, 1 - b}, triangle[4] = {a, b * (1 - a), (1 - b) * (1 - a), 0};
        best = fmin(best, value_of(&made, is_triangle ? triangle : square));
      }
    }
    test_about("round %zu", round);
    start(round, B);
    solve(&made, B);
    CHECK(value_of(&made, B) <= best + 1e-7);
    CHECK(best <= value_of(&made, B) + 1e-2);
  }
}

TEST(smooth_optima_are_stationary_and_found_from_anywhere)
{
  test_random random = {3};
  for (size_t round = 0; round < 60; ++round) {
    size_t const blocks = 1 + round % 12, size = 1 + round % 7, rows = 3 + round % 50;
    make(&made, &random, blocks, size, rows, test_uniform(&random), 0);
    for (size_t r = 0; r < rows; ++r) {
      made.y[r] *= 3 * (double)blocks; /* out of reach: q > 0 */
    }
    assemble(&made, 0.01);
    double B[MOST], first = 0;
    for (size_t from = 0; from < 4; ++from) {
      test_about("round %zu, start %zu", round, from);
      start(from, B);
      cone_result const result = solve(&made, B);
      double const value = value_of(&made, B);
      CHECK_NEAR(result.value, value, 1e-9 * value);
      CHECK(result.gap <= 1e-8 * value);
      check_stationary(&made, B, sqrt(result.quadratic), 1e-6);
      first = from == 0 ? value : first;
      CHECK_NEAR(value, first, 1e-8 * first);
    }
  }
}

TEST(the_gap_is_no_less_than_the_distance_from_the_optimum)
{
  test_random random = {4};
  for (size_t round = 0; round < 24; ++round) {
    make(&made, &random, 1 + round % 6, 2 + round % 4, 2 + round % 9, test_uniform(&random), round % 3 == 0);
    double B[MOST], centre[MOST];
    test_about("round %zu", round);
    start_inside(&made, centre);
    double const found = best_found(&made, centre);
    start(round, B);
    cone_result const result = solve(&made, B);
    double const value = value_of(&made, B);
    CHECK(value <= found + 1e-6); /* as good as the second opinion */
    CHECK(result.gap >= value - found - 1e-8);
  }
}

/* A lower bound by duality, which no primal method can fake: the value is optimal also where q vanishes and there is no
 * gradient. */
TEST(values_meet_a_dual_bound)
{
  test_random random = {5};
  for (size_t round = 0; round < 10; ++round) {
    make(&made, &random, 1 + round % 4, 2 + round % 3, 1 + round % 6, 0.6 * test_uniform(&random), round % 2);
    double B[MOST];
    test_about("round %zu", round);
    start(round, B);
    solve(&made, B);
    double const bound = best_lower_bound(&made);
    CHECK(bound <= value_of(&made, B) + 1e-7);
    CHECK_NEAR(value_of(&made, B), bound, 2e-3 * fmax(1, value_of(&made, B)));
  }
}

/* An exemplar met exactly: y is a column, and its cost is zero. */
TEST(a_vertex_where_everything_vanishes_is_found_exactly)
{
  test_random random = {6};
  for (size_t round = 0; round < 60; ++round) {
    size_t const blocks = 1 + round % 10, size = 2 + round % 5, rows = 4 + round % 40;
    make(&made, &random, blocks, size, rows, 1, 0);
    for (size_t r = 0; r < rows; ++r) {
      made.y[r] = 0;
      for (size_t b = 0; b < blocks; ++b) {
        made.y[r] += made.C[r][made.offsets[b] + 1];
      }
    }
    for (size_t b = 0; b < blocks; ++b) {
      made.l[made.offsets[b] + 1] = 0;
    }
    assemble(&made, 0);
    double B[MOST];
    test_about("round %zu", round);
    start(round, B);
    cone_result const result = solve(&made, B);
    CHECK_NEAR(result.value, 0, 1e-7 * fmax(1, sqrt(made.program.k))); /* the root of a rounding */
    for (size_t b = 0; b < blocks; ++b) {
      CHECK_NEAR(B[made.offsets[b] + 1], 1, 1e-6);
    }
  }
}

/* Exemplars that agree in a region: columns, costs and all are equal. */
TEST(identical_columns_share)
{
  test_random random = {7};
  for (size_t round = 0; round < 30; ++round) {
    make(&made, &random, 4, 4, 10, 0.5, round % 2);
    for (size_t b = 0; b < 4; ++b) {
      for (size_t r = 0; r < made.rows; ++r) {
        made.C[r][4 * b + 3] = made.C[r][4 * b + 1];
      }
      made.l[4 * b + 3] = made.l[4 * b + 1];
    }
    assemble(&made, 0);
    double B[MOST], centre[MOST];
    test_about("round %zu", round);
    start(round, B);
    solve(&made, B);
    start_inside(&made, centre);
    CHECK(value_of(&made, B) <= best_found(&made, centre) + 1e-6);
  }
}

TEST(all_columns_identical)
{
  test_random random = {8};
  for (size_t round = 0; round < 6; ++round) {
    make(&made, &random, 3, 5, 6, 0, 0);
    for (size_t r = 0; r < made.rows; ++r) {
      for (size_t i = 0; i < 15; ++i) {
        made.C[r][i] = made.C[r][i / 5 * 5];
      }
    }
    assemble(&made, 0);
    double B[MOST];
    start(round, B);
    double const before = value_of(&made, B);
    cone_result const result = solve(&made, B);
    CHECK_NEAR(result.value, before, 1e-12);
    CHECK(result.gap <= 1e-9);
  }
}

TEST(one_unknown_a_block_has_no_choice)
{
  test_random random = {9};
  make(&made, &random, 7, 1, 5, 1, 0);
  double B[MOST];
  start_at(&made, B, 0);
  cone_result const result = solve(&made, B);
  for (size_t i = 0; i < 7; ++i) {
    CHECK(B[i] == 1);
  }
  CHECK_NEAR(result.value, value_of(&made, B), 1e-12);
  CHECK(result.gap == 0);
}

TEST(blocks_of_different_sizes)
{
  test_random random = {10};
  size_t const offsets[] = {0, 1, 5, 6, 9, 11};
  for (size_t round = 0; round < 20; ++round) {
    make(&made, &random, 1, 11, 8, 1, 0);
    memcpy(made.offsets, offsets, sizeof offsets);
    made.program.block_count = 5;
    double B[MOST], centre[MOST];
    start(round, B);
    solve(&made, B);
    start_inside(&made, centre);
    CHECK(value_of(&made, B) <= best_found(&made, centre) + 1e-6);
  }
}

TEST(without_costs_it_is_least_squares_over_simplices)
{
  test_random random = {11};
  for (size_t round = 0; round < 20; ++round) {
    make(&made, &random, 5, 4, 4 + 2 * round, 0, round % 2);
    double B[MOST], centre[MOST];
    test_about("round %zu", round);
    start(round, B);
    solve(&made, B);
    start_inside(&made, centre);
    CHECK(value_of(&made, B) <= best_found(&made, centre) + 1e-6);
  }
}

/* With nothing but costs, the cheapest of each block; with very large ones, too. */
TEST(dominant_costs_choose_the_cheapest)
{
  test_random random = {12};
  for (size_t round = 0; round < 20; ++round) {
    make(&made, &random, 6, 5, 8, 1, 0);
    for (size_t i = 0; i < 30; ++i) {
      made.l[i] *= 1e6;
    }
    double B[MOST];
    start(round, B);
    solve(&made, B);
    for (size_t b = 0; b < 6; ++b) {
      size_t cheapest = 5 * b;
      for (size_t i = 5 * b; i < 5 * b + 5; ++i) {
        cheapest = made.l[i] < made.l[cheapest] ? i : cheapest;
      }
      CHECK_NEAR(B[cheapest], 1, 1e-12);
    }
  }
}

/* f scales with lengths: nothing in the solver may know a unit. */
TEST(scale_does_not_matter)
{
  test_random random = {13};
  double const scales[] = {1e-9, 1e-3, 1e3, 1e9};
  for (size_t round = 0; round < 20; ++round) {
    test_random same = {random.state};
    make(&made, &random, 5, 4, 12, 0.5, 0);
    double unit[MOST], B[MOST];
    start(round, unit);
    double const value = solve(&made, unit).value;
    for (size_t s = 0; s < 4; ++s) {
      test_random again = same;
      make(&made, &again, 5, 4, 12, 0.5, 0);
      for (size_t r = 0; r < made.rows; ++r) {
        made.y[r] *= scales[s];
        for (size_t i = 0; i < 20; ++i) {
          made.C[r][i] *= scales[s];
        }
      }
      for (size_t i = 0; i < 20; ++i) {
        made.l[i] *= scales[s];
      }
      assemble(&made, 0);
      test_about("round %zu, scale %g", round, scales[s]);
      start(round, B);
      CHECK_NEAR(solve(&made, B).value / scales[s], value, 1e-9 * value);
      for (size_t i = 0; i < 20; ++i) {
        CHECK_NEAR(B[i], unit[i], 1e-6);
      }
    }
  }
}

/* A start at the solution of a neighbouring program, as along a drag. */
TEST(a_warm_start_ends_where_a_cold_one_does)
{
  test_random random = {14};
  make(&made, &random, 20, 3, 40, 0.5, 0);
  for (size_t r = 0; r < made.rows; ++r) {
    made.y[r] *= 8;
  }
  double warm[MOST], cold[MOST];
  start_at(&made, warm, 0);
  size_t warm_faces = 0, cold_faces = 0;
  for (size_t frame = 0; frame < 100; ++frame) {
    for (size_t r = 0; r < made.rows; ++r) {
      made.y[r] += 0.05 * signed_uniform(&random);
    }
    assemble(&made, 0);
    start_at(&made, cold, frame);
    test_about("frame %zu", frame);
    cone_result const from_last = solve(&made, warm), from_nothing = solve(&made, cold);
    CHECK_NEAR(from_last.value, from_nothing.value, 1e-8 * from_nothing.value);
    for (size_t i = 0; i < made.program.count; ++i) {
      CHECK_NEAR(warm[i], cold[i], 1e-4);
    }
    warm_faces += frame ? from_last.factorings : 0;
    cold_faces += frame ? from_nothing.factorings : 0;
  }
  CHECK(warm_faces < cold_faces);
}

TEST(large_programs_close_their_gap)
{
  test_random random = {15};
  for (size_t round = 0; round < 6; ++round) {
    make(&made, &random, 40, 4, 60, 0.3, 0);
    for (size_t r = 0; r < made.rows; ++r) {
      made.y[r] *= round < 3 ? 20 : 1;
    }
    assemble(&made, round < 3 ? 0 : 1e-3);
    double B[MOST];
    test_about("round %zu", round);
    start(round, B);
    cone_result const result = solve(&made, B);
    CHECK(result.gap <= 1e-6 * result.value);
  }
}
