/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Long sequences in overlapping windows. */
#include "sequence_fixture.h"

static exm_sequence *windowed(walk *w, size_t n, size_t size, size_t overlap, size_t fidelity)
{
  exm_sequence_fit_settings settings = walk_settings(fidelity + 2, fidelity, n - 1);
  walk_begin(w, n, 33.7);
  exm_sequence *sequence = walk_sequence(w, EXM_SHAPE_POSITIONS);
  settings.window_size = size;
  settings.window_overlap = overlap;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  return sequence;
}

static exm_sequence_info info_of(const exm_sequence *sequence)
{
  exm_sequence_info info;
  exm_sequence_info_init(&info);
  CHECK_STATUS(exm_sequence_get_info(sequence, &info), EXM_OK);
  return info;
}

TEST(windows_cover_all_frames_and_give_them_back)
{
  size_t const sizes[][3] = {{60, 16, 4}, {61, 16, 8}, {59, 20, 0}, {33, 32, 2}, {40, 40, 0}};
  for (size_t i = 0; i < 5; i++) {
    walk w;
    test_about("%zu frames in windows of %zu, %zu shared", sizes[i][0], sizes[i][1], sizes[i][2]);
    exm_sequence *sequence = windowed(&w, sizes[i][0], sizes[i][1], sizes[i][2], sizes[i][1]);
    exm_sequence_info const info = info_of(sequence);
    CHECK(info.frame_count == sizes[i][0]);
    CHECK((info.window_count > 1) == (sizes[i][0] > sizes[i][1]));
    size_t end = 1;
    for (size_t k = 0; k < info.window_count; k++) {
      exm_sequence_window const window = walk_window(sequence, k);
      CHECK(window.first_frame < end && window.frame_count == (info.window_count > 1 ? sizes[i][1] : sizes[i][0]));
      end = window.first_frame + window.frame_count;
    }
    CHECK(end == sizes[i][0]);
    CHECK_NEAR(walk_error(&w, sequence), 0, 1e-6);
    exm_sequence_destroy(sequence);
    walk_end(&w);
  }
}

TEST(windows_join_smoothly)
{
  walk w;
  exm_sequence *sequence = windowed(&w, 60, 16, 4, 8);
  double *a = test_array(w.size, sizeof(double)), *b = test_array(w.size, sizeof(double));
  double *d = test_array(w.size, sizeof(double));
  for (int i = 1; i < 590; i++) {
    double const t = 0.1 * i;
    test_about("t = %g", t);
    exm_sequence_evaluate_f64(sequence, t - 1e-6, a);
    exm_sequence_evaluate_f64(sequence, t + 1e-6, b);
    CHECK_STATUS(exm_sequence_derivative(sequence, t, 1, d), EXM_OK);
    for (size_t j = 0; j < w.size; j += 11) {
      CHECK_NEAR((b[j] - a[j]) / 2e-6, d[j], 1e-3);
    }
  }
  free(a);
  free(b);
  free(d);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(tolerance_holds_over_windows)
{
  walk w;
  walk_begin(&w, 80, 33.7);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(0, 0, 0);
  double rms[80], sum = 0;
  settings.window_size = 24;
  settings.tolerance = 3e-3;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  CHECK(info_of(sequence).window_count > 2);
  CHECK_STATUS(exm_sequence_measure(sequence, rms, NULL), EXM_OK);
  for (size_t i = 0; i < 80; i++) {
    sum += rms[i] * rms[i] / 80;
  }
  CHECK(sqrt(sum) <= 3e-3);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(edits_stay_in_their_window)
{
  walk w;
  exm_sequence *sequence = windowed(&w, 60, 16, 4, 16), *loaded = NULL;
  float *before = test_array(60 * w.size, sizeof(float)), *now = test_array(w.size, sizeof(float));
  for (size_t i = 0; i < 60; i++) {
    exm_sequence_evaluate(sequence, (double)i, before + i * w.size);
  }
  double const far[4] = {1, 1, 1, 1};
  CHECK_STATUS(exm_sequence_move_control_points(sequence, 2, 8, 2, far), EXM_OK);
  exm_sequence_window const window = walk_window(sequence, 2);
  size_t changed = 0;
  for (size_t i = 0; i < 60; i++) {
    exm_sequence_evaluate(sequence, (double)i, now);
    int const same = memcmp(now, before + i * w.size, w.size * sizeof(float)) == 0;
    CHECK(same || (i > window.first_frame && i < window.first_frame + window.frame_count));
    changed += !same;
  }
  CHECK(changed >= 4);
  const char *path = test_file("windows.exmseq", "", 0);
  CHECK_STATUS(exm_sequence_save(sequence, path, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_load(path, NULL, &loaded), EXM_OK);
  for (int i = 0; i < 100; i++) {
    exm_sequence_evaluate(sequence, 0.59 * i, before);
    exm_sequence_evaluate(loaded, 0.59 * i, now);
    CHECK(memcmp(now, before, w.size * sizeof(float)) == 0);
  }
  uint32_t const frame = 0;
  exm_pins const pins = {1, &frame, far};
  CHECK_STATUS(exm_sequence_place(sequence, &pins, 0, NULL), EXM_ERROR_ARGUMENT, "windows");
  CHECK_STATUS(exm_sequence_loop(sequence, 3, 9, 1), EXM_ERROR_ARGUMENT, "windows");
  CHECK_STATUS(exm_sequence_convert_rate(sequence, 2), EXM_ERROR_ARGUMENT, "windows");
  CHECK_STATUS(exm_sequence_add_pose(sequence, w.frames, far), EXM_ERROR_ARGUMENT, "windows");
  free(before);
  free(now);
  exm_sequence_destroy(loaded);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}
