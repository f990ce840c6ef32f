/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every argument of the functions about sequences that is refused, and that nothing changes then. */
#include "sequence_fixture.h"

TEST(creation)
{
  walk w;
  walk_begin(&w, 4, 4);
  exm_sequence *sequence = (exm_sequence *)(uintptr_t)1;
  CHECK_STATUS(exm_sequence_create(NULL, 0, &sequence), EXM_ERROR_ARGUMENT, "mesh");
  CHECK(sequence == NULL);
  CHECK_STATUS(exm_sequence_create(w.mesh, 0, NULL), EXM_ERROR_ARGUMENT, "out");
  CHECK_STATUS(exm_sequence_create(w.mesh, 77, &sequence), EXM_ERROR_ARGUMENT, "shape_space", "77");
  CHECK_STATUS(exm_sequence_create(w.mesh, -1, &sequence), EXM_ERROR_ARGUMENT, "shape_space", "-1");
  exm_sequence_destroy(NULL);
  walk_end(&w);
}

TEST(frames)
{
  walk w;
  walk_begin(&w, 3, 4);
  exm_sequence *sequence = walk_sequence(&w, 0);
  size_t const V = w.shape.vertex_count, F = w.shape.triangle_count;
  CHECK_STATUS(exm_sequence_add_frame(NULL, w.frames, V, NULL, 0), EXM_ERROR_ARGUMENT, "sequence");
  CHECK_STATUS(exm_sequence_add_frame(sequence, NULL, V, NULL, 0), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_sequence_add_frame(sequence, w.frames, V - 1, NULL, 0), EXM_ERROR_TOPOLOGY, "frame 3", "vertices");
  uint32_t *triangles = test_array(3 * F, sizeof *triangles);
  memcpy(triangles, w.shape.triangles, 3 * F * sizeof *triangles);
  CHECK_STATUS(exm_sequence_add_frame(sequence, w.frames, V, triangles, F - 1), EXM_ERROR_TOPOLOGY, "frame 3",
               "triangles");
  triangles[16] = triangles[17];
  CHECK_STATUS(exm_sequence_add_frame(sequence, w.frames, V, triangles, F), EXM_ERROR_TOPOLOGY, "frame 3",
               "triangle 5");
  exm_element kind;
  size_t index;
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_FACE && index == 5);
  w.frames[3 * 7 + 1] = NAN;
  CHECK_STATUS(exm_sequence_add_frame(sequence, w.frames, V, NULL, 0), EXM_ERROR_ARGUMENT, "frame 3", "vertex 7");
  exm_sequence_info info;
  exm_sequence_info_init(&info);
  CHECK_STATUS(exm_sequence_get_info(sequence, &info), EXM_OK);
  CHECK(info.held_frame_count == 3 && info.is_fitted == 0 && info.dimension == w.size);
  CHECK_STATUS(exm_sequence_drop_frames(sequence), EXM_ERROR_ARGUMENT, "not been fitted");
  free(triangles);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(too_few_frames)
{
  for (size_t n = 0; n < 3; n++) {
    walk w;
    char words[32];
    walk_begin(&w, n + 1, 4);
    w.frame_count = n;
    exm_sequence *sequence = walk_sequence(&w, 0);
    snprintf(words, sizeof words, "%zu frame", n);
    CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, words, "3 at least");
    exm_sequence_destroy(sequence);
    walk_end(&w);
  }
  walk w;
  walk_begin(&w, 3, 4);
  exm_sequence *sequence = walk_sequence(&w, 0);
  exm_sequence_fit_settings settings = walk_settings(0, 0, 0);
  settings.cyclic = 1;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "3 frames", "4 at least");
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(identical_frames)
{
  walk w;
  walk_begin(&w, 5, 4);
  for (size_t i = 1; i < 5; i++) {
    memcpy(w.frames + i * w.size, w.frames, w.size * sizeof(float));
  }
  exm_sequence *sequence = walk_sequence(&w, 0);
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "all 5 frames");
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(a_flat_mesh_is_fine)
{
  zoo_mesh grid = zoo_grid(6, 4, 2, 1);
  exm_mesh *mesh = zoo_create(&grid);
  exm_sequence *sequence = NULL;
  size_t const size = 3 * grid.vertex_count;
  float *frame = test_array(size, sizeof(float));
  double *positions = test_array(size, sizeof(double));
  CHECK_STATUS(exm_sequence_create(mesh, 0, &sequence), EXM_OK);
  for (int i = 0; i < 6; i++) {
    for (size_t v = 0; v < grid.vertex_count; v++) {
      frame[3 * v] = grid.positions[v][0] * (float)(1 + i);
      frame[3 * v + 1] = grid.positions[v][1] + (float)(i * i);
      frame[3 * v + 2] = 0;
    }
    CHECK_STATUS(exm_sequence_add_frame(sequence, frame, grid.vertex_count, NULL, 0), EXM_OK);
  }
  exm_sequence_fit_settings const settings = walk_settings(8, 6, 5);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_evaluate_f64(sequence, 5, positions), EXM_OK);
  for (size_t i = 0; i < size; i++) {
    CHECK_NEAR(positions[i], (double)frame[i], 1e-4);
  }
  exm_sequence_destroy(sequence);
  exm_mesh_destroy(mesh);
  zoo_free(&grid);
  free(frame);
  free(positions);
}

