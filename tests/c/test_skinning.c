/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Skinning against its formula, written down once more. */
#include "allocation.h"
#include "harness.h"
#include "subspace/skinning.h"

typedef struct skin {
  size_t V, H, S;
  float *weights, *exemplars; /* [H][V], [S][V][3] */
  double *coefficients;       /* [H][1 + 3 S][3] */
  double size;
  int is_partition; /* weights sum to 1, but for rounding */
} skin;

/* Handles along a line, each with a say in its neighbourhood; exemplars in a unit box around `where`, that differ by
 * `difference`. */
static skin skin_create(size_t V, size_t H, size_t S, double where, double difference)
{
  skin s = {V, H, S, test_array(H * V, sizeof(float)), test_array(S * V * 3, sizeof(float)), NULL, 1, 1};
  test_random random = {V + 7 * H + S};
  for (size_t v = 0; v < V; ++v) {
    double const at = H > 1 ? (double)v / (double)V * (double)(H - 1) : 0;
    for (size_t h = 0; h < H; ++h) {
      s.weights[h * V + v] = (float)fmax(0, 1 - fabs(at - (double)h));
    }
    for (size_t k = 0; k < 3; ++k) {
      double const p = where + test_uniform(&random);
      for (size_t e = 0; e < S; ++e) {
        s.exemplars[(e * V + v) * 3 + k] = (float)(p + (e ? difference * test_uniform(&random) : 0));
      }
    }
  }
  return s;
}

/* Matrices that sum to about a rotation's size, with parts of size `amplitude` that cancel over the exemplars; the
 * image of the exemplars' place is kept where it was. */
static void set_coefficients(skin *s, double where, double amplitude)
{
  size_t const rows = 1 + 3 * s->S;
  test_random random = {5};
  free(s->coefficients);
  s->coefficients = test_array(s->H * rows * 3, sizeof(double));
  for (size_t h = 0; h < s->H; ++h) {
    double *t = s->coefficients + h * rows * 3;
    double total[9] = {0};
    for (size_t i = 0; i < 9; ++i) {
      for (size_t e = 0; e < s->S; ++e) {
        t[3 + 9 * e + i] = e + 1 < s->S ? amplitude * (test_uniform(&random) - 0.5) : -total[i] + test_uniform(&random);
        total[i] += t[3 + 9 * e + i];
      }
    }
    for (size_t k = 0; k < 3; ++k) {
      t[k] = where - where * (total[k] + total[3 + k] + total[6 + k]) + test_uniform(&random);
    }
  }
}

static void skin_free(skin *s)
{
  free(s->weights);
  free(s->exemplars);
  free(s->coefficients);
}

static double *by_formula(const skin *s)
{
  double *out = test_array(3 * s->V, sizeof *out);
  size_t const rows = 1 + 3 * s->S;
  for (size_t v = 0; v < s->V; ++v) {
    double sum = 0;
    for (size_t h = 0; h < s->H; ++h) {
      sum += (double)s->weights[h * s->V + v];
    }
    for (size_t k = 0; k < 3; ++k) {
      double total = 0;
      for (size_t h = 0; h < s->H; ++h) {
        const double *t = s->coefficients + h * rows * 3;
        double image = t[k];
        for (size_t i = 0; i < 3 * s->S; ++i) {
          image += t[(1 + i) * 3 + k] * (double)s->exemplars[(i / 3 * s->V + v) * 3 + i % 3];
        }
        total += (double)s->weights[h * s->V + v] * image;
      }
      out[3 * v + k] = s->is_partition ? total / sum : total;
    }
  }
  return out;
}

static void check_against_formula(const skin *s, double tolerance, double tolerance_f64)
{
  skinning *made = NULL;
  double *expected = by_formula(s), *wide = test_array(3 * s->V, sizeof *wide);
  float *positions = test_array(3 * s->V, sizeof *positions), *threaded = test_array(3 * s->V, sizeof *positions);
  REQUIRE(skinning_create(s->V, s->H, s->S, s->weights, s->exemplars, &made) == EXM_OK);
  skinning_apply(made, s->coefficients, 1, positions);
  skinning_apply_f64(made, s->coefficients, wide);
  for (size_t i = 0; i < 3 * s->V; ++i) {
    CHECK_NEAR((double)positions[i], expected[i], tolerance);
    CHECK_NEAR(wide[i], expected[i], tolerance_f64);
  }
  for (int threads = 0; threads <= 7; ++threads) {
    memset(threaded, 0xff, 3 * s->V * sizeof *threaded);
    skinning_apply(made, s->coefficients, threads, threaded);
    CHECK(memcmp(positions, threaded, 3 * s->V * sizeof *positions) == 0);
  }
  skinning_destroy(made);
  free(expected);
  free(wide);
  free(positions);
  free(threaded);
}

