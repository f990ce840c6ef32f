/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laws of as-multi-rigid-as-possible deformation [AMRAP], on small meshes made here. */
#include "amrap_fixture.h"

static exm_amrap_solve_settings settings_of(exm_start start)
{
  exm_amrap_solve_settings settings;
  exm_amrap_solve_settings_init(&settings);
  settings.start = (int32_t)start;
  return settings;
}

static exm_solve_report new_report(void)
{
  exm_solve_report report;
  exm_solve_report_init(&report);
  return report;
}

static exm_deformer_info info_of(const fixture *f)
{
  exm_deformer_info info;
  exm_deformer_info_init(&info);
  CHECK_STATUS(exm_deformer_get_info(f->deformer, &info), EXM_OK);
  return info;
}

static double *blend_of(const fixture *f)
{
  exm_deformer_info const info = info_of(f);
  double *blend = test_array(info.edge_group_count * info.exemplar_count, sizeof *blend);
  CHECK_STATUS(exm_amrap_blend_weights(f->deformer, blend), EXM_OK);
  return blend;
}

static void check_blend(const fixture *f)
{
  exm_deformer_info const info = info_of(f);
  double *blend = blend_of(f), *average = test_array(info.exemplar_count, sizeof *average), sum = 0;
  CHECK_STATUS(exm_amrap_blend_average(f->deformer, average), EXM_OK);
  for (size_t g = 0; g < info.edge_group_count; ++g) {
    double row = 0;
    for (size_t s = 0; s < info.exemplar_count; ++s) {
      CHECK(blend[g * info.exemplar_count + s] >= 0);
      row += blend[g * info.exemplar_count + s];
    }
    CHECK_NEAR(row, 1, 1e-12);
  }
  for (size_t s = 0; s < info.exemplar_count; ++s) {
    CHECK(average[s] >= 0);
    sum += average[s];
  }
  CHECK_NEAR(sum, 1, 1e-12);
  free(blend);
  free(average);
}

/* Largest distance of a held handle's centre from its target, from the positions. */
static double handle_distance(const fixture *f, const double *targets, const double *positions)
{
  double worst = 0;
  for (size_t h = 0; h < f->handle_count; ++h) {
    double const count = (double)(f->offsets[h + 1] - f->offsets[h]);
    double miss[3] = {-targets[12 * h + 3], -targets[12 * h + 7], -targets[12 * h + 11]};
    for (size_t i = f->offsets[h]; i < f->offsets[h + 1]; ++i) {
      for (size_t k = 0; k < 3; ++k) {
        miss[k] += positions[3 * f->vertices[i] + k] / count;
      }
    }
    if (f->kinds[h] != EXM_HANDLE_FREE) {
      worst = fmax(worst, sqrt(miss[0] * miss[0] + miss[1] * miss[1] + miss[2] * miss[2]));
    }
  }
  return worst;
}

/* ---------------------------------------------------------------------------------------------- exemplars come back */

static void check_exemplars_come_back(fixture *f)
{
  if (fixture_bind(f)) {
    double *targets = fixture_targets(f);
    for (size_t s = 0; s < f->exemplar_count; ++s) {
      exm_solve_report report = new_report();
      CHECK_STATUS(exm_deformer_handle_pose(f->deformer, s, targets), EXM_OK);
      double *positions = fixture_solve(f, targets, NULL, &report);
      CHECK_NEAR(fixture_distance_to_exemplar(f, s, positions) / f->diagonal, 0, 1e-5);
      /* A sum of roots of roundings, one a group. */
      CHECK_NEAR(report.objective / f->diagonal, 0, 1e-5 + 1e-7 * (double)info_of(f).edge_group_count);
      CHECK_NEAR(report.constraint_residual / f->diagonal, 0, 1e-7);
      check_blend(f);
      free(positions);
    }
    free(targets);
  }
  fixture_free(f);
}

TEST(exemplars_come_back_pinned)
{
  size_t const counts[] = {1, 2, 8, 30};
  for (size_t i = 0; i < 4; ++i) {
    test_about("%zu exemplars", counts[i]);
    fixture *f = fixture_bar(counts[i]);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    check_exemplars_come_back(f);
  }
}

TEST(exemplars_come_back_oriented)
{
  size_t const counts[] = {1, 2, 8, 30};
  for (size_t i = 0; i < 4; ++i) {
    test_about("%zu exemplars", counts[i]);
    fixture *f = fixture_bar(counts[i]);
    fixture_handle_near(f, EXM_HANDLE_ORIENTED, 0, 0, 0, 1);
    fixture_handle_near(f, EXM_HANDLE_ORIENTED, 1, 0.1, 0.1, 1);
    fixture_handle_near(f, EXM_HANDLE_PINNED, 0.45, 0.3, 0, 1);
    check_exemplars_come_back(f);
  }
}

TEST(exemplars_come_back_with_free_handles)
{
  size_t const counts[] = {1, 2, 8, 30};
  for (size_t i = 0; i < 4; ++i) {
    test_about("%zu exemplars", counts[i]);
    fixture *f = fixture_bar(counts[i]);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 1);
    fixture_handle_near(f, EXM_HANDLE_FREE, 0.5, 0, 0.2, 0);
    fixture_handle_near(f, EXM_HANDLE_FREE, 0.7, 0.2, 0.2, 1);
    check_exemplars_come_back(f);
  }
}

