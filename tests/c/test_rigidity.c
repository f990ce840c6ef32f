/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Laws of Rigidity on small meshes. Its energy against eq. 1 as it is printed is in tests/python. */
#include "rigidity_fixture.h"

static int32_t const RADII[] = {1, 2, 4, 9, 0}; /* 0: mixed */
enum { RADIUS_COUNT = sizeof RADII / sizeof *RADII };

static rigid bar_of(int32_t radius)
{
  rigid r = rigid_bar(radius > 0 ? radius : 1);
  if (radius == 0) {
    rigid_mix_radii(&r);
  }
  test_about("r = %d", radius);
  return r;
}

TEST(handles_at_rest_leave_the_mesh_at_rest)
{
  for (size_t i = 0; i < RADIUS_COUNT; ++i) {
    rigid r = bar_of(RADII[i]);
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 0);
    exm_solve_report report;
    exm_solve_report_init(&report);
    double *positions = rigid_solve(&r, targets, NULL, &report);
    CHECK(fixture_distance_to_exemplar(r.f, 0, positions) < 1e-10);
    CHECK(report.elastic_energy < 1e-9 && report.converged);
    free(positions);
    free(targets);
    rigid_free(&r);
  }
}

static void check_moves_along(const rigid *r, const exm_rigidity_solve_settings *settings, double tolerance)
{
  double R[3][3], const_shift[3] = {3, -2, 5};
  fixture_rotation(1, 2, -1, 2.1, R);
  double *targets = rigid_bend(r, 1.1);
  exm_solve_report first, second;
  exm_solve_report_init(&first);
  exm_solve_report_init(&second);
  double *positions = rigid_solve(r, targets, settings, &first);
  fixture_move_targets(r->f, (const double(*)[3])R, const_shift, targets);
  fixture_move_points(r->f->vertex_count, (const double(*)[3])R, const_shift, positions);
  double *moved = rigid_solve(r, targets, settings, &second);
  CHECK(fixture_distance(r->f->vertex_count, positions, moved) < tolerance);
  CHECK_NEAR(second.elastic_energy, first.elastic_energy, tolerance * first.elastic_energy);
  free(moved);
  free(positions);
  free(targets);
}

/* Rotations start from the identity, so it is the minimum that turns along, not the way there. */
TEST(the_minimum_moves_rigidly_with_the_targets)
{
  exm_rigidity_solve_settings const settings = rigid_settings(1e-13, 5000);
  for (size_t i = 0; i < RADIUS_COUNT; ++i) {
    rigid r = bar_of(RADII[i]);
    REQUIRE(rigid_bind(&r));
    check_moves_along(&r, &settings, 1e-4);
    rigid_free(&r);
  }
}

TEST(lengths_scale)
{
  for (size_t i = 0; i < RADIUS_COUNT; ++i) {
    rigid small = bar_of(RADII[i]), large = bar_of(RADII[i]);
    double const factor = 1000, grow[3][3] = {{factor, 0, 0}, {0, factor, 0}, {0, 0, factor}}, none[3] = {0};
    fixture_move(large.f, grow, none);
    REQUIRE(rigid_bind(&small) && rigid_bind(&large));
    double *targets = rigid_bend(&small, 0.8), *enlarged = rigid_bend(&small, 0.8);
    for (size_t k = 3; k < 12 * small.f->handle_count; k += 4) {
      enlarged[k] *= factor;
    }
    exm_solve_report report, other;
    exm_solve_report_init(&report);
    exm_solve_report_init(&other);
    double *positions = rigid_solve(&small, targets, NULL, &report);
    double *larger = rigid_solve(&large, enlarged, NULL, &other);
    CHECK(report.iterations == other.iterations);
    CHECK_NEAR(other.elastic_energy / (factor * factor), report.elastic_energy, 1e-6 * report.elastic_energy);
    for (size_t k = 0; k < 3 * small.f->vertex_count; ++k) {
      CHECK_NEAR(larger[k] / factor, positions[k], 1e-5);
    }
    free(targets);
    free(enlarged);
    free(positions);
    free(larger);
    rigid_free(&small);
    rigid_free(&large);
  }
}

