/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Closest rotations against LAPACK's singular value decomposition, and their laws where that has no unique answer. */
#include <float.h>
#include <lapacke.h>

#include "harness.h"
#include "linalg/rotation.h"

enum { COUNT = 500 }; /* not a multiple of any block */

static void multiply(const double a[9], const double b[9], double out[9])
{
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    }
  }
}

static double determinant(const double m[9])
{
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}

static double inner(size_t count, const double *a, const double *b)
{
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    sum += a[i] * b[i];
  }
  return sum;
}

static double distance(const double a[9], const double b[9])
{
  double square = 0;
  for (int i = 0; i < 9; ++i) {
    square += (a[i] - b[i]) * (a[i] - b[i]);
  }
  return sqrt(square);
}

static double orthogonality_error(const double r[9])
{
  double worst = fabs(determinant(r) - 1);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double const product = r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j];
      worst = fmax(worst, fabs(product - (i == j)));
    }
  }
  return worst;
}

/* U diag(1, 1, det(U V')) V', and the singular values, the last one with that sign. */
static void closest_by_svd(const double m[9], double rotation[9], double values[3])
{
  double a[9], u[9], vt[9], superb[2];
  memcpy(a, m, sizeof a);
  if (LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'A', 'A', 3, 3, a, 3, values, u, 3, vt, 3, superb) != 0) {
    test_fail(__FILE__, __LINE__, "LAPACK gave up");
  }
  if (determinant(u) * determinant(vt) < 0) {
    values[2] = -values[2];
    u[2] = -u[2];
    u[5] = -u[5];
    u[8] = -u[8];
  }
  multiply(u, vt, rotation);
}

static double centred(test_random *random)
{
  return 2 * test_uniform(random) - 1;
}

static void random_matrix(test_random *random, double m[9])
{
  for (int i = 0; i < 9; ++i) {
    m[i] = centred(random);
  }
}

static void random_rotation(test_random *random, double r[9])
{
  double m[9], values[3];
  random_matrix(random, m);
  closest_by_svd(m, r, values);
}

/* R1 diag(a, b, c) R2 */
static void random_with_values(test_random *random, double a, double b, double c, double m[9])
{
  double left[9], right[9], product[9];
  double const diagonal[9] = {a, 0, 0, 0, b, 0, 0, 0, c};
  random_rotation(random, left);
  random_rotation(random, right);
  multiply(left, diagonal, product);
  multiply(product, right, m);
}

/* Rotations always; optimal always; equal to LAPACK's as far as the problem determines them. */
static void check_batch(size_t count, const double *matrices)
{
  double *rotations = test_array(9 * count, sizeof(double));
  rotation_fit3(count, matrices, rotations);
  for (size_t k = 0; k < count; ++k) {
    const double *m = matrices + 9 * k, *r = rotations + 9 * k;
    double expected[9], values[3];
    closest_by_svd(m, expected, values);
    double const gap = (values[1] + values[2]) / values[0];
    CHECK(orthogonality_error(r) < 1e-14);
    CHECK(values[0] + values[1] + values[2] - inner(9, r, m) <= 1e-12 * values[0]);
    CHECK(!(gap > 1e-11) || distance(r, expected) < 1e-13 / gap);
  }
  free(rotations);
}

TEST(random_matrices)
{
  test_random random = {1};
  double matrices[COUNT][9];
  for (int k = 0; k < COUNT; ++k) {
    random_matrix(&random, matrices[k]); /* half of them inverted */
  }
  check_batch(COUNT, matrices[0]);
}

TEST(gaps_of_every_width)
{
  test_random random = {2};
  double matrices[COUNT][9];
  for (int decade = 0; decade >= -16; --decade) {
    test_about("gap 1e%d", decade);
    double const gap = pow(10, decade);
    for (int k = 0; k < COUNT; ++k) {
      double const middle = 0.1 + 0.9 * test_uniform(&random);
      switch (k % 4) {
      case 0: /* the two smaller ones nearly opposite */
        random_with_values(&random, 1, middle, gap - middle, matrices[k]);
        break;
      case 1: /* nearly rank 1 */
        random_with_values(&random, 1, gap * middle, gap * centred(&random) * middle, matrices[k]);
        break;
      case 2: /* nearly rank 2 */
        random_with_values(&random, 1, middle, gap * centred(&random) * middle, matrices[k]);
        break;
      default: /* nearly a point reflection */
        random_with_values(&random, 1, 1 - gap * middle, -1 + gap, matrices[k]);
      }
    }
    check_batch(COUNT, matrices[0]);
  }
}

TEST(scale_does_not_matter)
{
  test_random random = {3};
  int const exponents[] = {-1060, -1000, -500, -30, 30, 500, 1020};
  for (size_t e = 0; e < sizeof exponents / sizeof *exponents; ++e) {
    test_about("2^%d", exponents[e]);
    double matrices[COUNT][9], rotations[COUNT][9], scaled[COUNT][9];
    for (int k = 0; k < COUNT; ++k) {
      random_with_values(&random, 1, 0.8, 0.3, matrices[k]);
    }
    rotation_fit3(COUNT, matrices[0], rotations[0]);
    for (int k = 0; k < COUNT; ++k) {
      for (int i = 0; i < 9; ++i) {
        scaled[k][i] = ldexp(matrices[k][i], exponents[e]);
      }
    }
    rotation_fit3(COUNT, scaled[0], scaled[0]); /* in place, too */
    for (int k = 0; k < COUNT; ++k) {
      /* Numbers below 2^-1022 have lost digits of their own. */
      CHECK(distance(scaled[k], rotations[k]) < (exponents[e] < -1050 ? 1e-2 : 1e-13));
      CHECK(orthogonality_error(scaled[k]) < 1e-14);
    }
  }
}

