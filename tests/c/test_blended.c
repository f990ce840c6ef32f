/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laws of Blended: exemplars come back, motions are followed, no stage increases its energy, rows come and go. */
#include "blended_fixture.h"

static exm_deformer *bind(bent_bar *bar, const exm_blended_bind_settings *settings)
{
  exm_deformer *deformer = NULL;
  exm_status const status =
      exm_blended_create(bar->mesh, bar->exemplars, BAR_SHAPES, bar_handles(bar), settings, NULL, NULL, &deformer);
  CHECK(status == EXM_OK);
  if (status != EXM_OK) {
    test_fail(__FILE__, __LINE__, "%s", exm_last_error());
  }
  return deformer;
}

static double farthest(size_t count, const double *a, const double *b)
{
  double worst = 0;
  for (size_t i = 0; i < 3 * count; i++) {
    worst = fmax(worst, fabs(a[i] - b[i]));
  }
  return worst;
}

static exm_blended_outcome outcome_of(const exm_deformer *deformer)
{
  exm_blended_outcome outcome;
  exm_blended_outcome_init(&outcome);
  CHECK(exm_blended_get_outcome(deformer, &outcome) == EXM_OK);
  return outcome;
}

static void check_exemplars(bent_bar *bar, exm_deformer *deformer, int32_t scale)
{
  size_t const V = bar->shape.vertex_count;
  double targets[BAR_HANDLES * 12], *found = test_array(3 * V, sizeof(double));
  exm_blended_solve_settings settings;
  exm_blended_solve_settings_init(&settings);
  settings.scale = scale;
  for (size_t s = 0; s < BAR_SHAPES; s++) {
    test_about("exemplar %zu, scale %d", s, scale);
    CHECK(exm_deformer_handle_pose(deformer, s, targets) == EXM_OK);
    CHECK(exm_blended_solve(deformer, targets, &settings, NULL) == EXM_OK);
    CHECK(exm_deformer_positions_f64(deformer, found) == EXM_OK);
    CHECK(outcome_of(deformer).exemplar == s);
    CHECK_NEAR(outcome_of(deformer).scale, 1, 1e-5);
    for (size_t i = 0; i < 3 * V; i++) {
      found[i] -= (double)bar->exemplars[s * 3 * V + i];
      CHECK_NEAR(found[i] / bar->diagonal, 0, 2e-5);
    }
  }
  test_about(NULL);
  free(found);
}

TEST(an_exemplars_own_constraints_give_it_back)
{
  bent_bar bar = bar_make();
  for (int32_t dictionary = 0; dictionary < 2; dictionary++) {
    exm_blended_bind_settings settings;
    exm_blended_bind_settings_init(&settings);
    settings.dictionary = dictionary;
    exm_deformer *deformer = bind(&bar, &settings);
    REQUIRE(deformer != NULL);
    check_exemplars(&bar, deformer, EXM_SCALE_BALANCED);
    check_exemplars(&bar, deformer, EXM_SCALE_LEAST_SQUARES);
    check_exemplars(&bar, deformer, EXM_SCALE_HELD);
    exm_deformer_destroy(deformer);
  }
  bar_free(&bar);
}

/** A pose between exemplars, which none of them meets. */
static void between(const bent_bar *bar, float *pose)
{
  for (size_t v = 0; v < bar->shape.vertex_count; v++) {
    bar_bend(bar->shape.positions[v], 0.8, 0.3, pose + 3 * v);
  }
}