TEST(exemplars_come_back_by_two_handles)
{
  for (int is_oriented = 0; is_oriented < 2; ++is_oriented) {
    test_about(is_oriented ? "oriented" : "pinned");
    fixture *f = fixture_bar(3);
    fixture_handle_near(f, is_oriented ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, 0, 0, 0, is_oriented);
    fixture_handle_near(f, is_oriented ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, 1, 0.1, 0.1, is_oriented);
    check_exemplars_come_back(f);
  }
}

TEST(exemplars_come_back_in_the_plane)
{
  size_t const counts[] = {1, 2, 8, 30};
  for (size_t i = 0; i < 4; ++i) {
    test_about("%zu exemplars", counts[i]);
    fixture *f = fixture_grid(counts[i]);
    fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
    fixture_handle_near(f, EXM_HANDLE_ORIENTED, 0.9, 0.2, 0, 1);
    fixture_handle_near(f, EXM_HANDLE_PINNED, 0.4, 0.4, 0, 0);
    fixture_handle_near(f, EXM_HANDLE_FREE, 0.5, 0.1, 0, 0);
    check_exemplars_come_back(f);
  }
}

TEST(exemplars_come_back_by_a_hundred_handles)
{
  fixture *f = fixture_new(zoo_grid(27, 27, 1, 1), 4, 0); /* a surface in space: exemplars leave its plane */
  for (uint32_t i = 0; i < 100; ++i) {
    uint32_t const vertex = 3 * (i % 10) + 28 * 3 * (i / 10);
    fixture_handle(f, EXM_HANDLE_PINNED, 1, &vertex);
  }
  check_exemplars_come_back(f);
}

/* With rotations off, an exemplar is still one that costs nothing. */
TEST(exemplars_come_back_without_rotations_and_globally)
{
  for (int round = 0; round < 4; ++round) {
    test_about("%s blend, %s rotations", round & 1 ? "global" : "local", round & 2 ? "with" : "without");
    fixture *f = fixture_bar(5);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
    settings.blend = round & 1;
    settings.rotations = round >> 1;
    REQUIRE(fixture_bind(f));
    double *targets = fixture_targets(f);
    for (size_t s = 0; s < 5; ++s) {
      CHECK_STATUS(exm_deformer_handle_pose(f->deformer, s, targets), EXM_OK);
      double *positions = fixture_solve(f, targets, &settings, NULL);
      CHECK_NEAR(fixture_distance_to_exemplar(f, s, positions) / f->diagonal, 0, 1e-5);
      free(positions);
    }
    free(targets);
    fixture_free(f);
  }
}

