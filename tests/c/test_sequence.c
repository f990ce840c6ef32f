/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sequences in vertex coordinates: what a fit promises. */
#include "sequence_fixture.h"

/** RMS distance over the diagonal, by the definition. */
static double rms_error(const walk *w, exm_sequence *sequence)
{
  double *positions = test_array(w->size, sizeof(double)), sum = 0;
  for (size_t i = 0; i < w->frame_count; i++) {
    exm_sequence_evaluate_f64(sequence, (double)i, positions);
    for (size_t j = 0; j < w->size; j++) {
      double const difference = positions[j] - (double)w->frames[i * w->size + j];
      sum += difference * difference;
    }
  }
  free(positions);
  return sqrt(sum / (double)(w->frame_count * w->shape.vertex_count)) / w->diagonal;
}

TEST(upper_limits_give_every_frame_back)
{
  size_t const counts[] = {3, 4, 5, 12, 40};
  for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
    for (int cyclic = 0; cyclic < (counts[c] > 3 ? 2 : 1); cyclic++) {
      size_t const n = counts[c];
      walk w;
      test_about("%zu frames, cyclic %d", n, cyclic);
      walk_begin(&w, n, 17.3);
      exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
      exm_sequence_fit_settings settings = walk_settings(n + 2, n, n - 1);
      exm_sequence_fit_report report;
      exm_sequence_fit_report_init(&report);
      settings.cyclic = cyclic;
      CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
      CHECK(report.control_point_count == (cyclic ? n : n + 2));
      CHECK_NEAR(walk_error(&w, sequence), 0, 2e-7);
      CHECK(report.error < 1e-7);
      exm_sequence_destroy(sequence);
      walk_end(&w);
    }
  }
}

TEST(upper_limits_are_exact_in_every_shape_space)
{
  for (int32_t space = 1; space < 5; space++) {
    walk w;
    test_about("shape space %d", space);
    walk_begin(&w, 14, 9.3);
    exm_sequence *sequence = walk_sequence(&w, space);
    exm_sequence_fit_settings const settings = walk_settings(16, 14, 13);
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
    CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
    double rms[14], largest[14];
    CHECK_STATUS(exm_sequence_measure(sequence, rms, largest), EXM_OK);
    CHECK(largest[7] < 1e-6);
    double *before = test_array(w.size, sizeof(double)), *after = test_array(w.size, sizeof(double));
    double *derivative = test_array(w.size, sizeof(double));
    exm_sequence_evaluate_f64(sequence, 4.3 - 1e-4, before);
    exm_sequence_evaluate_f64(sequence, 4.3 + 1e-4, after);
    CHECK_STATUS(exm_sequence_derivative(sequence, 4.3, 1, derivative), EXM_OK);
    for (size_t i = 0; i < w.size; i += 5) {
      CHECK_NEAR(derivative[i], (after[i] - before[i]) / 2e-4, 1e-4);
    }
    CHECK_STATUS(exm_sequence_derivative(sequence, 4.3, 2, derivative), EXM_OK);
    const char *path = test_file("space.exmseq", "", 0);
    exm_sequence *loaded = NULL;
    CHECK_STATUS(exm_sequence_save(sequence, path, NULL), EXM_OK);
    CHECK_STATUS(exm_sequence_load(path, NULL, &loaded), EXM_OK);
    exm_sequence_evaluate_f64(sequence, 4.3, before);
    exm_sequence_evaluate_f64(loaded, 4.3, after);
    for (size_t i = 0; i < w.size; i++) {
      CHECK(before[i] == after[i]);
    }
    free(before);
    free(after);
    free(derivative);
    exm_sequence_destroy(loaded);
    exm_sequence_destroy(sequence);
    walk_end(&w);
  }
}