TEST(turns_shifts_and_scales_are_followed)
{
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  float *pose = test_array(3 * V, sizeof(float));
  double *still = test_array(3 * V, sizeof(double)), *moved = test_array(3 * V, sizeof(double));
  double targets[BAR_HANDLES * 12];
  between(&bar, pose);
  exm_deformer *deformer = bind(&bar, NULL);
  REQUIRE(deformer != NULL);
  bar_targets(&bar, pose, 1, 0, 0, targets);
  CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
  CHECK(exm_deformer_positions_f64(deformer, still) == EXM_OK);
  double const scale = outcome_of(deformer).scale;
  static double const motions[4][3] = {{1, 2.5, 7}, {1.5, 0, 0}, {0.7, 1, -30}, {40, -2, 3}};
  for (size_t m = 0; m < 4; m++) {
    test_about("scale %g, turn %g, shift %g", motions[m][0], motions[m][1], motions[m][2]);
    bar_targets(&bar, pose, motions[m][0], motions[m][1], motions[m][2], targets);
    CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
    CHECK(exm_deformer_positions_f64(deformer, moved) == EXM_OK);
    CHECK_NEAR(outcome_of(deformer).scale / motions[m][0], scale, 1e-6);
    /* The still result, moved in the same way: single vertices of a float pose stand for a motion exactly enough. */
    double const n = sqrt(14.0), a[3] = {1 / n, 2 / n, 3 / n}, c = cos(motions[m][1]), s = sin(motions[m][1]);
    for (size_t v = 0; v < V; v++) {
      const double *x = still + 3 * v;
      double const along = a[0] * x[0] + a[1] * x[1] + a[2] * x[2];
      double const cross[3] = {a[1] * x[2] - a[2] * x[1], a[2] * x[0] - a[0] * x[2], a[0] * x[1] - a[1] * x[0]};
      for (size_t k = 0; k < 3; k++) {
        double const expected =
            motions[m][0] * (c * x[k] + s * cross[k] + (1 - c) * along * a[k]) + motions[m][2] * (double)(k + 1);
        CHECK_NEAR(moved[3 * v + k] / (motions[m][0] * bar.diagonal), expected / (motions[m][0] * bar.diagonal), 1e-6);
      }
    }
  }
  test_about(NULL);
  exm_deformer_destroy(deformer);
  free(pose);
  free(still);
  free(moved);
  bar_free(&bar);
}

static void check_falling(const double *history, const size_t range[2], const char *stage)
{
  test_about("%s", stage);
  CHECK(range[1] > range[0] + 1);
  for (size_t i = range[0] + 1; i < range[1]; i++) {
    CHECK(history[i] <= history[i - 1] * (1 + 1e-9) + 1e-12);
  }
  test_about(NULL);
}

TEST(no_stage_increases_its_energy)
{
  bent_bar bar = bar_make();
  float *pose = test_array(3 * bar.shape.vertex_count, sizeof(float));
  double targets[BAR_HANDLES * 12], history[512];
  between(&bar, pose);
  exm_deformer *deformer = bind(&bar, NULL);
  REQUIRE(deformer != NULL);
  test_random random = {7};
  for (int32_t scale = 0; scale < 3; scale++) {
    for (int32_t begin = 0; begin < 2; begin++) {
      exm_solve_report report;
      exm_blended_solve_settings settings;
      exm_blended_solve_settings_init(&settings);
      exm_solve_report_init(&report);
      report.history = history;
      report.history_capacity = 512;
      settings.scale = scale;
      settings.begin = begin;
      settings.average_iterations = settings.minimal_iterations = settings.final_iterations = 20;
      bar_targets(&bar, pose, 1.3, 0.6, 1, targets);
      for (size_t h = 0; h < BAR_HANDLES; h++) {
        targets[12 * h + 3] += test_uniform(&random) - 0.5;
      }
      CHECK(exm_blended_solve(deformer, targets, &settings, &report) == EXM_OK);
      exm_blended_outcome const outcome = outcome_of(deformer);
      check_falling(history, outcome.average_history, "average");
      check_falling(history, outcome.minimal_history, "minimal");
      check_falling(history, outcome.final_history, "final");
      CHECK_NEAR(history[outcome.final_history[1] - 1], outcome.final_energy, 1e-9 * outcome.final_energy);
      CHECK_NEAR(report.objective, outcome.final_energy, 0);
      /* Eq. 13 has two more terms, neither negative; only the balanced energy is divided by alpha. */
      CHECK(report.elastic_energy > 0);
      CHECK(scale == EXM_SCALE_BALANCED || report.elastic_energy <= report.objective * (1 + 1e-9));
      CHECK(outcome.begin_atom_count > 0);
    }
  }
  exm_deformer_destroy(deformer);
  free(pose);
  bar_free(&bar);
}