/* 100 frames of a drag that has stopped at an exemplar. */
TEST(no_jitter_at_an_exemplar)
{
  fixture *f = fixture_bar(4);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  exm_amrap_solve_settings const warm = settings_of(EXM_START_WARM);
  double *targets = fixture_targets(f), *elsewhere = fixture_targets(f);
  test_random random = {1};
  for (size_t s = 0; s < 4; ++s) {
    test_about("exemplar %zu", s);
    fixture_mix(f, s, (s + 1) % 4, 0.4, 0.02, &random, elsewhere);
    free(fixture_solve(f, elsewhere, NULL, NULL));
    CHECK_STATUS(exm_deformer_handle_pose(f->deformer, s, targets), EXM_OK);
    free(fixture_solve(f, targets, NULL, NULL)); /* at rest; from here on nothing may move */
    double *first = fixture_positions(f);
    for (int frame = 0; frame < 100; ++frame) {
      double *positions = fixture_solve(f, targets, &warm, NULL);
      CHECK_NEAR(fixture_distance(f->vertex_count, positions, first) / f->diagonal, 0, 1e-6);
      CHECK_NEAR(fixture_distance_to_exemplar(f, s, positions) / f->diagonal, 0, 1e-5);
      free(positions);
    }
    free(first);
  }
  free(targets);
  free(elsewhere);
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------------ equivariance
 */

static void check_rigid(fixture *f, const double R[3][3], const double t[3], const exm_amrap_solve_settings *settings)
{
  test_random random = {2};
  double *targets = fixture_targets(f);
  for (size_t round = 0; round < 6; ++round) {
    fixture_mix(f, round % f->exemplar_count, (round + 1) % f->exemplar_count, 0.15 * (double)round, 0, &random,
                targets);
    double *before = fixture_solve(f, targets, settings, NULL);
    fixture_move_points(f->vertex_count, R, t, before);
    fixture_move_targets(f, R, t, targets);
    double *after = fixture_solve(f, targets, settings, NULL);
    CHECK_NEAR(fixture_distance(f->vertex_count, before, after) / f->diagonal, 0, 1e-6);
    free(before);
    free(after);
  }
  free(targets);
}

TEST(a_rigid_motion_of_the_handles_moves_the_result)
{
  double R[3][3];
  double const t[3] = {3, -7, 11};
  exm_handle_kind const kinds[] = {EXM_HANDLE_PINNED, EXM_HANDLE_ORIENTED};
  for (int kind = 0; kind < 2; ++kind) {
    fixture *f = fixture_bar(4);
    fixture_usual_handles(f, kinds[kind], kind);
    fixture_handle_near(f, EXM_HANDLE_FREE, 0.6, 0.1, 0.1, 0);
    REQUIRE(fixture_bind(f));
    exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
    for (int mode = 0; mode < 3; ++mode) {
      settings.blend = mode == 1 ? EXM_BLEND_GLOBAL : EXM_BLEND_LOCAL;
      settings.descent = mode == 2 ? EXM_DESCENT_TRUST_REGION : EXM_DESCENT_AUTO;
      for (int turn = 0; turn < 4; ++turn) {
        test_about("%s handles, mode %d, turn %d", kind ? "oriented" : "pinned", mode, turn);
        fixture_rotation(1 + turn, 2 - turn, 3, 0.8 * turn, R);
        check_rigid(f, (const double(*)[3])R, t, &settings);
      }
    }
    fixture_free(f);
  }
}

/* The plane's own motions, in a plane that is not z = 0; and motions out of it along the normal. */
TEST(a_planar_mesh_in_a_tilted_plane)
{
  double tilt[3][3], turn[3][3], offset[3] = {0.3, -0.2, 0.5};
  fixture_rotation(1, 2, 0.5, 0.9, tilt);
  fixture *f = fixture_grid(4);
  fixture_move(f, (const double(*)[3])tilt, offset);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
  fixture_handle_near(f, EXM_HANDLE_ORIENTED, 0.9, 0.2, 0, 1);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0.4, 0.4, 0, 0);
  REQUIRE(fixture_bind(f));
  CHECK(info_of(f).dimension == 2);
  double *targets = fixture_targets(f);
  for (size_t s = 0; s < 4; ++s) {
    test_about("exemplar %zu", s);
    CHECK_STATUS(exm_deformer_handle_pose(f->deformer, s, targets), EXM_OK);
    double *positions = fixture_solve(f, targets, NULL, NULL);
    CHECK_NEAR(fixture_distance_to_exemplar(f, s, positions) / f->diagonal, 0, 1e-5);
    free(positions);
  }
  free(targets);
  /* about the normal, and along it */
  double const normal[3] = {tilt[0][2], tilt[1][2], tilt[2][2]};
  for (int i = 0; i < 5; ++i) {
    test_about("in the plane, turn %d", i);
    fixture_rotation(normal[0], normal[1], normal[2], 1.3 * i, turn);
    double const t[3] = {i * normal[0] + normal[1], i * normal[1] - normal[0], i * normal[2]};
    exm_amrap_solve_settings const settings = settings_of(EXM_START_STATELESS);
    check_rigid(f, (const double(*)[3])turn, t, &settings);
  }
  fixture_free(f);
}

/* Handles that leave the plane one by one take the skin with them, by their weights. */
TEST(a_handle_off_the_plane_lifts_the_skin)
{
  fixture *f = fixture_grid(2);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0.9, 0.2, 0, 1);
  fixture_handle_near(f, EXM_HANDLE_FREE, 0.4, 0.4, 0, 0);
  REQUIRE(fixture_bind(f));
  double *targets = fixture_targets(f);
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  double *flat = fixture_solve(f, targets, NULL, NULL);
  targets[12 + 11] += 0.5;
  exm_solve_report report = new_report();
  double *lifted = fixture_solve(f, targets, NULL, &report);
  CHECK_NEAR(report.constraint_residual, 0, 1e-6);
  CHECK_NEAR(handle_distance(f, targets, lifted), 0, 1e-6);
  for (size_t v = 0; v < f->vertex_count; ++v) {
    CHECK_NEAR(lifted[3 * v], flat[3 * v], 1e-9);
    CHECK_NEAR(lifted[3 * v + 1], flat[3 * v + 1], 1e-9);
    CHECK(lifted[3 * v + 2] > -1e-6 && lifted[3 * v + 2] < 0.5 + 1e-6);
  }
  free(targets);
  free(flat);
  free(lifted);
  fixture_free(f);
}

TEST(pinned_handles_are_met)
{
  test_random random = {3};
  for (int kind = 0; kind < 2; ++kind) {
    fixture *f = fixture_bar(6);
    fixture_usual_handles(f, kind ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, 1);
    REQUIRE(fixture_bind(f));
    double *targets = fixture_targets(f);
    for (size_t round = 0; round < 30; ++round) {
      exm_solve_report report = new_report();
      test_about("%s, round %zu", kind ? "oriented" : "pinned", round);
      fixture_mix(f, round % 6, (round + 2) % 6, test_uniform(&random), round % 3 ? 0.5 : 0.05, &random, targets);
      double *positions = fixture_solve(f, targets, NULL, &report);
      CHECK_NEAR(handle_distance(f, targets, positions) / f->diagonal, 0, 1e-6);
      CHECK_NEAR(report.constraint_residual, handle_distance(f, targets, positions), 1e-6 * f->diagonal);
      check_blend(f);
      free(positions);
    }
    free(targets);
    fixture_free(f);
  }
}

/* ---------------------------------------------------------------------------------------------------- units and order
 */

