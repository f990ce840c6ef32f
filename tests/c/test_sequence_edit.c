/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Edits of the curve are local: what is outside of their support does not change by a bit. */
#include "sequence_fixture.h"

typedef struct bench {
  walk w;
  exm_sequence *sequence;
  size_t count;  /* of samples, a tenth of a frame apart */
  float *before; /* [count][V][3] */
  float *after;  /* [V][3] */
} bench;

static float *sample(const bench *b, size_t i)
{
  return b->before + i * b->w.size;
}

static void bench_begin(bench *b, size_t k, int cyclic)
{
  exm_sequence_fit_settings settings = walk_settings(k, 20, 12);
  walk_begin(&b->w, 40, 21.7);
  b->sequence = walk_sequence(&b->w, EXM_SHAPE_POSITIONS);
  settings.cyclic = cyclic;
  CHECK_STATUS(exm_sequence_fit(b->sequence, &settings, NULL, NULL, NULL), EXM_OK);
  b->count = cyclic ? 400 : 391;
  b->before = test_array(b->count * b->w.size, sizeof(float));
  b->after = test_array(b->w.size, sizeof(float));
  for (size_t i = 0; i < b->count; i++) {
    exm_sequence_evaluate(b->sequence, (double)i / 10, sample(b, i));
  }
}

static void bench_end(bench *b)
{
  exm_sequence_destroy(b->sequence);
  walk_end(&b->w);
  free(b->before);
  free(b->after);
}

/** Parameter at a time, from the parameters of the frames around: enough to say on which side of a knot it is. */
static void check_outside(bench *b, const double *parameters, double low, double high, double least_changed)
{
  size_t outside = 0, changed = 0;
  for (size_t i = 0; i < b->count; i++) {
    size_t const frame = i / 10, next = frame + 1 < 40 ? frame + 1 : frame;
    double const from = parameters[frame], to = parameters[next] < from ? INFINITY : parameters[next];
    exm_sequence_evaluate(b->sequence, (double)i / 10, b->after);
    int const same = memcmp(b->after, sample(b, i), b->w.size * sizeof(float)) == 0;
    if ((i % 10 ? to : from) <= low || from >= high) {
      outside++;
      CHECK(same);
    }
    changed += !same;
  }
  CHECK(outside > 100);
  CHECK((double)changed >= least_changed);
}

TEST(a_moved_control_point_stays_local)
{
  bench b;
  bench_begin(&b, 30, 0);
  double points[60], knots[32], parameters[40];
  CHECK(walk_window(b.sequence, 0).control_point_count == 30);
  CHECK_STATUS(exm_sequence_get_curve(b.sequence, 0, points, knots), EXM_OK);
  CHECK_STATUS(exm_sequence_get_frames(b.sequence, 0, NULL, parameters, NULL), EXM_OK);
  CHECK(knots[2] == 0 && knots[31] == knots[29]);
  CHECK_NEAR(parameters[39], knots[29], 1e-12);
  double const moved[4] = {points[24] + 0.3, points[25], points[26], points[27] - 0.4};
  CHECK_STATUS(exm_sequence_move_control_points(b.sequence, 0, 12, 2, moved), EXM_OK);
  /* B_12 begins at knot 11, B_13 ends at knot 16. */
  check_outside(&b, parameters, knots[11], knots[16], 20);
  CHECK_STATUS(exm_sequence_move_control_points(b.sequence, 0, 12, 2, points + 24), EXM_OK);
  check_outside(&b, parameters, INFINITY, INFINITY, 0); /* back to the bit everywhere */
  bench_end(&b);
}

TEST(a_knot_inserted_leaves_the_curve)
{
  for (int cyclic = 0; cyclic < 2; cyclic++) {
    bench b;
    test_about("cyclic %d", cyclic);
    bench_begin(&b, 25, cyclic);
    for (size_t index = 1; index < 25; index += 3) {
      CHECK_STATUS(exm_sequence_insert_control_point(b.sequence, 0, index, NULL), EXM_OK);
    }
    CHECK(walk_window(b.sequence, 0).control_point_count == 33);
    for (size_t i = 0; i < b.count; i++) {
      exm_sequence_evaluate(b.sequence, (double)i / 10, b.after);
      for (size_t j = 0; j < b.w.size; j += 5) {
        CHECK_NEAR((double)b.after[j], (double)sample(&b, i)[j], 1e-5);
      }
    }
    bench_end(&b);
  }
}