TEST(fit_settings)
{
  walk w;
  walk_begin(&w, 8, 5.1);
  exm_sequence *sequence = walk_sequence(&w, 0);
  exm_sequence_fit_settings settings = walk_settings(3, 0, 0);
  CHECK_STATUS(exm_sequence_fit(NULL, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "sequence");
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "control_point_count",
               "is 3", "4 at least");
  settings = walk_settings(0, 2, 0);
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "site_count", "is 2");
  settings = walk_settings(0, 0, 0);
  double const bad[] = {0, -1, NAN, INFINITY};
  for (size_t i = 0; i < 4; i++) {
    settings.tolerance = bad[i];
    CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "tolerance");
  }
  settings = walk_settings(0, 0, 0);
  settings.window_size = 7;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "window_size is 7");
  settings.window_size = 8;
  settings.window_overlap = 5;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "window_overlap is 5");
  settings.window_overlap = 0;
  settings.cyclic = 1;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "cyclic", "one window");
  settings.cyclic = 0;
  settings.window_size = 0;
  settings.cure_saddles = 2;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "cure_saddles", "2");
  settings.cure_saddles = 0;
  settings.cyclic = 2;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "cyclic", "2");
  settings.struct_size = 0;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "struct_size");
  exm_sequence_fit_report report = {0};
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, &report), EXM_ERROR_ARGUMENT, "report");
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(pins)
{
  walk w;
  walk_begin(&w, 8, 5.1);
  exm_sequence *sequence = walk_sequence(&w, 0);
  exm_sequence_fit_settings settings = walk_settings(0, 0, 0);
  uint32_t frames[2] = {1, 8};
  double points[4] = {0, 0, 1, 1};
  settings.pins = (exm_pins){2, frames, points};
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "pins.frames[1] is 8");
  frames[1] = 1;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "both frame 1");
  frames[1] = 2;
  points[3] = NAN;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "pins.positions[1]");
  points[2] = points[3] = 0;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "frames 1 and 2",
               "one point");
  settings.pins.frames = NULL;
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "pins.frames is NULL");
  settings.pins = (exm_pins){2, frames, NULL};
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "pins.positions is NULL");
  settings.pins = (exm_pins){2, frames, points};
  CHECK_STATUS(exm_sequence_place(sequence, &settings.pins, 0, NULL), EXM_ERROR_ARGUMENT, "not been fitted");
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_place(sequence, &settings.pins, 0, NULL), EXM_ERROR_ARGUMENT, "frames 1 and 2");
  CHECK_STATUS(exm_sequence_place(sequence, NULL, 0, NULL), EXM_ERROR_ARGUMENT, "pins");
  points[2] = 1;
  CHECK_STATUS(exm_sequence_place(sequence, &settings.pins, -1, NULL), EXM_ERROR_ARGUMENT, "iterations", "-1");
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(sampling)
{
  walk w;
  walk_begin(&w, 8, 5.1);
  exm_sequence *sequence = walk_sequence(&w, 0);
  float *single = test_array(w.size, sizeof(float));
  double *wide = test_array(w.size, sizeof(double)), point[2] = {0, 0};
  CHECK_STATUS(exm_sequence_evaluate(sequence, 0, single), EXM_ERROR_ARGUMENT, "not been fitted");
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_evaluate(NULL, 0, single), EXM_ERROR_ARGUMENT, "sequence");
  CHECK_STATUS(exm_sequence_evaluate(sequence, NAN, single), EXM_ERROR_ARGUMENT, "time");
  CHECK_STATUS(exm_sequence_evaluate(sequence, 0, NULL), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_sequence_evaluate_f64(sequence, INFINITY, wide), EXM_ERROR_ARGUMENT, "time");
  CHECK_STATUS(exm_sequence_evaluate_f64(sequence, 0, NULL), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_sequence_derivative(sequence, 0, 0, wide), EXM_ERROR_ARGUMENT, "order is 0");
  CHECK_STATUS(exm_sequence_derivative(sequence, 0, 3, wide), EXM_ERROR_ARGUMENT, "order is 3");
  CHECK_STATUS(exm_sequence_derivative(sequence, 0, 1, NULL), EXM_ERROR_ARGUMENT, "derivative");
  CHECK_STATUS(exm_sequence_derivative(sequence, NAN, 1, wide), EXM_ERROR_ARGUMENT, "time");
  CHECK_STATUS(exm_sequence_pose(sequence, 1, point, single), EXM_ERROR_ARGUMENT, "window is 1");
  CHECK_STATUS(exm_sequence_pose(sequence, 0, NULL, single), EXM_ERROR_ARGUMENT, "point");
  CHECK_STATUS(exm_sequence_pose(sequence, 0, point, NULL), EXM_ERROR_ARGUMENT, "positions");
  point[1] = NAN;
  CHECK_STATUS(exm_sequence_pose(sequence, 0, point, single), EXM_ERROR_ARGUMENT, "point");
  CHECK_STATUS(exm_sequence_curve(sequence, 0, NAN, point), EXM_ERROR_ARGUMENT, "time");
  CHECK_STATUS(exm_sequence_curve(sequence, 0, 0, NULL), EXM_ERROR_ARGUMENT, "point");
  CHECK_STATUS(exm_sequence_curve(sequence, 3, 0, point), EXM_ERROR_ARGUMENT, "window is 3");
  CHECK_STATUS(exm_sequence_get_sites(sequence, 0, NULL), EXM_ERROR_ARGUMENT, "sites");
  CHECK_STATUS(exm_sequence_get_frames(sequence, 1, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "window is 1");
  CHECK_STATUS(exm_sequence_get_window(sequence, 0, NULL), EXM_ERROR_ARGUMENT, "out");
  CHECK_STATUS(exm_sequence_get_info(sequence, NULL), EXM_ERROR_ARGUMENT, "info");
  CHECK_STATUS(exm_sequence_drop_frames(sequence), EXM_OK);
  CHECK_STATUS(exm_sequence_evaluate(sequence, 3, single), EXM_OK);
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "0 frames");
  free(single);
  free(wide);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(curve_edits)
{
  walk w;
  walk_begin(&w, 8, 5.1);
  exm_sequence *sequence = walk_sequence(&w, 0);
  exm_sequence_fit_settings const settings = walk_settings(6, 0, 0);
  double points[20] = {0}, knots[12] = {0, 1, 2, 3, 4, 5, 6, 7};
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_move_control_points(sequence, 0, 5, 2, points), EXM_ERROR_ARGUMENT, "first is 5", "has 6");
  CHECK_STATUS(exm_sequence_move_control_points(sequence, 0, SIZE_MAX, 2, points), EXM_ERROR_ARGUMENT, "first");
  CHECK_STATUS(exm_sequence_move_control_points(sequence, 0, 0, 2, NULL), EXM_ERROR_ARGUMENT, "points");
  points[3] = INFINITY;
  CHECK_STATUS(exm_sequence_move_control_points(sequence, 0, 0, 2, points), EXM_ERROR_ARGUMENT, "points", "point 1");
  CHECK_STATUS(exm_sequence_insert_control_point(sequence, 0, 0, NULL), EXM_ERROR_ARGUMENT, "index is 0");
  CHECK_STATUS(exm_sequence_insert_control_point(sequence, 0, 6, NULL), EXM_ERROR_ARGUMENT, "index is 6");
  CHECK_STATUS(exm_sequence_insert_control_point(sequence, 0, 2, points + 2), EXM_ERROR_ARGUMENT, "point");
  CHECK_STATUS(exm_sequence_delete_control_point(sequence, 0, 6), EXM_ERROR_ARGUMENT, "index is 6");
  CHECK_STATUS(exm_sequence_draw(sequence, 6, points, NULL, 10), EXM_ERROR_ARGUMENT, "points");
  points[3] = 1;
  CHECK_STATUS(exm_sequence_draw(sequence, 3, points, NULL, 10), EXM_ERROR_ARGUMENT, "control_point_count is 3");
  CHECK_STATUS(exm_sequence_draw(sequence, 6, points, NULL, 1), EXM_ERROR_ARGUMENT, "frame_count is 1");
  CHECK_STATUS(exm_sequence_draw(sequence, 6, NULL, NULL, 10), EXM_ERROR_ARGUMENT, "points");
  knots[4] = 2.5;
  CHECK_STATUS(exm_sequence_draw(sequence, 6, points, knots, 10), EXM_ERROR_ARGUMENT, "knots[4]");
  for (size_t i = 0; i < 8; i++) {
    knots[i] = 3;
  }
  CHECK_STATUS(exm_sequence_draw(sequence, 6, points, knots, 10), EXM_ERROR_ARGUMENT, "no length");
  knots[7] = NAN;
  CHECK_STATUS(exm_sequence_draw(sequence, 6, points, knots, 10), EXM_ERROR_ARGUMENT, "knots[7]");
  CHECK(walk_window(sequence, 0).control_point_count == 6 && walk_window(sequence, 0).frame_count == 8);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}

TEST(files)
{
  walk w;
  walk_begin(&w, 8, 5.1);
  exm_sequence *sequence = walk_sequence(&w, 0), *loaded = NULL;
  exm_sequence_file_report report = {0};
  CHECK_STATUS(exm_sequence_save(sequence, "x", NULL), EXM_ERROR_ARGUMENT, "not been fitted");
  CHECK_STATUS(exm_sequence_fit(sequence, NULL, NULL, NULL, NULL), EXM_OK);
  CHECK_STATUS(exm_sequence_save(sequence, NULL, NULL), EXM_ERROR_ARGUMENT, "path");
  CHECK_STATUS(exm_sequence_save(sequence, "x", &report), EXM_ERROR_ARGUMENT, "report");
  CHECK_STATUS(exm_sequence_load(NULL, NULL, &loaded), EXM_ERROR_ARGUMENT, "path");
  CHECK_STATUS(exm_sequence_load("x", &report, &loaded), EXM_ERROR_ARGUMENT, "report");
  CHECK_STATUS(exm_sequence_load("x", NULL, NULL), EXM_ERROR_ARGUMENT, "out");
  exm_sequence_destroy(sequence);
  walk_end(&w);
}