TEST(no_iteration_adds_energy)
{
  test_random random = {7};
  double history[300];
  for (size_t round = 0; round < 40; ++round) {
    rigid r = bar_of(RADII[round % RADIUS_COUNT]);
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 3 * test_uniform(&random));
    for (size_t h = 0; h < 24; ++h) {
      targets[h] += round < 20 ? 0 : 2 * test_uniform(&random) - 1;
    }
    exm_rigidity_solve_settings settings = rigid_settings(round % 3 ? 1e-6 : 0, 300);
    settings.acceleration = round % 2;
    settings.coarse_start = round % 4 > 1;
    exm_solve_report report;
    exm_solve_report_init(&report);
    report.history = history;
    report.history_capacity = 300;
    free(rigid_solve(&r, targets, &settings, &report));
    CHECK(report.history_count == (size_t)report.iterations && report.iterations <= 300);
    for (size_t i = 1; i < report.history_count; ++i) {
      CHECK(history[i] <= history[i - 1]);
    }
    CHECK(history[report.history_count - 1] == report.elastic_energy && report.elastic_energy == report.objective);
    CHECK(report.elastic_energy > 0);
    free(targets);
    rigid_free(&r);
  }
}

TEST(acceleration_and_plain_steps_end_alike)
{
  for (size_t i = 0; i < RADIUS_COUNT; ++i) {
    rigid r = bar_of(RADII[i]);
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 0.9);
    exm_rigidity_solve_settings settings = rigid_settings(1e-13, 20000);
    exm_solve_report fast, plain;
    exm_solve_report_init(&fast);
    exm_solve_report_init(&plain);
    double *a = rigid_solve(&r, targets, &settings, &fast);
    settings.acceleration = 0;
    double *b = rigid_solve(&r, targets, &settings, &plain);
    CHECK(fixture_distance(r.f->vertex_count, a, b) < 1e-4);
    CHECK_NEAR(fast.elastic_energy, plain.elastic_energy, 1e-8 * plain.elastic_energy);
    CHECK(fast.iterations < plain.iterations);
    free(a);
    free(b);
    free(targets);
    rigid_free(&r);
  }
}

/* Vertices numbered backwards. */
static zoo_mesh backwards(zoo_mesh shape)
{
  uint32_t const last = (uint32_t)shape.vertex_count - 1;
  for (size_t v = 0; v < shape.vertex_count / 2; ++v) {
    for (int k = 0; k < 3; ++k) {
      float const kept = shape.positions[v][k];
      shape.positions[v][k] = shape.positions[last - v][k];
      shape.positions[last - v][k] = kept;
    }
  }
  for (size_t f = 0; f < shape.triangle_count; ++f) {
    for (int k = 0; k < 3; ++k) {
      shape.triangles[f][k] = last - shape.triangles[f][k];
    }
  }
  return shape;
}

TEST(the_order_of_vertices_does_not_matter)
{
  exm_rigidity_solve_settings const settings = rigid_settings(0, 12);
  for (size_t i = 0; i + 1 < RADIUS_COUNT; ++i) {
    rigid r = bar_of(RADII[i]), other = rigid_new(backwards(zoo_bar(8, 2)), RADII[i]);
    size_t const last = r.f->vertex_count - 1;
    for (size_t h = 0; h < 2; ++h) {
      uint32_t mirrored[64];
      size_t const count = r.f->offsets[h + 1] - r.f->offsets[h];
      for (size_t v = 0; v < count; ++v) {
        mirrored[v] = (uint32_t)(last - r.f->vertices[r.f->offsets[h] + v]);
      }
      fixture_handle(other.f, EXM_HANDLE_ORIENTED, count, mirrored);
    }
    REQUIRE(rigid_bind(&r) && rigid_bind(&other));
    double *targets = rigid_bend(&r, 1.5);
    double *a = rigid_solve(&r, targets, &settings, NULL), *b = rigid_solve(&other, targets, &settings, NULL);
    for (size_t v = 0; v <= last; ++v) {
      for (size_t k = 0; k < 3; ++k) {
        CHECK_NEAR(a[3 * v + k], b[3 * (last - v) + k], 1e-8);
      }
    }
    free(a);
    free(b);
    free(targets);
    rigid_free(&r);
    rigid_free(&other);
  }
}