/* By powers of two, positions are scaled exactly: nothing at all may depend on the unit. By others they are rounded. */
TEST(units_do_not_matter)
{
  double const scales[] = {1, 1024, 0x1p-10, 0x1p40, 0x1p-40, 1000, 0.001};
  double *expected = NULL, objective = 0;
  test_random random;
  for (int i = 0; i < 7; ++i) {
    double const scale = scales[i], matrix[3][3] = {{scale, 0, 0}, {0, scale, 0}, {0, 0, scale}}, none[3] = {0};
    double const tolerance = i < 5 ? 1e-9 : 1e-4;
    test_about("scale %g", scale);
    fixture *f = fixture_bar(4);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    fixture_move(f, matrix, none);
    REQUIRE(fixture_bind(f));
    double *targets = fixture_targets(f);
    exm_solve_report report = new_report();
    random.state = 4;
    fixture_mix(f, 1, 2, 0.4, 0.05, &random, targets);
    double *positions = fixture_solve(f, targets, NULL, &report);
    for (size_t k = 0; k < 3 * f->vertex_count; ++k) {
      positions[k] /= scale;
    }
    expected = i == 0 ? positions : expected;
    objective = i == 0 ? report.objective : objective;
    CHECK_NEAR(fixture_distance(f->vertex_count, positions, expected) / f->diagonal * scale, 0, tolerance);
    CHECK_NEAR(report.objective / scale, objective, tolerance * objective);
    CHECK(report.elastic_energy > 0 && report.elastic_energy < report.objective * report.objective);
    if (i > 0) {
      free(positions);
    }
    free(targets);
    fixture_free(f);
  }
  free(expected);
}

/* Exemplars in another order: the same shape, weights in that order. */
TEST(the_order_of_exemplars_does_not_matter)
{
  enum { S = 5 };
  size_t const order[S] = {0, 3, 1, 4, 2}; /* the reference stays first, for fixture_bind */
  fixture *a = fixture_bar(S), *b = fixture_bar(S);
  fixture_usual_handles(a, EXM_HANDLE_PINNED, 0);
  fixture_usual_handles(b, EXM_HANDLE_PINNED, 0);
  for (size_t s = 0; s < S; ++s) {
    memcpy(b->exemplars + s * 3 * b->vertex_count, a->exemplars + order[s] * 3 * a->vertex_count,
           3 * a->vertex_count * sizeof(float));
  }
  REQUIRE(fixture_bind(a) && fixture_bind(b));
  test_random random = {5};
  double *targets = fixture_targets(a);
  for (size_t round = 0; round < 10; ++round) {
    test_about("round %zu", round);
    fixture_mix(a, round % S, (round + 1) % S, 0.35, 0.03, &random, targets);
    double *from_a = fixture_solve(a, targets, NULL, NULL), *from_b = fixture_solve(b, targets, NULL, NULL);
    double *blend_a = blend_of(a), *blend_b = blend_of(b);
    CHECK_NEAR(fixture_distance(a->vertex_count, from_a, from_b) / a->diagonal, 0, 1e-5);
    for (size_t g = 0; g < info_of(a).edge_group_count; ++g) {
      for (size_t s = 0; s < S; ++s) {
        CHECK_NEAR(blend_b[g * S + s], blend_a[g * S + order[s]], 1e-3);
      }
    }
    free(from_a);
    free(from_b);
    free(blend_a);
    free(blend_b);
  }
  free(targets);
  fixture_free(a);
  fixture_free(b);
}

TEST(weights_of_the_caller_that_are_the_usual_ones_change_nothing)
{
  fixture *a = fixture_bar(3), *b = fixture_bar(3);
  fixture_usual_handles(a, EXM_HANDLE_PINNED, 1);
  fixture_usual_handles(b, EXM_HANDLE_PINNED, 1);
  REQUIRE(fixture_bind(a));
  float *weights = test_array(a->handle_count * a->vertex_count, sizeof *weights);
  float *again = test_array(a->handle_count * a->vertex_count, sizeof *weights);
  CHECK_STATUS(exm_deformer_weights(a->deformer, weights), EXM_OK);
  b->settings.weights = weights;
  REQUIRE(fixture_bind(b));
  CHECK_STATUS(exm_deformer_weights(b->deformer, again), EXM_OK);
  CHECK(memcmp(weights, again, a->handle_count * a->vertex_count * sizeof *weights) == 0);
  test_random random = {6};
  double *targets = fixture_targets(a);
  fixture_mix(a, 1, 2, 0.3, 0.1, &random, targets);
  double *from_a = fixture_solve(a, targets, NULL, NULL), *from_b = fixture_solve(b, targets, NULL, NULL);
  CHECK(memcmp(from_a, from_b, 3 * a->vertex_count * sizeof(double)) == 0);
  free(weights);
  free(again);
  free(targets);
  free(from_a);
  free(from_b);
  fixture_free(a);
  fixture_free(b);
}

/* ------------------------------------------------------------------------------------------------------ determinism */