TEST(the_order_of_exemplars_does_not_matter)
{
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  float *pose = test_array(3 * V, sizeof(float)), *kept = test_array(BAR_SHAPES * V * 3, sizeof(float));
  double *first = test_array(3 * V, sizeof(double)), *second = test_array(3 * V, sizeof(double));
  double targets[BAR_HANDLES * 12];
  static size_t const order[BAR_SHAPES] = {2, 0, 3, 1};
  exm_blended_bind_settings settings;
  exm_blended_bind_settings_init(&settings);
  settings.atoms_kept = 1;
  between(&bar, pose);
  bar_targets(&bar, pose, 1, 0, 0, targets);
  exm_deformer *deformer = bind(&bar, &settings);
  REQUIRE(deformer != NULL);
  CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
  CHECK(exm_deformer_positions_f64(deformer, first) == EXM_OK);
  size_t const chosen = outcome_of(deformer).exemplar;
  exm_deformer_destroy(deformer);
  memcpy(kept, bar.exemplars, BAR_SHAPES * V * 3 * sizeof(float));
  for (size_t s = 0; s < BAR_SHAPES; s++) {
    memcpy(bar.exemplars + s * V * 3, kept + order[s] * V * 3, V * 3 * sizeof(float));
  }
  deformer = bind(&bar, &settings);
  REQUIRE(deformer != NULL);
  CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
  CHECK(exm_deformer_positions_f64(deformer, second) == EXM_OK);
  CHECK(order[outcome_of(deformer).exemplar] == chosen);
  CHECK_NEAR(farthest(V, first, second) / bar.diagonal, 0, 1e-5);
  exm_deformer_destroy(deformer);
  free(pose);
  free(kept);
  free(first);
  free(second);
  bar_free(&bar);
}

/* ------------------------------------------------------------------------------------------------------------- rows */

/** Solve with rows added for these vertices at a pose; positions out. */
static void solve_rows(exm_deformer *deformer, const double *targets, const double *row_targets, double *out)
{
  exm_blended_solve_settings settings;
  exm_blended_solve_settings_init(&settings);
  settings.row_targets = row_targets;
  CHECK(exm_blended_solve(deformer, targets, &settings, NULL) >= EXM_OK);
  CHECK(exm_deformer_positions_f64(deformer, out) == EXM_OK);
}