static rigid long_bar(size_t length, int32_t radius)
{
  rigid r = rigid_new(zoo_bar(length, 20), radius);
  fixture_handle_near(r.f, EXM_HANDLE_ORIENTED, 0, 0.1, 0.1, 1);
  fixture_handle_near(r.f, EXM_HANDLE_PINNED, 0.4, 0.1, 0.1, 1);
  fixture_handle_near(r.f, EXM_HANDLE_ORIENTED, 1, 0.1, 0.1, 1);
  return r;
}

static rigid large_bar(int32_t radius)
{
  return long_bar(60, radius);
}

/* Enough vertices for two threads to be used. */
TEST(threads_give_the_same_bits)
{
  for (int32_t radius = 1; radius < 5; radius += 3) {
    rigid r = long_bar(260, radius);
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 0.7), *alone = NULL;
    for (int32_t threads = 1; threads < 4; ++threads) {
      exm_rigidity_solve_settings settings = rigid_settings(0, 6);
      settings.thread_count = threads;
      double *positions = rigid_solve(&r, targets, &settings, NULL);
      CHECK(!alone || memcmp(alone, positions, 3 * r.f->vertex_count * sizeof *alone) == 0);
      if (alone) {
        free(positions);
      } else {
        alone = positions;
      }
    }
    free(alone);
    free(targets);
    rigid_free(&r);
  }
}

TEST(stateless_results_depend_on_the_targets_alone)
{
  for (int32_t coarse = 0; coarse < 2; ++coarse) {
    rigid r = large_bar(2);
    REQUIRE(rigid_bind(&r));
    exm_rigidity_solve_settings settings = rigid_settings(1e-3, 0);
    settings.coarse_start = coarse;
    double *targets = rigid_bend(&r, 0.7), *others = rigid_bend(&r, -1.2);
    double *first = rigid_solve(&r, targets, &settings, NULL);
    free(rigid_solve(&r, others, &settings, NULL));
    double *again = rigid_solve(&r, targets, &settings, NULL);
    CHECK(memcmp(first, again, 3 * r.f->vertex_count * sizeof *first) == 0);
    free(first);
    free(again);
    free(targets);
    free(others);
    rigid_free(&r);
  }
}

TEST(a_result_is_where_warm_solves_and_given_positions_go_on)
{
  rigid r = rigid_bar(2);
  REQUIRE(rigid_bind(&r));
  double *targets = rigid_bend(&r, 1.4);
  float *narrow = test_array(3 * r.f->vertex_count, sizeof *narrow);
  exm_rigidity_solve_settings settings = rigid_settings(1e-10, 5000);
  exm_solve_report cold, warm, given;
  exm_solve_report_init(&cold);
  exm_solve_report_init(&warm);
  exm_solve_report_init(&given);
  free(rigid_solve(&r, targets, &settings, &cold));
  CHECK_STATUS(exm_deformer_positions(r.f->deformer, 0, narrow), EXM_OK);
  settings.start = EXM_START_WARM;
  free(rigid_solve(&r, targets, &settings, &warm));
  CHECK(warm.iterations <= 3 && cold.iterations > 5);
  CHECK(warm.elastic_energy <= cold.elastic_energy);
  settings.start = EXM_START_POSITIONS;
  settings.positions = narrow;
  free(rigid_solve(&r, targets, &settings, &given));
  CHECK(given.iterations <= 5);
  CHECK_NEAR(given.elastic_energy, cold.elastic_energy, 1e-6 * cold.elastic_energy);
  free(narrow);
  free(targets);
  rigid_free(&r);
}

/* Before a first solve there is nothing to go on from. */
TEST(a_first_warm_solve_is_a_stateless_one)
{
  rigid r = rigid_bar(3);
  REQUIRE(rigid_bind(&r));
  double *targets = rigid_bend(&r, 0.5);
  exm_rigidity_solve_settings settings = rigid_settings(1e-3, 0);
  settings.start = EXM_START_WARM;
  double *warm = rigid_solve(&r, targets, &settings, NULL), *cold = rigid_solve(&r, targets, NULL, NULL);
  CHECK(memcmp(warm, cold, 3 * r.f->vertex_count * sizeof *warm) == 0);
  free(warm);
  free(cold);
  free(targets);
  rigid_free(&r);
}