TEST(a_stateless_result_does_not_depend_on_what_was_solved_before)
{
  size_t const counts[] = {3, 12};
  for (size_t i = 0; i < 2; ++i) {
    fixture *f = fixture_bar(counts[i]), *fresh = fixture_bar(counts[i]);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    fixture_usual_handles(fresh, EXM_HANDLE_PINNED, 0);
    REQUIRE(fixture_bind(f) && fixture_bind(fresh));
    test_random random = {7};
    double *targets = fixture_targets(f), *other = fixture_targets(f);
    for (int mode = 0; mode < 6; ++mode) {
      exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
      settings.blend = mode == 1;
      settings.rotations = mode != 2;
      settings.descent = mode == 3 ? EXM_DESCENT_TRUST_REGION : EXM_DESCENT_AUTO;
      settings.tolerance = mode == 4 ? 1e-7 : 0;
      settings.lambda = mode == 5 ? 0 : 0.5;
      fixture_mix(f, 1, 2, 0.45, 0.1, &random, targets);
      double *expected = fixture_solve(fresh, targets, &settings, NULL);
      for (int before = 0; before < 6; ++before) {
        exm_amrap_solve_settings earlier = settings_of(before % 2 ? EXM_START_WARM : EXM_START_STATELESS);
        test_about("%zu exemplars, mode %d, after %d others", counts[i], mode, before);
        earlier.blend = before == 2;
        earlier.rotations = before != 3;
        earlier.descent = before >= 4 ? EXM_DESCENT_TRUST_REGION : EXM_DESCENT_AUTO;
        fixture_mix(f, 0, 1, test_uniform(&random), 0.2, &random, other);
        free(fixture_solve(f, other, &earlier, NULL));
        double *positions = fixture_solve(f, targets, &settings, NULL);
        CHECK(memcmp(positions, expected, 3 * f->vertex_count * sizeof(double)) == 0);
        free(positions);
      }
      free(expected);
    }
    free(targets);
    free(other);
    fixture_free(f);
    fixture_free(fresh);
  }
}

TEST(threads_do_not_change_the_positions)
{
  fixture *f = fixture_new(zoo_grid(60, 40, 3, 2), 3, 0);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {8};
  double *targets = fixture_targets(f);
  float *one = test_array(3 * f->vertex_count, sizeof *one), *many = test_array(3 * f->vertex_count, sizeof *many);
  fixture_mix(f, 1, 2, 0.45, 0.1, &random, targets);
  double *wide = fixture_solve(f, targets, NULL, NULL), worst = 0;
  CHECK_STATUS(exm_deformer_positions(f->deformer, 1, one), EXM_OK);
  for (int32_t threads = 0; threads < 9; ++threads) {
    test_about("%d threads", threads);
    CHECK_STATUS(exm_deformer_positions(f->deformer, threads, many), EXM_OK);
    CHECK(memcmp(one, many, 3 * f->vertex_count * sizeof *one) == 0);
  }
  for (size_t i = 0; i < 3 * f->vertex_count; ++i) {
    worst = fmax(worst, fabs((double)one[i] - wide[i]));
  }
  CHECK_NEAR(worst / f->diagonal, 0, 1e-6);
  free(targets);
  free(one);
  free(many);
  free(wide);
  fixture_free(f);
}

TEST(before_the_first_solve_there_is_the_reference)
{
  fixture *f = fixture_bar(2);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  float *narrow = test_array(3 * f->vertex_count, sizeof *narrow);
  double *wide = fixture_positions(f);
  CHECK_STATUS(exm_deformer_positions(f->deformer, 0, narrow), EXM_OK);
  CHECK(memcmp(narrow, f->exemplars, 3 * f->vertex_count * sizeof(float)) == 0);
  CHECK(fixture_distance_to_exemplar(f, 0, wide) == 0);
  free(narrow);
  free(wide);
  fixture_free(f);
}

/* ---------------------------------------------------------------------------------------------- what is minimised */

/* One exemplar: nothing to blend, and what is left is reduced ARAP, which D is measured by as well. */
TEST(one_exemplar_is_as_rigid_as_possible)
{
  test_random random = {9};
  for (int kind = 0; kind < 2; ++kind) {
    fixture *f = fixture_bar(1);
    fixture_usual_handles(f, kind ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, kind);
    REQUIRE(fixture_bind(f));
    exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
    settings.tolerance = 1e-9;
    settings.iterations = 2000;
    double *targets = fixture_targets(f), *alone = test_array(3 * f->vertex_count, sizeof *alone);
    double *energies = test_array(info_of(f).edge_group_count, sizeof *energies);
    for (size_t round = 0; round < 8; ++round) {
      exm_solve_report report = new_report();
      double sum = 0, cost = 0;
      test_about("%s, round %zu", kind ? "oriented" : "pinned", round);
      fixture_mix(f, 0, 0, 0, 0.08, &random, targets);
      double *positions = fixture_solve(f, targets, &settings, &report);
      CHECK_STATUS(exm_amrap_exemplar_positions(f->deformer, 0, alone), EXM_OK);
      CHECK_STATUS(exm_amrap_exemplar_energies(f->deformer, energies), EXM_OK);
      for (size_t g = 0; g < info_of(f).edge_group_count; ++g) {
        sum += energies[g];
        cost += sqrt(energies[g]);
      }
      CHECK_NEAR(report.elastic_energy, sum, 1e-5 * sum);
      CHECK_NEAR(report.objective, sqrt(report.elastic_energy) + 0.5 * cost, 1e-9 * report.objective);
      CHECK_NEAR(fixture_distance(f->vertex_count, positions, alone) / f->diagonal, 0, 1e-3);
      free(positions);
    }
    free(targets);
    free(alone);
    free(energies);
    fixture_free(f);
  }
}