TEST(rows_come_and_go_as_if_they_had_always_been_there)
{
  enum { ROWS = 5 };
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  float *pose = test_array(3 * V, sizeof(float));
  double *by_update = test_array(3 * V, sizeof(double)), *afresh = test_array(3 * V, sizeof(double));
  double targets[BAR_HANDLES * 12], row_targets[3 * ROWS];
  uint32_t vertices[2 * ROWS];
  double coefficients[2 * ROWS], weights[ROWS];
  size_t offsets[ROWS + 1] = {0};
  between(&bar, pose);
  bar_targets(&bar, pose, 1, 0, 0, targets);
  for (size_t r = 0; r < ROWS; r++) {
    offsets[r + 1] = 2 * (r + 1);
    weights[r] = 0.5 + (double)r;
    for (size_t i = 0; i < 2; i++) {
      vertices[2 * r + i] = (uint32_t)((17 * r + 31 * i + 3) % V);
      coefficients[2 * r + i] = i == 0 ? 0.25 : r == 4 ? -0.25 : 0.75; /* the last is a difference */
    }
    for (size_t k = 0; k < 3; k++) {
      row_targets[3 * r + k] = coefficients[2 * r] * (double)pose[3 * vertices[2 * r] + k] +
                               coefficients[2 * r + 1] * (double)pose[3 * vertices[2 * r + 1] + k];
    }
  }
  exm_rows const rows = {
      .count = ROWS, .offsets = offsets, .vertices = vertices, .coefficients = coefficients, .weights = weights};
  exm_deformer *deformer = bind(&bar, NULL), *other = bind(&bar, NULL);
  REQUIRE(deformer != NULL && other != NULL);
  /* By updates; and by a factorisation that changing beta_lc there and back again makes anew. */
  CHECK(exm_blended_add_rows(deformer, &rows) == EXM_OK);
  CHECK(exm_blended_add_rows(other, &rows) == EXM_OK);
  CHECK(exm_blended_set_energies(other, 20, 1e-6) == EXM_OK);
  CHECK(exm_blended_set_energies(other, 30, 1e-6) == EXM_OK);
  solve_rows(deformer, targets, row_targets, by_update);
  solve_rows(other, targets, row_targets, afresh);
  CHECK_NEAR(farthest(V, by_update, afresh) / bar.diagonal, 0, 1e-6);
  /* Twenty rounds of weights up and down, and out and in again. */
  for (size_t round = 0; round < 20; round++) {
    double const zero[2] = {0, 0};
    CHECK(exm_blended_weigh_rows(deformer, 1, 2, zero) == EXM_OK);
    CHECK(exm_blended_weigh_rows(deformer, 1, 2, weights + 1) == EXM_OK);
  }
  solve_rows(deformer, targets, row_targets, by_update);
  CHECK_NEAR(farthest(V, by_update, afresh) / bar.diagonal, 0, 1e-6);
  /* Without them it is as at the beginning. */
  exm_blended_info info;
  exm_blended_info_init(&info);
  CHECK(exm_blended_remove_rows(deformer, 3, 2) == EXM_OK);
  CHECK(exm_blended_remove_rows(deformer, 0, 3) == EXM_OK);
  CHECK(exm_blended_get_info(deformer, &info) == EXM_OK && info.row_count == 0);
  exm_deformer_destroy(other);
  other = bind(&bar, NULL);
  REQUIRE(other != NULL);
  solve_rows(deformer, targets, NULL, by_update);
  solve_rows(other, targets, NULL, afresh);
  CHECK_NEAR(farthest(V, by_update, afresh) / bar.diagonal, 0, 1e-6);
  exm_deformer_destroy(deformer);
  exm_deformer_destroy(other);
  free(pose);
  free(by_update);
  free(afresh);
  bar_free(&bar);
}