TEST(other_radii_are_those_of_a_fresh_bind)
{
  rigid changed = rigid_bar(1), fresh = rigid_bar(1);
  rigid_mix_radii(&fresh);
  REQUIRE(rigid_bind(&changed) && rigid_bind(&fresh));
  double *targets = rigid_bend(&fresh, 1.0);
  exm_rigidity_solve_settings const settings = rigid_settings(0, 9);
  free(rigid_solve(&changed, targets, NULL, NULL));
  double *before = fixture_positions(changed.f);
  CHECK_STATUS(exm_rigidity_set_radii(changed.f->deformer, fresh.radii, 0, NULL, NULL), EXM_OK);
  double *kept = fixture_positions(changed.f);
  CHECK(memcmp(before, kept, 3 * fresh.f->vertex_count * sizeof *kept) == 0);
  int32_t *radii = test_array(fresh.f->vertex_count, sizeof *radii);
  CHECK_STATUS(exm_rigidity_get_radii(changed.f->deformer, radii), EXM_OK);
  CHECK(memcmp(radii, fresh.radii, fresh.f->vertex_count * sizeof *radii) == 0);
  double *a = rigid_solve(&changed, targets, &settings, NULL), *b = rigid_solve(&fresh, targets, &settings, NULL);
  CHECK(memcmp(a, b, 3 * fresh.f->vertex_count * sizeof *a) == 0);
  free(before);
  free(kept);
  free(radii);
  free(a);
  free(b);
  free(targets);
  rigid_free(&changed);
  rigid_free(&fresh);
}

TEST(other_handles_are_those_of_a_fresh_bind)
{
  rigid changed = rigid_bar(2), fresh = rigid_new(zoo_bar(8, 2), 2);
  fixture_handle_near(fresh.f, EXM_HANDLE_PINNED, 0, 0.1, 0.1, 1);
  fixture_handle_near(fresh.f, EXM_HANDLE_PINNED, 0.5, 0.1, 0, 0);
  fixture_handle_near(fresh.f, EXM_HANDLE_ORIENTED, 1, 0.1, 0.1, 1);
  REQUIRE(rigid_bind(&changed) && rigid_bind(&fresh));
  exm_handles const handles = fixture_handles(fresh.f);
  CHECK_STATUS(exm_rigidity_set_handles(changed.f->deformer, &handles, NULL, NULL), EXM_OK);
  exm_deformer_info info;
  exm_deformer_info_init(&info);
  CHECK_STATUS(exm_deformer_get_info(changed.f->deformer, &info), EXM_OK);
  CHECK(info.handle_count == 3);
  double *targets = rigid_bend(&fresh, 1.0);
  double *a = rigid_solve(&changed, targets, NULL, NULL), *b = rigid_solve(&fresh, targets, NULL, NULL);
  CHECK(memcmp(a, b, 3 * fresh.f->vertex_count * sizeof *a) == 0);
  free(a);
  free(b);
  free(targets);
  rigid_free(&changed);
  rigid_free(&fresh);
}

/* ------------------------------------------------------------------------------------------------------------ handles
 */

static void mean_of(const fixture *f, size_t handle, const double *positions, double mean[3])
{
  size_t const first = f->offsets[handle], last = f->offsets[handle + 1];
  memset(mean, 0, 3 * sizeof *mean);
  for (size_t i = first; i < last; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      mean[k] += positions[3 * f->vertices[i] + k] / (double)(last - first);
    }
  }
}