TEST(rotations_stay_as_they_are)
{
  test_random random = {4};
  double matrices[COUNT][9], rotations[COUNT][9];
  for (int k = 0; k < COUNT; ++k) {
    random_rotation(&random, matrices[k]);
  }
  rotation_fit3(COUNT, matrices[0], rotations[0]);
  for (int k = 0; k < COUNT; ++k) {
    CHECK(distance(matrices[k], rotations[k]) < 1e-14);
  }
}

static double turn(const double r[9])
{
  return acos(fmax(-1, fmin(1, (r[0] + r[4] + r[8] - 1) / 2)));
}

TEST(smallest_turn_where_there_is_a_choice)
{
  double const identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double m[9] = {0}, r[9];
  rotation_fit3(1, m, r);
  CHECK(distance(r, identity) == 0);
  /* Rank 1, x to y: a quarter turn about z. Any other rotation that takes x to y turns by more. */
  double const quarter[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  m[3] = 2;
  rotation_fit3(1, m, r);
  CHECK(distance(r, quarter) < 1e-14);
  /* Rank 1, x to -x: half a turn is the least. */
  double const opposite[9] = {-1, 0, 0, 0, 0, 0, 0, 0, 0};
  rotation_fit3(1, opposite, r);
  CHECK_NEAR(r[0], -1, 1e-14);
  CHECK(orthogonality_error(r) < 1e-14);
  /* A mirror image, all in one plane of equal values: nothing needs to turn. */
  double const mirror[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1};
  rotation_fit3(1, mirror, r);
  CHECK(distance(r, identity) < 1e-14);
  /* Minus a small rotation: about the best axis, the turn is half a turn less the rotation's. */
  test_random random = {5};
  for (int k = 0; k < 50; ++k) {
    double rotation[9];
    random_rotation(&random, rotation);
    for (int i = 0; i < 9; ++i) {
      m[i] = -rotation[i];
    }
    rotation_fit3(1, m, r);
    CHECK_NEAR(inner(9, r, m), 1, 1e-13);
    CHECK_NEAR(turn(r), acos(-1.0) - turn(rotation), 1e-6);
  }
}

TEST(flat_inputs_turn_in_their_plane)
{
  test_random random = {6};
  for (int k = 0; k < 100; ++k) {
    double const angle = 3 * centred(&random), c = cos(angle), s = sin(angle), size = 1 + test_uniform(&random);
    double const m[9] = {size * c, -s, 0, size * s, c, 0, 0, 0, 0};
    double const expected[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
    double r[9];
    rotation_fit3(1, m, r);
    CHECK(distance(r, expected) < 1e-14);
  }
}

TEST(never_nan)
{
  double const specials[] = {NAN, INFINITY, -INFINITY, DBL_MAX, DBL_MIN, 5e-324, 0, 1};
  test_random random = {7};
  double matrices[COUNT][9], rotations[COUNT][9];
  for (int k = 0; k < COUNT; ++k) {
    for (int i = 0; i < 9; ++i) {
      matrices[k][i] = specials[(size_t)(test_uniform(&random) * 8)];
    }
  }
  rotation_fit3(COUNT, matrices[0], rotations[0]);
  for (int k = 0; k < COUNT; ++k) {
    CHECK(orthogonality_error(rotations[k]) < 1e-14);
  }
}

TEST(batches_of_any_size_agree)
{
  test_random random = {8};
  double matrices[100][9], one[9], many[100][9];
  for (int k = 0; k < 100; ++k) {
    random_matrix(&random, matrices[k]);
  }
  for (size_t count = 0; count <= 100; count += 7) {
    rotation_fit3(count, matrices[0], many[0]);
    for (size_t k = 0; k < count; ++k) {
      rotation_fit3(1, matrices[k], one);
      CHECK(distance(one, many[k]) == 0);
    }
  }
}

TEST(plane_rotations)
{
  test_random random = {9};
  for (int k = 0; k < 1000; ++k) {
    double const m[4] = {centred(&random), centred(&random), centred(&random), centred(&random)};
    double r[4];
    rotation_fit2(1, m, r);
    CHECK_NEAR(r[0] * r[0] + r[2] * r[2], 1, 1e-15);
    CHECK(r[0] == r[3] && r[1] == -r[2]);
    /* The best angle maximises c (m00 + m11) + s (m10 - m01). */
    CHECK_NEAR(inner(4, r, m), hypot(m[0] + m[3], m[2] - m[1]), 1e-14);
  }
  double const without_answer[][4] = {{0, 0, 0, 0}, {1, 0, 0, -1}, {0, 1, 1, 0}, {NAN, 0, 0, 1}, {INFINITY, 1, 1, 1}};
  for (size_t k = 0; k < sizeof without_answer / sizeof *without_answer; ++k) {
    double r[4];
    rotation_fit2(1, without_answer[k], r);
    CHECK(r[0] == 1 && r[1] == 0 && r[2] == 0 && r[3] == 1);
  }
  double tiny[4] = {0, -5e-324, 5e-324, 0};
  rotation_fit2(1, tiny, tiny);
  CHECK_NEAR(tiny[2], 1, 1e-15);
}