/* 5.5: without rotations the first solve is the optimum, wherever it starts and whatever comes after. */
TEST(without_rotations_one_iteration_is_the_optimum)
{
  test_random random = {10};
  size_t const counts[] = {2, 3, 8, 20};
  for (size_t i = 0; i < 4; ++i) {
    fixture *f = fixture_bar(counts[i]);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    REQUIRE(fixture_bind(f));
    double *targets = fixture_targets(f);
    for (size_t round = 0; round < 12; ++round) {
      exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
      exm_solve_report once = new_report(), more = new_report(), warm = new_report();
      settings.rotations = 0;
      settings.lambda = round % 4 == 0 ? 0 : round % 4 == 1 ? 10 : 0.5;
      settings.blend = (int32_t)(round / 2 % 2);
      fixture_mix(f, round % counts[i], (round + 1) % counts[i], 0.4, 0.1, &random, targets);
      test_about("%zu exemplars, round %zu", counts[i], round);
      settings.iterations = 1;
      double *first = fixture_solve(f, targets, &settings, &once);
      settings.iterations = 20;
      double *second = fixture_solve(f, targets, &settings, &more);
      settings.start = EXM_START_WARM;
      free(fixture_solve(f, targets, &settings, &warm));
      CHECK(once.iterations == 1 && once.converged);
      CHECK(fixture_distance(f->vertex_count, first, second) == 0);
      /* Without lambda something else is minimised, faintly, which makes the blend unique. */
      double const tolerance = (settings.lambda > 0 ? 1e-6 : 1e-3) * once.objective;
      CHECK_NEAR(once.optimality_gap, 0, tolerance);
      CHECK_NEAR(warm.objective, once.objective, tolerance);
      free(first);
      free(second);
    }
    free(targets);
    fixture_free(f);
  }
}

/* lambda 0 is a linear shape space: a mixture of exemplars costs nothing, whichever they are. */
TEST(without_lambda_or_rotations_mixtures_are_free)
{
  fixture *f = fixture_bar(4);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
  settings.rotations = 0;
  settings.lambda = 0;
  double *targets = fixture_targets(f);
  test_random random = {11};
  for (size_t round = 0; round < 8; ++round) {
    exm_solve_report report = new_report();
    test_about("round %zu", round);
    fixture_mix(f, round % 4, (round + 1 + round / 4) % 4, 0.3, 0, &random, targets);
    free(fixture_solve(f, targets, &settings, &report));
    CHECK_NEAR(report.objective / f->diagonal, 0, 1e-4); /* but for what makes the blend unique */
  }
  free(targets);
  fixture_free(f);
}

TEST(a_global_blend_is_one_blend)
{
  fixture *f = fixture_bar(6);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {12};
  double *targets = fixture_targets(f);
  for (int warm = 0; warm < 8; ++warm) {
    exm_amrap_solve_settings settings = settings_of(warm % 2 ? EXM_START_WARM : EXM_START_STATELESS);
    settings.descent = warm / 2 % 3;
    /* a local solve in between must leave nothing behind */
    fixture_mix(f, 0, 1, 0.4, 0.1, &random, targets);
    free(fixture_solve(f, targets, &settings, NULL));
    settings.blend = EXM_BLEND_GLOBAL;
    exm_solve_report report = new_report();
    fixture_mix(f, 2, 3, 0.4, 0.1, &random, targets);
    free(fixture_solve(f, targets, &settings, &report));
    double *blend = blend_of(f), average[6];
    CHECK_STATUS(exm_amrap_blend_average(f->deformer, average), EXM_OK);
    test_about("solve %d", warm);
    check_blend(f);
    for (size_t g = 0; g < info_of(f).edge_group_count; ++g) {
      for (size_t s = 0; s < 6; ++s) {
        CHECK(blend[6 * g + s] == blend[s]);
        CHECK_NEAR(average[s], blend[s], 1e-12);
      }
    }
    free(blend);
  }
  free(targets);
  fixture_free(f);
}