TEST(centres_of_handles_are_where_they_are_told)
{
  test_random random = {3};
  for (int is_patch = 0; is_patch < 2; ++is_patch) {
    for (size_t kind = 0; kind < 3; ++kind) { /* all pinned, all oriented, alternating */
      rigid r = rigid_new(zoo_bar(8, 2), 2);
      fixture_usual_handles(r.f, kind == 1 ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, is_patch);
      for (size_t h = 0; h < r.f->handle_count && kind == 2; h += 2) {
        r.f->kinds[h] = EXM_HANDLE_ORIENTED;
      }
      test_about("patches %d, kind %zu", is_patch, kind);
      REQUIRE(rigid_bind(&r));
      double *targets = rigid_bend(&r, 0.6), mean[3];
      for (size_t i = 0; i < 12 * r.f->handle_count; ++i) {
        targets[i] += i % 4 == 3 ? 0.5 * test_uniform(&random) : 0;
      }
      exm_solve_report report;
      exm_solve_report_init(&report);
      double *positions = rigid_solve(&r, targets, NULL, &report);
      for (size_t h = 0; h < r.f->handle_count; ++h) {
        mean_of(r.f, h, positions, mean);
        for (size_t k = 0; k < 3; ++k) {
          CHECK_NEAR(mean[k], targets[12 * h + 4 * k + 3], 1e-10);
        }
      }
      CHECK(report.constraint_residual < 1e-10);
      free(positions);
      free(targets);
      rigid_free(&r);
    }
  }
}

/* An oriented handle moves by its frame whatever the frame is. */
TEST(oriented_handles_take_their_vertices_along)
{
  rigid r = rigid_bar(3);
  REQUIRE(rigid_bind(&r));
  double *targets = rigid_bend(&r, 1.0), rest[12];
  memcpy(rest, targets + 12, sizeof rest);
  targets[12] *= 1.5; /* not a rotation */
  double *original = rigid_bend(&r, 0);
  double *positions = rigid_solve(&r, targets, NULL, NULL);
  for (size_t i = r.f->offsets[1]; i < r.f->offsets[2]; ++i) {
    size_t const v = r.f->vertices[i];
    for (size_t k = 0; k < 3; ++k) {
      double place = targets[12 + 4 * k + 3];
      for (size_t j = 0; j < 3; ++j) {
        place += targets[12 + 4 * k + j] * ((double)r.f->shape.positions[v][j] - original[12 + 4 * j + 3]);
      }
      CHECK_NEAR(positions[3 * v + k], place, 1e-6);
    }
  }
  free(positions);
  free(original);
  free(targets);
  rigid_free(&r);
}

TEST(an_oriented_vertex_turns_what_is_around_it)
{
  rigid r = rigid_new(zoo_grid(12, 12, 1, 1), 1);
  fixture_handle_near(r.f, EXM_HANDLE_ORIENTED, 0.35, 0.35, 0, 0);
  REQUIRE(rigid_bind(&r));
  double *targets = rigid_bend(&r, 1.2);
  exm_rigidity_solve_settings const settings = rigid_settings(1e-12, 5000);
  double *positions = rigid_solve(&r, targets, &settings, NULL);
  /* Nothing else holds it: the whole mesh follows. */
  for (size_t v = 0; v < r.f->vertex_count; ++v) {
    for (size_t k = 0; k < 3; ++k) {
      double place = targets[4 * k + 3];
      uint32_t const centre = r.f->vertices[0];
      for (size_t j = 0; j < 3; ++j) {
        place += targets[4 * k + j] * ((double)r.f->shape.positions[v][j] - (double)r.f->shape.positions[centre][j]);
      }
      CHECK_NEAR(positions[3 * v + k], place, 1e-4);
    }
  }
  free(positions);
  free(targets);
  rigid_free(&r);
}

/* Parts that nothing but means hold float as one, and patches that reach over parts hold each. */
TEST(patches_alone_hold_a_part)
{
  for (int count = 1; count < 4; ++count) {
    rigid r = rigid_new(zoo_bar(8, 2), 2);
    fixture_handle_near(r.f, EXM_HANDLE_PINNED, 0, 0.1, 0.1, 1);
    if (count > 1) {
      fixture_handle_near(r.f, EXM_HANDLE_PINNED, 1, 0.1, 0.1, 1);
    }
    if (count > 2) {
      fixture_handle_near(r.f, EXM_HANDLE_PINNED, 0.5, 0.1, 0, 1);
    }
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 0);
    for (size_t h = 0; h < r.f->handle_count; ++h) {
      targets[12 * h + 3] += 7;
      targets[12 * h + 7] -= 4;
    }
    double *positions = rigid_solve(&r, targets, NULL, NULL);
    for (size_t v = 0; v < r.f->vertex_count; ++v) {
      CHECK_NEAR(positions[3 * v], (double)r.f->shape.positions[v][0] + 7, 1e-9);
      CHECK_NEAR(positions[3 * v + 1], (double)r.f->shape.positions[v][1] - 4, 1e-9);
      CHECK_NEAR(positions[3 * v + 2], (double)r.f->shape.positions[v][2], 1e-9);
    }
    free(positions);
    free(targets);
    rigid_free(&r);
  }
}