TEST(inserted_and_deleted_control_points_stay_local)
{
  bench b;
  bench_begin(&b, 30, 0);
  double points[62], knots[33], parameters[40];
  exm_sequence_get_curve(b.sequence, 0, points, knots);
  exm_sequence_get_frames(b.sequence, 0, NULL, parameters, NULL);
  double const corner[2] = {points[28] + 0.5, points[29] + 0.25};
  CHECK_STATUS(exm_sequence_insert_control_point(b.sequence, 0, 14, corner), EXM_OK);
  CHECK(walk_window(b.sequence, 0).control_point_count == 31);
  /* The knot came between knots 14 and 15. */
  check_outside(&b, parameters, knots[12], knots[17], 10);
  double now[62];
  exm_sequence_get_curve(b.sequence, 0, now, NULL);
  CHECK(memcmp(now, points, 28 * sizeof(double)) == 0 && memcmp(now + 28, corner, sizeof corner) == 0);
  CHECK(memcmp(now + 30, points + 28, 32 * sizeof(double)) == 0);
  CHECK_STATUS(exm_sequence_delete_control_point(b.sequence, 0, 14), EXM_OK);
  exm_sequence_get_curve(b.sequence, 0, now, NULL);
  CHECK(memcmp(now, points, 60 * sizeof(double)) == 0);
  check_outside(&b, parameters, knots[12], knots[17], 0);
  CHECK_STATUS(exm_sequence_delete_control_point(b.sequence, 0, 22), EXM_OK);
  check_outside(&b, parameters, knots[12], knots[26], 10);
  bench_end(&b);
}

TEST(ends_can_be_edited)
{
  for (int cyclic = 0; cyclic < 2; cyclic++) {
    bench b;
    test_about("cyclic %d", cyclic);
    bench_begin(&b, 12, cyclic);
    double const corner[2] = {0.1, 0.2};
    for (size_t k = 12; k > 4; k--) {
      CHECK_STATUS(exm_sequence_delete_control_point(b.sequence, 0, k % 2 ? 0 : k - 1), EXM_OK);
      CHECK_STATUS(exm_sequence_evaluate(b.sequence, 17.3, b.after), EXM_OK);
      CHECK(isfinite(b.after[0]));
    }
    CHECK_STATUS(exm_sequence_delete_control_point(b.sequence, 0, 0), EXM_ERROR_ARGUMENT, "4 control points");
    for (size_t k = 4; k < 12; k++) {
      CHECK_STATUS(exm_sequence_insert_control_point(b.sequence, 0, k % 2 ? 1 : k - 1, corner), EXM_OK);
    }
    for (size_t i = 0; i < b.count; i++) {
      exm_sequence_evaluate(b.sequence, (double)i / 10, b.after);
      CHECK(isfinite(b.after[0]));
    }
    bench_end(&b);
  }
}

TEST(an_animation_from_nothing)
{
  walk w;
  walk_begin(&w, 5, 5);
  exm_sequence *sequence = walk_sequence(&w, EXM_SHAPE_POSITIONS);
  exm_sequence_fit_settings settings = walk_settings(7, 5, 4);
  uint32_t const frames[5] = {0, 1, 2, 3, 4};
  double const places[10] = {0, 0, 1, 0, 1, 1, 0, 1, 0.5, 2};
  double const path[12] = {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1};
  float *positions = test_array(w.size, sizeof(float));
  settings.pins = (exm_pins){5, frames, places};
  CHECK_STATUS(exm_sequence_fit(sequence, &settings, NULL, NULL, NULL), EXM_OK);
  for (size_t i = 0; i < 5; i++) {
    CHECK_STATUS(exm_sequence_pose(sequence, 0, places + 2 * i, positions), EXM_OK);
    for (size_t j = 0; j < w.size; j++) {
      CHECK_NEAR((double)positions[j], (double)w.frames[i * w.size + j], 2e-6);
    }
  }
  CHECK_STATUS(exm_sequence_draw(sequence, 6, path, NULL, 25), EXM_OK);
  exm_sequence_info info;
  exm_sequence_info_init(&info);
  CHECK_STATUS(exm_sequence_get_info(sequence, &info), EXM_OK);
  CHECK(info.frame_count == 25);
  /* Uniform knots, three equal control points at either end: the curve begins and ends on them. */
  for (size_t end = 0; end < 2; end++) {
    CHECK_STATUS(exm_sequence_evaluate(sequence, end ? 24 : 0, positions), EXM_OK);
    for (size_t j = 0; j < w.size; j++) {
      CHECK_NEAR((double)positions[j], (double)w.frames[(end ? 2 : 0) * w.size + j], 2e-6);
    }
  }
  double point[2];
  CHECK_STATUS(exm_sequence_curve(sequence, 0, 12, point), EXM_OK); /* the middle, by symmetry */
  CHECK_NEAR(point[0], 0.5, 1e-12);
  CHECK_NEAR(point[1], 0.5, 1e-12);
  double const knots[8] = {0, 0, 0, 1, 2, 3, 3, 3}; /* clamped: the same ends */
  CHECK_STATUS(exm_sequence_draw(sequence, 6, path, knots, 4), EXM_OK);
  CHECK_STATUS(exm_sequence_curve(sequence, 0, 3, point), EXM_OK);
  CHECK_NEAR(point[0], 1, 1e-12);
  free(positions);
  exm_sequence_destroy(sequence);
  walk_end(&w);
}