TEST(every_size)
{
  size_t const sizes[] = {1, 2, 15, 16, 17, 100, 1000};
  for (size_t i = 0; i < 7; ++i) {
    for (size_t H = 1; H <= 9; H += 4) {
      for (size_t S = 1; S <= 7; S += 3) {
        test_about("%zu vertices, %zu handles, %zu exemplars", sizes[i], H, S);
        skin s = skin_create(sizes[i], H, S, 0, 0.2);
        set_coefficients(&s, 0, 1);
        check_against_formula(&s, 3e-6, 1e-13);
        skin_free(&s);
      }
    }
  }
}

TEST(coefficients_that_cancel)
{
  /* The smaller the exemplars' difference, the larger the coefficients that leave the result as it is: from small ones
   * in single precision to large ones in double. */
  for (int decade = 0; decade <= 6; ++decade) {
    double const amplitude = pow(10, decade);
    test_about("amplitude 1e%d", decade);
    skin s = skin_create(500, 5, 4, 0, 1 / amplitude);
    set_coefficients(&s, 0, amplitude);
    check_against_formula(&s, 3e-6, 1e-14 * amplitude + 1e-13);
    skin_free(&s);
  }
}

TEST(far_from_the_origin)
{
  /* A result of 1000 resolves to 6e-5, exemplars there as well. */
  skin s = skin_create(500, 5, 3, 1000, 0.1);
  set_coefficients(&s, 1000, 1);
  check_against_formula(&s, 3e-4, 1e-9);
  skin_free(&s);
}

TEST(weights_of_any_sum)
{
  /* As eigenfunctions are: a constant, and functions of both signs. */
  for (int place = 0; place <= 1000; place += 1000) {
    test_about("at %d", place);
    skin s = skin_create(500, 4, 3, place, 0.1);
    for (size_t v = 0; v < s.V; ++v) {
      for (size_t h = 0; h < s.H; ++h) {
        s.weights[h * s.V + v] = (float)cos(3.14 * (double)h * (double)v / (double)s.V);
      }
    }
    s.is_partition = 0;
    set_coefficients(&s, place, 1);
    check_against_formula(&s, place ? 2e-3 : 3e-6, 1e-9);
    skin_free(&s);
  }
}

/* A shift of all that is handed over shifts the result, in double precision to its own rounding. */
TEST(a_shift_is_not_diluted_by_rounded_weights)
{
  skin s = skin_create(500, 5, 3, 0, 0.1);
  set_coefficients(&s, 0, 1);
  skinning *made = NULL;
  double *before = test_array(3 * s.V, sizeof *before), *after = test_array(3 * s.V, sizeof *after);
  REQUIRE(skinning_create(s.V, s.H, s.S, s.weights, s.exemplars, &made) == EXM_OK);
  skinning_apply_f64(made, s.coefficients, before);
  for (size_t h = 0; h < s.H; ++h) {
    s.coefficients[h * (1 + 3 * s.S) * 3] += 1e6;
  }
  skinning_apply_f64(made, s.coefficients, after);
  for (size_t v = 0; v < s.V; ++v) {
    CHECK_NEAR(after[3 * v] - before[3 * v], 1e6, 1e-8);
  }
  skinning_destroy(made);
  free(before);
  free(after);
  skin_free(&s);
}

TEST(not_finite_is_passed_on)
{
  skin s = skin_create(40, 2, 2, 0, 0.1);
  set_coefficients(&s, 0, 1);
  s.coefficients[0] = NAN;
  skinning *made;
  float positions[120];
  REQUIRE(skinning_create(s.V, s.H, s.S, s.weights, s.exemplars, &made) == EXM_OK);
  skinning_apply(made, s.coefficients, 1, positions);
  CHECK(isnan(positions[0]));
  skinning_destroy(made);
  skinning_destroy(NULL);
  skin_free(&s);
}

static exm_status create(void *context)
{
  const skin *s = context;
  skinning *made = (skinning *)context;
  exm_status const status = skinning_create(s->V, s->H, s->S, s->weights, s->exemplars, &made);
  CHECK((status == EXM_OK) == (made != NULL));
  skinning_destroy(made);
  return status;
}

TEST(every_allocation_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  skin s = skin_create(40, 3, 2, 0, 0.1);
  CHECK(for_each_failed_allocation(create, &s) >= 8);
  skin_free(&s);
}