/* A local blend is free to be the global one, so that it does no worse where the solve is the optimum. */
TEST(a_local_blend_is_no_worse_than_a_global_one)
{
  fixture *f = fixture_bar(5);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {13};
  double *targets = fixture_targets(f);
  exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
  settings.rotations = 0;
  for (size_t round = 0; round < 10; ++round) {
    exm_solve_report local = new_report(), global = new_report();
    test_about("round %zu", round);
    fixture_mix(f, round % 5, (round + 1) % 5, 0.4, 0.1, &random, targets);
    settings.blend = EXM_BLEND_LOCAL;
    free(fixture_solve(f, targets, &settings, &local));
    settings.blend = EXM_BLEND_GLOBAL;
    free(fixture_solve(f, targets, &settings, &global));
    CHECK(local.objective <= global.objective * (1 + 1e-6));
  }
  free(targets);
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------------------ descent
 */

static void check_falls(size_t count, const double *history)
{
  for (size_t i = 1; i < count; ++i) {
    CHECK(history[i] <= history[i - 1] * (1 + 1e-12));
  }
}

/* Appendix A's promise, on poses far from every exemplar. */
TEST(guarded_iterations_never_raise_the_objective)
{
  size_t const counts[] = {2, 3, 7};
  for (size_t i = 0; i < 6; ++i) {
    fixture *f = i < 3 ? fixture_bar(counts[i]) : fixture_grid(counts[i - 3]);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    REQUIRE(fixture_bind(f));
    test_random random = {14};
    double *targets = fixture_targets(f), history[60];
    for (size_t round = 0; round < 15; ++round) {
      exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
      exm_solve_report report = new_report();
      report.history = history;
      report.history_capacity = 60;
      settings.descent = EXM_DESCENT_TRUST_REGION;
      settings.iterations = 40;
      settings.lambda = round % 5 == 0 ? 0 : round % 5 == 1 ? 5 : 0.5;
      settings.blend = round % 4 == 3;
      test_about("mesh %zu, pose %zu", i, round);
      fixture_mix(f, round % f->exemplar_count, (round + 1) % f->exemplar_count, test_uniform(&random),
                  0.4 * test_uniform(&random), &random, targets);
      free(fixture_solve(f, targets, &settings, &report));
      check_falls(report.history_count, history);
      check_blend(f);
    }
    free(targets);
    fixture_free(f);
  }
}

/* The same promise when the solve is taken one iteration a call. A tolerance makes every call find D to rounding, so
 * that it is the same function that falls. */
TEST(guarded_iterations_one_a_call)
{
  fixture *f = fixture_bar(3);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {15};
  double *targets = fixture_targets(f);
  for (size_t round = 0; round < 12; ++round) {
    exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
    exm_solve_report report = new_report();
    double last = INFINITY;
    settings.descent = EXM_DESCENT_TRUST_REGION;
    settings.iterations = 1;
    settings.tolerance = 1e-12;
    fixture_mix(f, round % 3, (round + 1) % 3, test_uniform(&random), 0.3 * test_uniform(&random), &random, targets);
    for (int step = 0; step < 30; ++step) {
      test_about("pose %zu, step %d", round, step);
      free(fixture_solve(f, targets, &settings, &report));
      CHECK(report.objective <= last * (1 + 1e-5));
      last = report.objective;
      settings.start = EXM_START_WARM;
    }
  }
  free(targets);
  fixture_free(f);
}

/* A mouse that has stopped: the pose comes to rest, and to a point that iterating does not leave. */
TEST(warm_solves_at_fixed_targets_come_to_rest)
{
  fixture *f = fixture_bar(4);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {16};
  double *targets = fixture_targets(f);
  for (size_t round = 0; round < 5; ++round) {
    exm_amrap_solve_settings warm = settings_of(EXM_START_WARM);
    double *last = NULL, step = INFINITY;
    fixture_mix(f, round % 4, (round + 1) % 4, test_uniform(&random), 0.05, &random, targets);
    for (int frame = 0; frame < 250; ++frame) {
      double *positions = fixture_solve(f, targets, &warm, NULL);
      step = last ? fixture_distance(f->vertex_count, positions, last) / f->diagonal : INFINITY;
      free(last);
      last = positions;
    }
    test_about("pose %zu", round);
    CHECK_NEAR(step, 0, 1e-6);
    warm.tolerance = 1e-6;
    exm_solve_report report = new_report();
    double *settled = fixture_solve(f, targets, &warm, &report);
    CHECK(report.converged);
    CHECK_NEAR(fixture_distance(f->vertex_count, settled, last) / f->diagonal, 0, 1e-3);
    free(settled);
    free(last);
  }
  free(targets);
  fixture_free(f);
}

TEST(a_tolerance_is_met_or_the_caller_is_told)
{
  fixture *f = fixture_bar(4);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {17};
  double *targets = fixture_targets(f);
  for (size_t round = 0; round < 12; ++round) {
    exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
    exm_solve_report report = new_report();
    test_about("pose %zu", round);
    fixture_mix(f, round % 4, (round + 1) % 4, test_uniform(&random), 0.1, &random, targets);
    settings.tolerance = 1e-6;
    exm_status const status = exm_amrap_solve(f->deformer, targets, &settings, &report);
    CHECK(report.converged ? status == EXM_OK : status == EXM_WARNING_NOT_CONVERGED);
    CHECK(report.iterations <= 200);
    double *rest = fixture_positions(f);
    settings.start = EXM_START_WARM;
    double *further = fixture_solve(f, targets, &settings, NULL);
    if (report.converged) { /* going on from there goes nowhere */
      CHECK_NEAR(fixture_distance(f->vertex_count, rest, further) / f->diagonal, 0, 1e-3);
    }
    free(rest);
    free(further);
  }
  exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
  settings.tolerance = 1e-12;
  settings.iterations = 2;
  fixture_mix(f, 1, 2, 0.5, 0.1, &random, targets);
  exm_solve_report report = new_report();
  CHECK_STATUS(exm_amrap_solve(f->deformer, targets, &settings, &report), EXM_WARNING_NOT_CONVERGED, "2 iterations");
  CHECK(report.iterations == 2 && !report.converged);
  free(targets);
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------------------- report
 */

TEST(history_has_the_objective_of_every_iteration)
{
  fixture *f = fixture_bar(4);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {18};
  double *targets = fixture_targets(f), history[12];
  fixture_mix(f, 1, 2, 0.4, 0.05, &random, targets);
  exm_amrap_solve_settings settings = settings_of(EXM_START_STATELESS);
  for (int32_t iterations = 1; iterations <= 12; ++iterations) {
    for (size_t capacity = 0; capacity <= 12; capacity += 4) {
      exm_solve_report report = new_report();
      report.history = capacity ? history : NULL;
      report.history_capacity = capacity;
      settings.iterations = iterations;
      memset(history, 0xff, sizeof history);
      test_about("%d iterations, room for %zu", iterations, capacity);
      free(fixture_solve(f, targets, &settings, &report));
      CHECK(report.iterations == iterations);
      CHECK(report.history_count == (capacity < (size_t)iterations ? capacity : (size_t)iterations));
      CHECK(report.history == (capacity ? history : NULL) && report.history_capacity == capacity);
      for (size_t i = 0; i < 12; ++i) {
        CHECK(i < report.history_count ? history[i] > 0 : isnan(history[i]));
      }
      if (report.history_count == (size_t)iterations) {
        CHECK_NEAR(history[iterations - 1], report.objective, 1e-12 * report.objective);
      }
      CHECK(report.seconds > 0 && report.seconds < 10);
      CHECK(report.elastic_energy >= 0 && sqrt(report.elastic_energy) <= report.objective);
    }
  }
  free(targets);
  fixture_free(f);
}

TEST(info_is_about_the_deformer)
{
  fixture *f = fixture_grid(3);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  exm_deformer_info const info = info_of(f);
  CHECK(info.vertex_count == 91 && info.handle_count == 5 && info.exemplar_count == 3 && info.dimension == 2);
  CHECK(info.edge_group_count >= 1 && info.edge_group_count <= 10);
  CHECK(info.coefficient_count > 0 && info.coefficient_count <= 5 * 7 - 5);
  CHECK(info.bind_seconds > 0 && info.weight_seconds > 0 && info.weight_seconds < info.bind_seconds);
  uint32_t *groups = test_array(info.vertex_count, sizeof *groups);
  unsigned char *is_used = test_array(info.edge_group_count, 1);
  CHECK_STATUS(exm_amrap_edge_groups(f->deformer, groups), EXM_OK);
  for (size_t v = 0; v < info.vertex_count; ++v) {
    CHECK(groups[v] < info.edge_group_count);
    is_used[groups[v] % info.edge_group_count] = 1;
  }
  CHECK(memchr(is_used, 0, info.edge_group_count) == NULL);
  free(groups);
  free(is_used);
  fixture_free(f);
}

TEST(rotations_are_rotations)
{
  for (int is_planar = 0; is_planar < 2; ++is_planar) {
    fixture *f = is_planar ? fixture_grid(4) : fixture_bar(4);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    REQUIRE(fixture_bind(f));
    exm_deformer_info const info = info_of(f);
    double *rotations = test_array(info.edge_group_count * 4 * 9, sizeof *rotations), *targets = fixture_targets(f);
    test_random random = {19};
    fixture_mix(f, 1, 2, 0.5, 0.3, &random, targets);
    free(fixture_solve(f, targets, NULL, NULL));
    CHECK_STATUS(exm_amrap_rotations(f->deformer, rotations), EXM_OK);
    for (size_t i = 0; i < info.edge_group_count * 4; ++i) {
      const double *R = rotations + 9 * i;
      for (size_t a = 0; a < 9; ++a) {
        double product = 0;
        for (size_t k = 0; k < 3; ++k) {
          product += R[a / 3 * 3 + k] * R[a % 3 * 3 + k];
        }
        CHECK_NEAR(product, a / 3 == a % 3, 1e-9);
      }
      CHECK_NEAR(R[0] * (R[4] * R[8] - R[5] * R[7]) - R[1] * (R[3] * R[8] - R[5] * R[6]) +
                     R[2] * (R[3] * R[7] - R[4] * R[6]),
                 1, 1e-9);
      if (is_planar) {
        CHECK_NEAR(R[8], 1, 1e-9);
      }
    }
    free(rotations);
    free(targets);
    fixture_free(f);
  }
}

/* ------------------------------------------------------------------------------------------------- many exemplars */

/* More exemplars than fit the cone program at once, with nothing that would make their weights sparse. */
TEST(thirty_exemplars_without_lambda)
{
  fixture *f = fixture_bar(30);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  test_random random = {20};
  double *targets = fixture_targets(f);
  for (size_t round = 0; round < 40; ++round) {
    exm_amrap_solve_settings settings = settings_of(round % 3 ? EXM_START_WARM : EXM_START_STATELESS);
    settings.lambda = round % 2 ? 0 : 0.05;
    settings.rotations = round % 5 != 0;
    settings.iterations = 6;
    settings.descent = round % 7 == 0 ? EXM_DESCENT_TRUST_REGION : EXM_DESCENT_AUTO;
    test_about("round %zu", round);
    fixture_mix(f, round % 30, (7 * round + 3) % 30, 0.5, 0.15, &random, targets);
    exm_solve_report report = new_report();
    double *positions = fixture_solve(f, targets, &settings, &report);
    check_blend(f);
    CHECK_NEAR(handle_distance(f, targets, positions) / f->diagonal, 0, 1e-6);
    free(positions);
  }
  free(targets);
  fixture_free(f);
}
