/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edits of the frames' times, poses that are added, and motions carried to another mesh. */
#include "sequence_fixture.h"

static exm_sequence *fitted(walk *w, size_t n, size_t k, int cyclic)
{
  exm_sequence_fit_settings settings = walk_settings(k, n, n - 1);
  walk_begin(w, n, cyclic ? (double)n : 0.63 * (double)n);
  exm_sequence *sequence = walk_sequence(w, EXM_SHAPE_POSITIONS);
  settings.cyclic = cyclic;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  return sequence;
}

static size_t frame_count(const exm_sequence *sequence)
{
  exm_sequence_info info;
  exm_sequence_info_init(&info);
  CHECK_STATUS(exm_sequence_get_info(sequence, &info), EXM_OK);
  return info.frame_count;
}

/** Samples of a sequence at times, [count][V][3]. */
static float *samples(const walk *w, exm_sequence *sequence, const double *times, size_t count)
{
  float *made = test_array(count * w->size, sizeof(float));
  for (size_t i = 0; i < count; i++) {
    CHECK_STATUS(exm_sequence_evaluate(sequence, times[i], made + i * w->size), EXM_OK);
  }
  return made;
}

static void check_samples(const walk *w, exm_sequence *sequence, const float *expected, double first, size_t count)
{
  float *now = test_array(w->size, sizeof(float));
  for (size_t i = 0; i < count; i++) {
    exm_sequence_evaluate(sequence, first + (double)i, now);
    CHECK(memcmp(now, expected + i * w->size, w->size * sizeof(float)) == 0);
  }
  free(now);
}

TEST(resampled_frames_are_those_of_their_times)
{
  for (int cyclic = 0; cyclic < 2; cyclic++) {
    walk w;
    double times[35];
    test_about("cyclic %d", cyclic);
    exm_sequence *sequence = fitted(&w, 20, 14, cyclic);
    for (size_t i = 0; i < 35; i++) { /* slow at first, then fast; two of them the same */
      times[i] = i == 9 ? times[8] : 18.5 * pow((double)i / 34, 1.7) + 0.25 + (cyclic ? 7 : 0);
    }
    float *expected = samples(&w, sequence, times, 35);
    CHECK_STATUS(exm_sequence_resample(sequence, times, 35), EXM_OK);
    CHECK(frame_count(sequence) == 35);
    check_samples(&w, sequence, expected, 0, 35);
    double const between[2] = {20.5, 33.9};
    float *smooth = samples(&w, sequence, between, 2);
    CHECK(isfinite(smooth[0]));
    free(smooth);
    free(expected);
    exm_sequence_destroy(sequence);
    walk_end(&w);
  }
}