TEST(free_handles_do_nothing)
{
  rigid with = rigid_bar(2), without = rigid_bar(2);
  fixture_handle_near(with.f, EXM_HANDLE_FREE, 0.5, 0.1, 0, 1);
  REQUIRE(rigid_bind(&with) && rigid_bind(&without));
  double *targets = rigid_bend(&without, 1.0), *more = fixture_targets(with.f);
  memcpy(more, targets, 24 * sizeof *more);
  more[27] = NAN; /* not looked at */
  double *a = rigid_solve(&with, more, NULL, NULL), *b = rigid_solve(&without, targets, NULL, NULL);
  CHECK(memcmp(a, b, 3 * with.f->vertex_count * sizeof *a) == 0);
  free(a);
  free(b);
  free(more);
  free(targets);
  rigid_free(&with);
  rigid_free(&without);
}

/* A square sheet, held at its rim and lifted at one vertex: how much higher that is than its neighbours, as a share of
 * the lift. */
static double tip(size_t cells, double handle_size)
{
  rigid r = rigid_new(zoo_grid(cells, cells, 1, 1), 1);
  uint32_t const centre = (uint32_t)((cells / 2) * (cells + 1) + cells / 2);
  uint32_t *rim = test_array(4 * cells, sizeof *rim);
  size_t count = 0;
  for (uint32_t v = 0; v < r.f->vertex_count; ++v) {
    size_t const column = v % (cells + 1), row = v / (cells + 1);
    if (column == 0 || row == 0 || column == cells || row == cells) {
      rim[count++] = v;
    }
  }
  fixture_handle(r.f, EXM_HANDLE_ORIENTED, count, rim);
  fixture_handle(r.f, EXM_HANDLE_PINNED, 1, &centre);
  free(rim);
  r.settings.handle_size = handle_size;
  double share = NAN;
  if (rigid_bind(&r)) {
    double *targets = rigid_bend(&r, 0), lift = 0.2;
    targets[12 + 11] += lift;
    exm_rigidity_solve_settings const settings = rigid_settings(1e-7, 2000);
    double *positions = rigid_solve(&r, targets, &settings, NULL);
    double around = 0;
    size_t const step[] = {centre - 1, centre + 1, centre - cells - 1, centre + cells + 1};
    for (size_t i = 0; i < 4; ++i) {
      around += positions[3 * step[i] + 2] / 4;
    }
    CHECK_NEAR(positions[3 * centre + 2], lift, 1e-12);
    share = (lift - around) / lift;
    free(positions);
    free(targets);
  }
  rigid_free(&r);
  return share;
}

/* A parabola falls off with the square of the distance, a cusp at once. */
TEST(a_point_handle_draws_no_cusp)
{
  double const coarse = tip(24, 0.1), fine = tip(48, 0.1), cusp = tip(48, 0);
  printf("  tip over its neighbours: %.4f and %.4f with a disc, %.4f without\n", coarse, fine, cusp);
  CHECK(fine < 0.4 * coarse);
  CHECK(fine < 0.1 * cusp);
  CHECK(tip(24, 0.03) < 0.5 * tip(24, 0)); /* the least there is, two rings and a half */
}

/* --------------------------------------------------------------------------------------------------------------- size
 */

TEST(radii_beyond_the_mesh_are_all_alike)
{
  rigid wide = rigid_bar(20), wider = rigid_bar(EXM_RADIUS_MAX);
  REQUIRE(rigid_bind(&wide) && rigid_bind(&wider));
  double *targets = rigid_bend(&wide, 1.3);
  double *a = rigid_solve(&wide, targets, NULL, NULL), *b = rigid_solve(&wider, targets, NULL, NULL);
  CHECK(fixture_distance(wide.f->vertex_count, a, b) < 1e-9);
  double *rotations = test_array(9 * wide.f->vertex_count, sizeof *rotations);
  CHECK_STATUS(exm_rigidity_rotations(wide.f->deformer, rotations), EXM_OK);
  for (size_t v = 1; v < wide.f->vertex_count; ++v) {
    for (size_t e = 0; e < 9; ++e) { /* every neighbourhood is the mesh */
      CHECK_NEAR(rotations[9 * v + e], rotations[e], 1e-9);
    }
  }
  free(rotations);
  free(a);
  free(b);
  free(targets);
  rigid_free(&wide);
  rigid_free(&wider);
}