TEST(frames_that_repeat_are_given_back)
{
  walk w;
  walk_begin(&w, 24, 8); /* three rounds of eight, and a halt */
  memcpy(w.frames + 5 * w.size, w.frames + 4 * w.size, w.size * sizeof(float));
  memcpy(w.frames + 6 * w.size, w.frames + 4 * w.size, w.size * sizeof(float));
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings const settings = walk_settings(26, 24, 23);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(report_is_what_one_measures)
{
  walk w;
  walk_begin(&w, 30, 19.7);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings const settings = walk_settings(18, 9, 3);
  exm_sequence_fit_report report;
  exm_sequence_fit_report_init(&report);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
  CHECK(report.control_point_count == 18 && report.site_count == 9 && report.component_count == 3);
  CHECK_NEAR(report.diagonal, w.diagonal, 1e-12);
  CHECK_NEAR(report.error / rms_error(&w, sequence), 1, 1e-4);
  CHECK(0 < report.shape_error && report.shape_error <= report.pose_error);
  double rms[30], largest[30], sum = 0;
  CHECK_STATUS(exm_sequence_measure(sequence, rms, largest), EXM_OK);
  for (size_t i = 0; i < 30; i++) {
    sum += rms[i] * rms[i] / 30;
    CHECK(rms[i] <= largest[i]);
  }
  CHECK_NEAR(sqrt(sum) / report.error, 1, 1e-4);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(tolerance_is_kept_with_few)
{
  walk w;
  walk_begin(&w, 40, 23.1);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  size_t last = 0;
  for (int digits = 2; digits < 6; digits++) {
    double const tolerance = pow(10, -digits);
    exm_sequence_fit_settings settings = walk_settings(0, 0, 0);
    exm_sequence_fit_report report;
    exm_sequence_fit_report_init(&report);
    settings.tolerance = tolerance;
    test_about("tolerance %g", tolerance);
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
    CHECK(report.error <= tolerance);
    CHECK(rms_error(&w, sequence) <= tolerance * 1.001 + 1e-7);
    size_t const spent = report.control_point_count + report.site_count + report.component_count;
    CHECK(spent >= last);
    last = spent;
    if (digits == 2) {
      CHECK(report.component_count < 10 && report.site_count < 40 && report.control_point_count < 42);
    }
  }
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(sites_are_nested)
{
  walk w;
  uint32_t few[6], many[15];
  walk_begin(&w, 25, 14.9);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(20, 6, 8);
  double last = INFINITY;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_get_sites(sequence, 0, few), EXM_OK);
  settings.site_count = 15;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_get_sites(sequence, 0, many), EXM_OK);
  CHECK(memcmp(few, many, sizeof few) == 0);
  for (size_t l = 3; l <= 25; l++) { /* eq. 4 falls with every site */
    exm_sequence_fit_report report;
    exm_sequence_fit_report_init(&report);
    settings.site_count = l;
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
    CHECK(report.pose_error <= last * (1 + 1e-12));
    last = report.pose_error;
  }
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(pins_hold)
{
  walk w;
  walk_begin(&w, 20, 13.3);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(22, 20, 19);
  uint32_t const frames[3] = {0, 7, 12};
  double const points[6] = {-1, 0.5, 0.25, 0.75, 1.5, -0.125};
  double positions[40];
  int32_t pinned[20];
  for (int round = 0; round < 2; round++) {
    test_about("round %d", round);
    settings.pins = (exm_pins){round == 0 ? 3 : 1, frames, points};
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
    if (round == 1) { /* the others as they are, two more pinned */
      settings.pins.count = 3;
      CHECK_STATUS(exm_sequence_place(sequence, &settings.pins, 0, NULL), EXM_OK);
    }
    CHECK_STATUS(exm_sequence_get_frames(sequence, 0, positions, NULL, pinned), EXM_OK);
    for (size_t i = 0; i < 3; i++) {
      CHECK(pinned[frames[i]] == 1);
      CHECK(memcmp(positions + 2 * frames[i], points + 2 * i, 2 * sizeof(double)) == 0);
    }
    CHECK(pinned[1] == 0);
    CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
  }
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(distances_of_the_plane_are_those_of_shapes)
{
  walk w;
  walk_begin(&w, 16, 16.0);
  for (size_t i = 0; i < w.frame_count; i++) { /* a motion in one direction fits the plane exactly */
    walk_pose(&w, 0, 0, sin((double)i), w.frames + i * w.size);
  }
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings const settings = walk_settings(18, 16, 15);
  exm_sequence_fit_report report;
  double positions[32];
  exm_sequence_fit_report_init(&report);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
  CHECK(report.stress < 1e-6);
  CHECK_STATUS(exm_sequence_get_frames(sequence, 0, positions, NULL, NULL), EXM_OK);
  for (size_t i = 1; i < 16; i++) {
    double sum = 0;
    for (size_t j = 0; j < w.size; j++) {
      double const difference = (double)w.frames[i * w.size + j] - (double)w.frames[j];
      sum += difference * difference;
    }
    double const rms = sqrt(sum / (double)w.shape.vertex_count);
    CHECK_NEAR(hypot(positions[2 * i] - positions[0], positions[2 * i + 1] - positions[1]), rms, 1e-6);
  }
  CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

/* Three straight motions that pass by each other: in the plane they must cross, and frames of one come to lie between
 * those of another. */
TEST(saddles_are_cured_without_a_user)
{
  walk w;
  walk_begin(&w, 24, 12.4);
  for (size_t i = 0; i < 24; i++) {
    double const along = 2 * (double)(i % 8) / 7 - 1, aside = 0.15;
    size_t const which = i / 8;
    walk_pose(&w, which == 0 ? along : aside, which == 1 ? 1.5 * along : -aside, which == 2 ? 40 * along : aside,
              w.frames + i * w.size);
  }
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(26, 24, 23);
  exm_sequence_fit_report before, after;
  exm_sequence_fit_report_init(&before);
  exm_sequence_fit_report_init(&after);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &before), EXM_OK);
  settings.cure_saddles = 1;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &after), EXM_OK);
  CHECK(before.acceleration > 0 && after.acceleration < before.acceleration);
  CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(cyclic_sequences_close)
{
  walk w;
  walk_begin(&w, 12, 12);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(9, 10, 6);
  double *a = test_array(w.size, sizeof(double)), *b = test_array(w.size, sizeof(double));
  settings.cyclic = 1;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  double const times[] = {0, 0.25, 3.5, 11.75};
  for (size_t i = 0; i < 4; i++) {
    for (int32_t order = 0; order < 3; order++) {
      if (order == 0) {
        exm_sequence_evaluate_f64(sequence, times[i], a);
        exm_sequence_evaluate_f64(sequence, times[i] - 36, b);
      } else {
        exm_sequence_derivative(sequence, times[i], order, a);
        exm_sequence_derivative(sequence, times[i] + 24, order, b);
      }
      CHECK(order == 2 || memcmp(a, b, w.size * sizeof(double)) == 0);
    }
  }
  exm_sequence_derivative(sequence, 0, 1, a); /* and without a corner */
  exm_sequence_derivative(sequence, 12 - 1e-9, 1, b);
  for (size_t i = 0; i < w.size; i++) {
    CHECK_NEAR(a[i], b[i], 1e-6);
  }
  free(a);
  free(b);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(derivatives_are_those_of_positions)
{
  walk w;
  walk_begin(&w, 15, 11.9);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings const settings = walk_settings(12, 10, 7);
  double *before = test_array(w.size, sizeof(double)), *after = test_array(w.size, sizeof(double));
  double *derivative = test_array(w.size, sizeof(double));
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  for (int step = 0; step < 10; step++) {
    double const t = 0.3 + 1.37 * step;
    test_about("t = %g", t);
    exm_sequence_evaluate_f64(sequence, t - 1e-5, before);
    exm_sequence_evaluate_f64(sequence, t + 1e-5, after);
    CHECK_STATUS(exm_sequence_derivative(sequence, t, 1, derivative), EXM_OK);
    for (size_t i = 0; i < w.size; i += 7) {
      CHECK_NEAR(derivative[i], (after[i] - before[i]) / 2e-5, 1e-5);
    }
    exm_sequence_derivative(sequence, t - 1e-2, 1, before);
    exm_sequence_derivative(sequence, t + 1e-2, 1, after);
    CHECK_STATUS(exm_sequence_derivative(sequence, t, 2, derivative), EXM_OK);
    for (size_t i = 0; i < w.size; i += 7) {
      CHECK_NEAR(derivative[i], (after[i] - before[i]) / 2e-2, 1e-9);
    }
  }
  CHECK_STATUS(exm_sequence_derivative(sequence, -1, 1, derivative), EXM_OK);
  CHECK(derivative[0] == 0 && derivative[w.size - 1] == 0);
  free(before);
  free(after);
  free(derivative);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(ends_are_held_and_a_pose_is_the_curve_at_its_point)
{
  walk w;
  walk_begin(&w, 10, 9.1);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  float *a = test_array(w.size, sizeof(float)), *b = test_array(w.size, sizeof(float));
  double point[2];
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_OK);
  exm_sequence_evaluate(sequence, 9, a);
  exm_sequence_evaluate(sequence, 1e9, b);
  CHECK(memcmp(a, b, w.size * sizeof(float)) == 0);
  for (int step = 0; step < 13; step++) {
    double const t = 0.7 * step;
    CHECK_STATUS(exm_sequence_curve(sequence, 0, t, point), EXM_OK);
    CHECK_STATUS(exm_sequence_pose(sequence, 0, point, a), EXM_OK);
    CHECK_STATUS(exm_sequence_evaluate(sequence, t, b), EXM_OK);
    CHECK(memcmp(a, b, w.size * sizeof(float)) == 0);
  }
  free(a);
  free(b);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

static int cancel_at(void *user, double fraction, const char *stage)
{
  double *limit = user;
  CHECK(stage != NULL && fraction >= limit[1]);
  limit[1] = fraction;
  return fraction >= limit[0];
}

TEST(progress_rises_and_cancels)
{
  walk w;
  walk_begin(&w, 20, 13);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  float *before = test_array(w.size, sizeof(float)), *after = test_array(w.size, sizeof(float));
  double never[2] = {2, 0};
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, cancel_at, never, NULL), EXM_OK);
  CHECK(never[1] > 0.8);
  exm_sequence_evaluate(sequence, 3.3, before);
  for (int step = 0; 0.1 * step < never[1]; step++) {
    double state[2] = {0.1 * step, 0};
    exm_sequence_fit_settings const settings = walk_settings(5, 5, 2);
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, cancel_at, state, NULL), EXM_ERROR_CANCELLED, "cancelled");
    exm_sequence_evaluate(sequence, 3.3, after);
    CHECK(memcmp(before, after, w.size * sizeof(float)) == 0);
  }
  free(before);
  free(after);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}