TEST(frame_rates_are_converted)
{
  walk w;
  double times[48];
  exm_sequence *sequence = fitted(&w, 20, 14, 0);
  for (size_t i = 0; i < 48; i++) {
    times[i] = (double)i / 2.5;
  }
  float *expected = samples(&w, sequence, times, 48);
  CHECK_STATUS(exm_sequence_convert_rate(sequence, 2.5), EXM_OK);
  CHECK(frame_count(sequence) == 48); /* 19 * 2.5 = 47.5 */
  check_samples(&w, sequence, expected, 0, 48);
  free(expected);
  exm_sequence_destroy(sequence);
  walk_end(&w);
  sequence = fitted(&w, 20, 14, 1);
  expected = samples(&w, sequence, (const double[]){0, 4, 8, 12, 16}, 5);
  CHECK_STATUS(exm_sequence_convert_rate(sequence, 0.25), EXM_OK);
  CHECK(frame_count(sequence) == 5);
  check_samples(&w, sequence, expected, 0, 5);
  free(expected);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(a_loop_repeats_and_leaves_the_rest)
{
  for (size_t count = 1; count < 4; count++) {
    walk w;
    double times[40];
    test_about("%zu times more", count);
    walk_begin(&w, 40, 10); /* four rounds of ten */
    for (size_t i = 10; i < 40; i++) {
      memcpy(w.frames + i * w.size, w.frames + (i - 10) * w.size, w.size * sizeof(float));
    }
    exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
    exm_sequence_fit_settings const settings = walk_settings(42, 40, 39);
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
    for (size_t i = 0; i < 40; i++) {
      times[i] = (double)i;
    }
    float *before = samples(&w, sequence, times, 40);
    size_t const k = walk_window(sequence, 0).control_point_count;
    /* k = n + 2: a span from each frame to the next, so a period of ten spans and ten frames. */
    CHECK_STATUS(exm_sequence_loop(sequence, 10, 20, count), EXM_OK);
    CHECK(frame_count(sequence) == 40 + 10 * count);
    CHECK(walk_window(sequence, 0).control_point_count == k + 10 * count);
    check_samples(&w, sequence, before, 0, 18);
    check_samples(&w, sequence, before + 23 * w.size, 23 + 10 * (double)count, 17);
    /* The motion is periodic, so the loop has no seam to be seen. */
    float *now = test_array(w.size, sizeof(float));
    for (size_t i = 15; i < 30 + 10 * count; i++) {
      exm_sequence_evaluate(sequence, (double)i, now);
      for (size_t j = 0; j < w.size; j += 5) {
        CHECK_NEAR((double)now[j], (double)w.frames[(i % 10) * w.size + j], 0.02);
      }
    }
    free(now);
    free(before);
    exm_sequence_destroy(sequence);
    walk_end(&w);
  }
}

TEST(a_loop_is_smooth)
{
  walk w;
  exm_sequence *sequence = fitted(&w, 40, 30, 0);
  double *a = test_array(w.size, sizeof(double)), *b = test_array(w.size, sizeof(double));
  CHECK_STATUS(exm_sequence_loop(sequence, 8, 21.5, 2), EXM_OK);
  size_t const n = frame_count(sequence);
  CHECK(n > 55 && n < 70);
  for (size_t i = 0; i < n; i++) { /* no jump of place or velocity anywhere */
    exm_sequence_evaluate_f64(sequence, (double)i - 1e-7, a);
    exm_sequence_evaluate_f64(sequence, (double)i + 1e-7, b);
    CHECK_NEAR(a[100], b[100], 1e-5);
    exm_sequence_derivative(sequence, (double)i - 1e-7, 1, a);
    exm_sequence_derivative(sequence, (double)i + 1e-7, 1, b);
    CHECK(i == 0 || i + 1 == n || fabs(a[100] - b[100]) < 1e-4);
  }
  free(a);
  free(b);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(an_added_pose_is_where_it_was_put)
{
  walk w;
  double times[20];
  exm_sequence *sequence = fitted(&w, 20, 14, 0);
  float *pose = test_array(w.size, sizeof(float)), *now = test_array(w.size, sizeof(float));
  double const point[2] = {0.4, -0.3}, other[2] = {-0.7, 0.9};
  uint32_t const frame = 3;
  exm_pins const pins = {1, &frame, other};
  walk_pose(&w, -1.9, 0.4, 2, pose); /* nothing that the frames combine to */
  for (size_t i = 0; i < 20; i++) {
    times[i] = (double)i;
  }
  float *before = samples(&w, sequence, times, 20);
  double curve[28], after[28];
  exm_sequence_get_curve(sequence, 0, curve, NULL);
  CHECK_STATUS(exm_sequence_add_pose(sequence, pose, point), EXM_OK);
  exm_sequence_get_curve(sequence, 0, after, NULL);
  for (size_t i = 0; i < 28; i++) {
    CHECK(curve[i] == after[i]);
  }
  for (int round = 0; round < 2; round++) {
    CHECK_STATUS(exm_sequence_pose(sequence, 0, point, now), EXM_OK);
    for (size_t j = 0; j < w.size; j++) {
      CHECK_NEAR((double)now[j], (double)pose[j], 1e-4);
    }
    CHECK(walk_window(sequence, 0).fitted_frame_count == 21 && walk_window(sequence, 0).frame_count == 20);
    /* Placing the frames anew moves them, and not the pose. */
    CHECK_STATUS(exm_sequence_place(sequence, &pins, 0, NULL), EXM_OK);
  }
  CHECK_STATUS(exm_sequence_add_pose(sequence, pose, point), EXM_ERROR_ARGUMENT, "point", "pose 20");
  free(before);
  free(pose);
  free(now);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(examples_span_the_shape_signal)
{
  walk w;
  walk_begin(&w, 15, 9.7);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(17, 15, 0);
  exm_sequence_fit_report report;
  exm_sequence_fit_report_init(&report);
  settings.examples = w.frames; /* all frames: nothing is lost */
  settings.example_count = 15;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
  CHECK(report.component_count == 14);
  CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
  settings.example_count = 4; /* what four of them leave is told */
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, &report), EXM_OK);
  CHECK(report.component_count == 3 && report.shape_error > 1e-3 && report.error >= report.shape_error);
  for (size_t i = 0; i < 4; i++) {
    float *now = test_array(w.size, sizeof(float));
    exm_sequence_evaluate(sequence, (double)i, now);
    for (size_t j = 0; j < w.size; j++) {
      CHECK_NEAR((double)now[j], (double)w.frames[i * w.size + j], 1e-5);
    }
    free(now);
  }
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

/* The other mesh: a grid whose examples follow the same parameters by a rule of their own. */
typedef struct other {
  zoo_mesh shape;
  exm_mesh *mesh;
  size_t size;
} other;

static void other_pose(const other *o, double a, double b, float *out)
{
  for (size_t v = 0; v < o->shape.vertex_count; v++) {
    const float *p = o->shape.positions[v];
    out[3 * v] = p[0];
    out[3 * v + 1] = p[1] + (float)(a * (double)p[0]);
    out[3 * v + 2] = (float)(b * (double)p[0] * (double)p[1]);
  }
}

/** Linear in two parameters, so that the answer is known: bar frames are bar_0 + a bar_1 + b bar_2. */
static void linear_pose(const walk *w, double a, double b, float *out)
{
  for (size_t v = 0; v < w->shape.vertex_count; v++) {
    const float *p = w->shape.positions[v];
    out[3 * v] = p[0];
    out[3 * v + 1] = p[1] + (float)(a * (double)p[0] * (double)p[0] / 8);
    out[3 * v + 2] = p[2] + (float)(b * (double)p[0]);
  }
}

TEST(a_motion_is_carried_to_another_mesh)
{
  walk w;
  other o = {.shape = zoo_grid(5, 3, 2, 1)};
  walk_begin(&w, 12, 8);
  o.mesh = zoo_create(&o.shape);
  o.size = 3 * o.shape.vertex_count;
  double const parameters[5][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5, -1}, {-1, -1}};
  float *q = test_array(5 * w.size, sizeof(float)), *r = test_array(5 * o.size, sizeof(float));
  float *expected = test_array(o.size, sizeof(float)), *now = test_array(o.size, sizeof(float));
  for (size_t i = 0; i < 5; i++) {
    linear_pose(&w, parameters[i][0], parameters[i][1], q + i * w.size);
    other_pose(&o, parameters[i][0], parameters[i][1], r + i * o.size);
  }
  for (size_t i = 0; i < 12; i++) {
    linear_pose(&w, sin((double)i), cos(0.7 * (double)i), w.frames + i * w.size);
  }
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS), *carried = NULL;
  exm_sequence_fit_settings const settings = walk_settings(14, 12, 11);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  size_t const counts[] = {3, 5}; /* as few examples as needed, and more than are independent */
  for (size_t c = 0; c < 2; c++) {
    test_about("%zu examples", counts[c]);
    CHECK_STATUS(exm_sequence_transfer(sequence, q, o.mesh, EXM_SHAPE_POSITIONS, r, counts[c], &carried), EXM_OK);
    for (size_t i = 0; i < 12; i++) {
      other_pose(&o, sin((double)i), cos(0.7 * (double)i), expected);
      CHECK_STATUS(exm_sequence_evaluate(carried, (double)i, now), EXM_OK);
      for (size_t j = 0; j < o.size; j++) {
        CHECK_NEAR((double)now[j], (double)expected[j], 1e-5);
      }
    }
    double a[2], b[2];
    exm_sequence_curve(sequence, 0, 3.7, a);
    exm_sequence_curve(carried, 0, 3.7, b);
    CHECK(a[0] == b[0] && a[1] == b[1]);
    exm_sequence_destroy(carried);
  }
  free(q);
  free(r);
  free(expected);
  free(now);
  exm_mesh_destroy(o.mesh);
  zoo_free(&o.shape);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(what_is_refused)
{
  walk w;
  double times[4] = {0, 1, 2, 3};
  exm_sequence *sequence = fitted(&w, 12, 14, 0), *out = (exm_sequence *)(uintptr_t)1;
  CHECK_STATUS(exm_sequence_resample(NULL, times, 4), EXM_ERROR_ARGUMENT, "sequence");
  CHECK_STATUS(exm_sequence_resample(sequence, NULL, 4), EXM_ERROR_ARGUMENT, "times");
  CHECK_STATUS(exm_sequence_resample(sequence, times, 1), EXM_ERROR_ARGUMENT, "count is 1");
  times[2] = 0.5;
  CHECK_STATUS(exm_sequence_resample(sequence, times, 4), EXM_ERROR_ARGUMENT, "times[2] is 0.5", "before");
  times[2] = NAN;
  CHECK_STATUS(exm_sequence_resample(sequence, times, 4), EXM_ERROR_ARGUMENT, "times[2]", "finite");
  times[2] = 2;
  times[3] = 11.5;
  CHECK_STATUS(exm_sequence_resample(sequence, times, 4), EXM_ERROR_ARGUMENT, "times[3] is 11.5", "within 0 and 11");
  double const ratios[] = {0, -1, NAN, 1e-3, 1e30};
  for (size_t i = 0; i < 5; i++) {
    CHECK_STATUS(exm_sequence_convert_rate(sequence, ratios[i]), EXM_ERROR_ARGUMENT, "ratio");
  }
  CHECK_STATUS(exm_sequence_loop(sequence, -1, 5, 1), EXM_ERROR_ARGUMENT, "from is -1");
  CHECK_STATUS(exm_sequence_loop(sequence, 5, 5, 1), EXM_ERROR_ARGUMENT, "to is 5");
  CHECK_STATUS(exm_sequence_loop(sequence, 5, 12, 1), EXM_ERROR_ARGUMENT, "to is 12");
  CHECK_STATUS(exm_sequence_loop(sequence, 5, NAN, 1), EXM_ERROR_ARGUMENT, "to is");
  CHECK_STATUS(exm_sequence_loop(sequence, 5.1, 5.2, 1), EXM_ERROR_ARGUMENT, "no knot");
  CHECK_STATUS(exm_sequence_loop(sequence, 5, 8, 0), EXM_ERROR_ARGUMENT, "count is 0");
  CHECK_STATUS(exm_sequence_loop(sequence, 5, 8, SIZE_MAX), EXM_ERROR_ARGUMENT, "count");
  double point[2] = {0, NAN};
  CHECK_STATUS(exm_sequence_add_pose(sequence, NULL, point), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_sequence_add_pose(sequence, w.frames, NULL), EXM_ERROR_ARGUMENT, "point");
  CHECK_STATUS(exm_sequence_add_pose(sequence, w.frames, point), EXM_ERROR_ARGUMENT, "point");
  CHECK_STATUS(exm_sequence_transfer(sequence, NULL, w.mesh, 0, w.frames, 3, &out), EXM_ERROR_ARGUMENT, "source");
  CHECK(out == NULL);
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, NULL, 0, w.frames, 3, &out), EXM_ERROR_ARGUMENT, "target");
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, w.mesh, 0, NULL, 3, &out), EXM_ERROR_ARGUMENT,
               "target_examples");
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, w.mesh, 0, w.frames, 1, &out), EXM_ERROR_ARGUMENT,
               "count is 1");
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, w.mesh, 99, w.frames, 3, &out), EXM_ERROR_ARGUMENT, "99");
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, w.mesh, 0, w.frames, 3, NULL), EXM_ERROR_ARGUMENT, "out");
  exm_sequence_fit_settings settings = walk_settings(0, 0, 0);
  settings.examples = w.frames;
  settings.example_count = 1;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "example_count is 1");
  settings.example_count = 3;
  w.frames[w.size + 4] = INFINITY;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "settings.examples",
               "example 1", "vertex 1");
  CHECK_STATUS(exm_sequence_add_pose(sequence, w.frames + w.size, times), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, w.mesh, 0, w.frames, 3, &out), EXM_ERROR_ARGUMENT,
               "source_examples", "vertex 1");
  for (size_t i = 0; i < 3; i++) {
    memcpy(w.frames + i * w.size, w.frames + 5 * w.size, w.size * sizeof(float));
  }
  CHECK_STATUS(exm_sequence_transfer(sequence, w.frames, w.mesh, 0, w.frames, 3, &out), EXM_ERROR_ARGUMENT,
               "one and the same shape");
  CHECK(frame_count(sequence) == 12);
  exm_sequence_destroy(sequence);
  sequence = NULL;
  walk_end(&w);
  sequence = fitted(&w, 12, 12, 1);
  times[2] = 5;
  times[3] = 12;
  CHECK_STATUS(exm_sequence_resample(sequence, times, 4), EXM_ERROR_ARGUMENT, "more than once");
  exm_sequence_destroy(sequence);
  walk_end(&w);
}