TEST(energies_add_up)
{
  for (size_t i = 0; i < RADIUS_COUNT; ++i) {
    rigid r = bar_of(RADII[i]);
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 1.0), sum = 0;
    exm_solve_report report;
    exm_solve_report_init(&report);
    free(rigid_solve(&r, targets, NULL, &report));
    double *energies = test_array(r.f->vertex_count, sizeof *energies);
    CHECK_STATUS(exm_rigidity_energies(r.f->deformer, energies), EXM_OK);
    for (size_t v = 0; v < r.f->vertex_count; ++v) {
      CHECK(energies[v] >= 0);
      sum += energies[v];
    }
    CHECK_NEAR(sum, report.elastic_energy, 1e-9 * sum);
    free(energies);
    free(targets);
    rigid_free(&r);
  }
}

/* It is there sooner, and ends no higher. */
TEST(a_coarse_start_is_a_head_start)
{
  double history[500];
  for (int32_t radius = 1; radius < 7; radius += 2) {
    rigid r = large_bar(radius);
    REQUIRE(rigid_bind(&r));
    double *targets = rigid_bend(&r, 1.5);
    exm_rigidity_solve_settings settings = rigid_settings(1e-3, 500);
    exm_solve_report coarse, plain;
    exm_solve_report_init(&coarse);
    exm_solve_report_init(&plain);
    coarse.history = history;
    coarse.history_capacity = 500;
    settings.coarse_start = 0;
    free(rigid_solve(&r, targets, &settings, &plain));
    settings.coarse_start = 1;
    free(rigid_solve(&r, targets, &settings, &coarse));
    int32_t reached = 0;
    while (reached < coarse.iterations && history[reached] > 1.001 * plain.elastic_energy) {
      ++reached;
    }
    printf("  r = %d: %d and %d iterations to %g; %g in the end\n", radius, reached + 1, plain.iterations,
           plain.elastic_energy, coarse.elastic_energy);
    CHECK(coarse.elastic_energy < 1.001 * plain.elastic_energy);
    CHECK(radius == 1 || 2 * (reached + 1) < plain.iterations);
    free(targets);
    rigid_free(&r);
  }
}

/* Frames of a drag: the coarser mesh says how rotations turn, whatever the solve before was. */
TEST(warm_solves_turn_along_with_a_coarser_mesh)
{
  rigid r = large_bar(3);
  REQUIRE(rigid_bind(&r));
  exm_handles const handles = fixture_handles(r.f);
  int32_t iterations[2] = {0};
  double energies[2] = {0};
  for (int32_t coarse = 0; coarse < 2; ++coarse) {
    exm_rigidity_solve_settings settings = rigid_settings(1e-4, 0);
    exm_solve_report report;
    exm_solve_report_init(&report);
    for (int frame = 0; frame < 12; ++frame) {
      double *targets = rigid_bend(&r, 0.1 * (frame + 1));
      settings.start = frame ? EXM_START_WARM : EXM_START_STATELESS;
      settings.coarse_start = frame == 5 ? 0 : coarse; /* levels are left behind, and catch up */
      if (frame == 8) {
        CHECK_STATUS(exm_rigidity_set_handles(r.f->deformer, &handles, NULL, NULL), EXM_OK);
      }
      free(rigid_solve(&r, targets, &settings, &report));
      iterations[coarse] += report.iterations;
      energies[coarse] += report.elastic_energy;
      /* Nothing moved: nothing is left to do. */
      free(rigid_solve(&r, targets, &settings, &report));
      CHECK(frame == 0 || report.iterations <= 4);
      free(targets);
    }
  }
  printf("  %d iterations with, %d without\n", iterations[1], iterations[0]);
  CHECK(iterations[1] < iterations[0]);
  CHECK(energies[1] < 1.01 * energies[0]);
  rigid_free(&r);
}