TEST(a_handle_of_weight_0_is_not_there)
{
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  double targets[BAR_HANDLES * 12], weights[BAR_HANDLES] = {1, 1, 1, 1, 1, 0};
  double *with = test_array(3 * V, sizeof(double)), *without = test_array(3 * V, sizeof(double));
  exm_deformer *deformer = bind(&bar, NULL);
  REQUIRE(deformer != NULL);
  CHECK(exm_deformer_handle_pose(deformer, 1, targets) == EXM_OK);
  CHECK(exm_blended_weigh_handles(deformer, weights) == EXM_OK);
  solve_rows(deformer, targets, NULL, with);
  targets[12 * 5 + 3] = NAN; /* not looked at */
  solve_rows(deformer, targets, NULL, without);
  CHECK_NEAR(farthest(V, with, without), 0, 0);
  CHECK(exm_blended_weigh_handles(deformer, NULL) == EXM_OK);
  CHECK_STATUS(exm_blended_solve(deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "handle 5");
  exm_deformer_destroy(deformer);
  free(with);
  free(without);
  bar_free(&bar);
}

/* ---------------------------------------------------------------------------------------------------- interpolation */

TEST(keys_are_passed_exactly_and_smoothly)
{
  enum { KEYS = 3 };
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  size_t size = 0;
  double targets[BAR_HANDLES * 12];
  double const times[KEYS] = {1, 2, 4};
  exm_deformer *deformer = bind(&bar, NULL);
  REQUIRE(deformer != NULL);
  CHECK(exm_blended_key_size(deformer, &size) == EXM_OK);
  double *keys = test_array(KEYS * size, sizeof(double)), *poses = test_array(KEYS * 3 * V, sizeof(double));
  double *found = test_array(3 * 3 * V, sizeof(double));
  for (size_t k = 0; k < KEYS; k++) {
    bar_targets(&bar, bar.exemplars + (k + 1) * 3 * V, 1 + 0.2 * (double)k, (double)k, 5 * (double)k, targets);
    CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
    CHECK(exm_blended_get_key(deformer, keys + k * size) == EXM_OK);
    CHECK(exm_deformer_positions_f64(deformer, poses + k * 3 * V) == EXM_OK);
  }
  for (size_t k = 0; k < KEYS; k++) {
    CHECK(exm_blended_interpolate(deformer, keys, times, KEYS, times[k]) == EXM_OK);
    CHECK(exm_deformer_positions_f64(deformer, found) == EXM_OK);
    CHECK_NEAR(farthest(V, found, poses + k * 3 * V) / bar.diagonal, 0, 1e-6);
  }
  CHECK(exm_blended_interpolate(deformer, keys, times, KEYS, 100) == EXM_OK);
  CHECK(exm_deformer_positions_f64(deformer, found) == EXM_OK);
  CHECK_NEAR(farthest(V, found, poses + 2 * 3 * V) / bar.diagonal, 0, 1e-6);
  /* Velocities on both sides of the middle key agree. */
  double const step = 1e-4;
  for (size_t i = 0; i < 3; i++) {
    CHECK(exm_blended_interpolate(deformer, keys, times, KEYS, times[1] + ((double)i - 1) * step) == EXM_OK);
    CHECK(exm_deformer_positions_f64(deformer, found + i * 3 * V) == EXM_OK);
  }
  double speed = 0, jump = 0;
  for (size_t i = 0; i < 3 * V; i++) {
    double const before = (found[3 * V + i] - found[i]) / step, after = (found[6 * V + i] - found[3 * V + i]) / step;
    speed = fmax(speed, fabs(before));
    jump = fmax(jump, fabs(after - before));
  }
  CHECK(speed > 0.1);
  CHECK_NEAR(jump / speed, 0, 1e-2);
  CHECK_STATUS(exm_blended_get_key(deformer, keys), EXM_ERROR_ARGUMENT, "only a solve makes a key");
  exm_deformer_destroy(deformer);
  free(keys);
  free(poses);
  free(found);
  bar_free(&bar);
}

TEST(result_pose_is_where_the_handles_are)
{
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  double targets[BAR_HANDLES * 12], found[BAR_HANDLES * 12];
  double *positions = test_array(3 * V, sizeof(double));
  float *single = test_array(3 * V, sizeof(float));
  bar.kinds[2] = EXM_HANDLE_FREE;
  exm_deformer *deformer = bind(&bar, NULL);
  REQUIRE(deformer != NULL);
  CHECK_STATUS(exm_blended_result_pose(deformer, found), EXM_ERROR_ARGUMENT, "has not solved");
  CHECK(exm_deformer_handle_pose(deformer, 2, targets) == EXM_OK);
  CHECK(exm_blended_solve(deformer, targets, NULL, NULL) == EXM_OK);
  CHECK(exm_blended_result_pose(deformer, found) == EXM_OK);
  CHECK(exm_deformer_positions_f64(deformer, positions) == EXM_OK);
  CHECK(exm_deformer_positions(deformer, 1, single) == EXM_OK);
  for (size_t h = 0; h < BAR_HANDLES; h++) {
    for (size_t k = 0; k < 3; k++) {
      CHECK_NEAR(found[12 * h + 4 * k + 3], positions[3 * bar.vertices[h] + k], 1e-6 * bar.diagonal);
    }
  }
  for (size_t i = 0; i < 3 * V; i++) {
    CHECK_NEAR((double)single[i], positions[i], 1e-5 * bar.diagonal);
  }
  exm_deformer_destroy(deformer);
  free(positions);
  free(single);
  bar_free(&bar);
}
