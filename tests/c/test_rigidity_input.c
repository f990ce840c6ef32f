/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What callers get wrong, calls that are cancelled, and meshes that no artist would make. */
#include "rigidity_fixture.h"

static void check_element(exm_element expected, size_t expected_index)
{
  exm_element kind = EXM_ELEMENT_NONE;
  size_t index = SIZE_MAX;
  exm_last_error_element(&kind, &index);
  CHECK(kind == expected && index == expected_index);
}

static rigid good(void)
{
  rigid r = rigid_bar(2);
  if (!rigid_bind(&r)) {
    exit(1);
  }
  return r;
}

/* ------------------------------------------------------------------------------------------------------------ binding
 */

TEST(create_without_its_arguments)
{
  rigid r = good();
  exm_handles const handles = fixture_handles(r.f);
  exm_deformer *out = (exm_deformer *)(uintptr_t)1;
  CHECK_STATUS(exm_rigidity_create(NULL, &handles, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "mesh", "NULL");
  CHECK(out == NULL);
  CHECK_STATUS(exm_rigidity_create(r.f->reference, NULL, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "handles",
               "NULL");
  CHECK_STATUS(exm_rigidity_create(r.f->reference, &handles, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "out",
               "NULL");
  exm_handles without = handles;
  without.kinds = NULL;
  CHECK_STATUS(exm_rigidity_create(r.f->reference, &without, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "kinds");
  without.count = 0;
  CHECK_STATUS(exm_rigidity_create(r.f->reference, &without, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "handles");
  exm_rigidity_bind_settings_init(NULL);
  exm_rigidity_solve_settings_init(NULL);
  exm_rigidity_learn_settings_init(NULL);
  rigid_free(&r);
}

TEST(create_with_radii_out_of_range)
{
  rigid r = good();
  int32_t const bad[] = {0, -3, EXM_RADIUS_MAX + 1, INT32_MAX, INT32_MIN};
  rigid_mix_radii(&r);
  for (size_t i = 0; i < 5; ++i) {
    char value[32];
    snprintf(value, sizeof value, "%d", bad[i]);
    r.settings.radii = r.radii;
    r.radii[11] = bad[i];
    CHECK_STATUS(rigid_try(&r), EXM_ERROR_ARGUMENT, "settings.radii", "vertex 11", value);
    check_element(EXM_ELEMENT_VERTEX, 11);
    CHECK(r.f->deformer == NULL);
    r.settings.radii = NULL;
    r.settings.radius = bad[i];
    CHECK_STATUS(rigid_try(&r), EXM_ERROR_ARGUMENT, "settings.radius", value);
  }
  r.settings.radius = EXM_RADIUS_MAX;
  CHECK_STATUS(rigid_try(&r), EXM_OK);
  rigid_free(&r);
}

TEST(create_with_a_handle_size_that_is_none)
{
  rigid r = good();
  double const bad[] = {-0.1, 1.5, NAN, INFINITY};
  for (size_t i = 0; i < 4; ++i) {
    r.settings.handle_size = bad[i];
    CHECK_STATUS(rigid_try(&r), EXM_ERROR_ARGUMENT, "settings.handle_size");
  }
  r.settings.handle_size = 1;
  CHECK_STATUS(rigid_try(&r), EXM_OK);
  rigid_free(&r);
}

TEST(create_with_settings_that_were_not_initialised)
{
  rigid r = good();
  r.settings.struct_size = 0;
  CHECK_STATUS(rigid_try(&r), EXM_ERROR_ARGUMENT, "struct_size");
  rigid_free(&r);
}

TEST(a_part_that_nothing_holds)
{
  rigid r = good();
  r.f->kinds[0] = r.f->kinds[1] = EXM_HANDLE_FREE;
  CHECK_STATUS(rigid_try(&r), EXM_ERROR_UNCONSTRAINED, "vertex 0");
  check_element(EXM_ELEMENT_VERTEX, 0);
  rigid_free(&r);
  rigid broken = rigid_new(zoo_bar(3, 1), 1);
  fixture_handle_near(broken.f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
  broken.f->vertices[0] = 999;
  CHECK_STATUS(rigid_try(&broken), EXM_ERROR_ARGUMENT, "999");
  rigid_free(&broken);
}

TEST(a_vertex_in_two_handles)
{
  rigid r = good();
  uint32_t const twice = r.f->vertices[0];
  fixture_handle(r.f, EXM_HANDLE_PINNED, 1, &twice);
  CHECK_STATUS(rigid_try(&r), EXM_ERROR_ARGUMENT, "handles 0 and 2");
  rigid_free(&r);
}

/* ------------------------------------------------------------------------------------------------------------ changes
 */

TEST(changes_that_are_refused_change_nothing)
{
  rigid r = good();
  double *targets = rigid_bend(&r, 1.0);
  double *before = rigid_solve(&r, targets, NULL, NULL);
  int32_t *radii = test_array(r.f->vertex_count, sizeof *radii);
  exm_deformer *d = r.f->deformer;
  CHECK_STATUS(exm_rigidity_set_radii(NULL, radii, 1, NULL, NULL), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_rigidity_set_radii(d, radii, 1, NULL, NULL), EXM_ERROR_ARGUMENT, "radii", "vertex 0");
  CHECK_STATUS(exm_rigidity_set_radii(d, NULL, 0, NULL, NULL), EXM_ERROR_ARGUMENT, "radius is 0");
  CHECK_STATUS(exm_rigidity_set_handles(d, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "handles");
  CHECK_STATUS(exm_rigidity_set_handles(NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "deformer");
  exm_handles handles = fixture_handles(r.f);
  int32_t const all_free[] = {EXM_HANDLE_FREE, EXM_HANDLE_FREE};
  handles.kinds = all_free;
  CHECK_STATUS(exm_rigidity_set_handles(d, &handles, NULL, NULL), EXM_ERROR_UNCONSTRAINED, "free");
  CHECK_STATUS(exm_rigidity_get_radii(d, NULL), EXM_ERROR_ARGUMENT, "radii");
  double *after = rigid_solve(&r, targets, NULL, NULL);
  CHECK(memcmp(before, after, 3 * r.f->vertex_count * sizeof *before) == 0);
  free(before);
  free(after);
  free(radii);
  free(targets);
  rigid_free(&r);
}

static int cancel_after(void *user, double fraction, const char *stage)
{
  int *left = user;
  CHECK(fraction >= 0 && fraction <= 1 && stage != NULL);
  return (*left)-- == 0;
}

/* Wherever the caller stops it, the deformer is as it was. */
TEST(cancelled_calls_change_nothing)
{
  rigid r = good();
  double *targets = rigid_bend(&r, 1.0);
  double *before = rigid_solve(&r, targets, NULL, NULL);
  exm_handles const handles = fixture_handles(r.f);
  for (int stop = 0, more = 1; more && stop < 100; ++stop) {
    int left = stop;
    exm_deformer *out = (exm_deformer *)(uintptr_t)1;
    exm_status const status = exm_rigidity_create(r.f->reference, &handles, &r.settings, cancel_after, &left, &out);
    more = status == EXM_ERROR_CANCELLED;
    CHECK(more ? out == NULL : status == EXM_OK);
    exm_deformer_destroy(out);
    CHECK(stop > 1 || more);
  }
  for (int stop = 0, more = 1; more && stop < 100; ++stop) {
    int left = stop;
    more = exm_rigidity_set_radii(r.f->deformer, NULL, 7, cancel_after, &left) == EXM_ERROR_CANCELLED;
    if (more) {
      double *after = rigid_solve(&r, targets, NULL, NULL);
      CHECK(memcmp(before, after, 3 * r.f->vertex_count * sizeof *before) == 0);
      free(after);
    }
    CHECK(stop > 0 || more);
  }
  int left = 0;
  CHECK_STATUS(exm_rigidity_set_handles(r.f->deformer, &handles, cancel_after, &left), EXM_ERROR_CANCELLED);
  free(before);
  free(targets);
  rigid_free(&r);
}

/* ------------------------------------------------------------------------------------------------------------ solving
 */

static exm_status solve_with(const rigid *r, const double *targets, exm_rigidity_solve_settings settings)
{
  return exm_rigidity_solve(r->f->deformer, targets, &settings, NULL);
}

TEST(solve_with_settings_out_of_range)
{
  rigid r = good();
  double *targets = rigid_bend(&r, 1.0);
  exm_rigidity_solve_settings const fine = rigid_settings(1e-3, 0);
  exm_rigidity_solve_settings bad = fine;
  CHECK_STATUS(exm_rigidity_solve(NULL, targets, &fine, NULL), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_rigidity_solve(r.f->deformer, NULL, &fine, NULL), EXM_ERROR_ARGUMENT, "targets");
  bad.start = 3;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.start", "3");
  bad.start = EXM_START_POSITIONS;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.positions", "NULL");
  float *positions = test_array(3 * r.f->vertex_count, sizeof *positions);
  bad.positions = positions;
  positions[3 * 5 + 1] = NAN;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.positions", "vertex 5");
  check_element(EXM_ELEMENT_VERTEX, 5);
  double const tolerances[] = {-1, NAN, INFINITY};
  for (size_t i = 0; i < 3; ++i) {
    bad = fine;
    bad.tolerance = tolerances[i];
    CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.tolerance");
  }
  bad = fine;
  bad.iterations = -1;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.iterations", "-1");
  bad = fine;
  bad.acceleration = 2;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.acceleration", "2");
  bad = fine;
  bad.coarse_start = 2;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.coarse_start", "2");
  bad = fine;
  bad.thread_count = -2;
  CHECK_STATUS(solve_with(&r, targets, bad), EXM_ERROR_ARGUMENT, "settings.thread_count", "-2");
  CHECK_STATUS(exm_rigidity_energies(r.f->deformer, targets), EXM_ERROR_ARGUMENT, "solved");
  CHECK_STATUS(exm_rigidity_rotations(r.f->deformer, targets), EXM_ERROR_ARGUMENT, "solved");
  free(positions);
  free(targets);
  rigid_free(&r);
}

TEST(solve_with_targets_that_are_no_numbers)
{
  rigid r = good();
  double *targets = rigid_bend(&r, 1.0);
  double *before = rigid_solve(&r, targets, NULL, NULL);
  double const bad[] = {NAN, INFINITY, 1e200};
  for (size_t i = 0; i < 3; ++i) {
    double const kept = targets[12 + 7];
    targets[12 + 7] = bad[i];
    if (i < 2) {
      CHECK_STATUS(exm_rigidity_solve(r.f->deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "handle 1", "row 1");
      check_element(EXM_ELEMENT_HANDLE, 1);
    } else {
      CHECK_STATUS(exm_rigidity_solve(r.f->deformer, targets, NULL, NULL), EXM_ERROR_NUMERIC, "too large");
    }
    double *after = fixture_positions(r.f);
    CHECK(memcmp(before, after, 3 * r.f->vertex_count * sizeof *before) == 0);
    free(after);
    targets[12 + 7] = kept;
  }
  free(before);
  free(targets);
  rigid_free(&r);
}

TEST(a_cap_is_a_warning)
{
  rigid r = good();
  double *targets = rigid_bend(&r, 2.5);
  exm_rigidity_solve_settings const settings = rigid_settings(1e-9, 3);
  exm_solve_report report;
  exm_solve_report_init(&report);
  CHECK_STATUS(exm_rigidity_solve(r.f->deformer, targets, &settings, &report), EXM_WARNING_NOT_CONVERGED, "3 iter");
  CHECK(report.iterations == 3 && !report.converged);
  free(targets);
  rigid_free(&r);
}

TEST(deformers_of_another_kind)
{
  fixture *f = fixture_bar(2);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  REQUIRE(fixture_bind(f));
  double *targets = fixture_targets(f);
  CHECK_STATUS(exm_rigidity_solve(f->deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "AMRAP", "Rigidity");
  CHECK_STATUS(exm_rigidity_set_radii(f->deformer, NULL, 1, NULL, NULL), EXM_ERROR_ARGUMENT, "AMRAP");
  rigid r = good();
  CHECK_STATUS(exm_amrap_solve(r.f->deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "Rigidity", "AMRAP");
  float weight;
  CHECK_STATUS(exm_deformer_weights(r.f->deformer, &weight), EXM_ERROR_ARGUMENT, "weights");
  exm_amrap_solve_settings amrap;
  exm_amrap_solve_settings_init(&amrap);
  amrap.start = EXM_START_POSITIONS;
  CHECK_STATUS(exm_amrap_solve(f->deformer, targets, &amrap, NULL), EXM_ERROR_ARGUMENT, "settings.start");
  rigid_free(&r);
  free(targets);
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------------------- meshes
 */

/* One pinned vertex a connected part, more where a part has more: moved at random, nothing breaks. */
static void check_any_mesh(const zoo_mesh *shape, int32_t radius, double handle_size, test_random *random)
{
  exm_mesh *m = zoo_create(shape);
  size_t const V = shape->vertex_count;
  int32_t *kinds = test_array(V, sizeof *kinds);
  size_t *offsets = test_array(V + 1, sizeof *offsets);
  uint32_t *vertices = test_array(V, sizeof *vertices);
  double *targets = test_array(12 * V, sizeof *targets), *positions = test_array(3 * V, sizeof *positions);
  exm_rigidity_bind_settings settings;
  exm_rigidity_bind_settings_init(&settings);
  settings.radius = radius;
  settings.handle_size = handle_size;
  /* Every third vertex: whatever parts there are, most are held; where one is not, that is what is said. */
  exm_handles handles = {.kinds = kinds, .vertex_offsets = offsets, .vertices = vertices};
  for (uint32_t v = 0; v < V; v += 1 + (uint32_t)(handle_size > 0 && V > 8) * 2) {
    vertices[handles.count++] = v;
    offsets[handles.count] = handles.count;
  }
  double size = 0;
  for (size_t i = 0; i < 3 * V; ++i) {
    size = fmax(size, fabs((double)shape->positions[i / 3][i % 3]));
  }
  exm_deformer *deformer = NULL;
  exm_status const status = exm_rigidity_create(m, &handles, &settings, NULL, NULL, &deformer);
  CHECK(status == EXM_OK || status == EXM_ERROR_UNCONSTRAINED);
  if (status == EXM_OK) {
    CHECK_STATUS(exm_deformer_handle_pose(deformer, 0, targets), EXM_OK);
    for (size_t h = 0; h < handles.count; ++h) {
      for (size_t k = 0; k < 3; ++k) {
        targets[12 * h + 4 * k + 3] += size * (0.4 * test_uniform(random) - 0.2);
      }
    }
    CHECK(exm_rigidity_solve(deformer, targets, NULL, NULL) >= 0);
    CHECK_STATUS(exm_deformer_positions_f64(deformer, positions), EXM_OK);
    for (size_t i = 0; i < 3 * V; ++i) {
      CHECK(fabs(positions[i]) < 10 * size);
    }
    for (size_t h = 0; h < handles.count; ++h) {
      for (size_t k = 0; k < 3; ++k) {
        CHECK_NEAR(positions[3 * vertices[h] + k], targets[12 * h + 4 * k + 3], 1e-12 * size);
      }
    }
  }
  exm_deformer_destroy(deformer);
  exm_mesh_destroy(m);
  free(kinds);
  free(offsets);
  free(vertices);
  free(targets);
  free(positions);
}

TEST(any_mesh_of_the_zoo)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  test_random random = {5};
  for (size_t i = 0; i < count; ++i) {
    for (int32_t radius = 1; radius <= 20; radius += 6) {
      test_about("%s, r = %d", all[i].name, radius);
      check_any_mesh(&all[i], radius, 0, &random); /* every vertex a handle */
      check_any_mesh(&all[i], radius, 0.03, &random);
    }
  }
}

/* A grid with columns squeezed to nothing, and sheared until all but a few cotangents are negative. */
TEST(slivers_and_obtuse_triangles)
{
  for (int kind = 0; kind < 3; ++kind) {
    for (int32_t radius = 1; radius < 9; radius += 3) {
      zoo_mesh shape = zoo_grid(12, 8, 1, 1);
      for (size_t v = 0; v < shape.vertex_count; ++v) {
        float *p = shape.positions[v];
        p[0] = kind == 0 ? p[0] * p[0] * p[0] * p[0] * p[0] * p[0] : p[0] + (kind == 1 ? 8 : -8) * p[1];
      }
      rigid r = rigid_new(shape, radius);
      uint32_t const last = (uint32_t)shape.vertex_count - 1, first = 0;
      fixture_handle(r.f, EXM_HANDLE_ORIENTED, 1, &first);
      fixture_handle(r.f, EXM_HANDLE_ORIENTED, 1, &last);
      test_about("kind %d, r = %d", kind, radius);
      REQUIRE(rigid_bind(&r));
      double *targets = rigid_bend(&r, 0);
      targets[12 + 11] += 0.2;
      exm_solve_report report;
      exm_solve_report_init(&report);
      double *positions = rigid_solve(&r, targets, NULL, &report);
      CHECK(report.elastic_energy >= 0 && isfinite(report.elastic_energy));
      for (size_t i = 0; i < 3 * r.f->vertex_count; ++i) {
        CHECK(fabs(positions[i]) < 20);
      }
      free(positions);
      free(targets);
      rigid_free(&r);
    }
  }
}

/* Vertices on top of each other, each a handle, and handles that are sent to one point. */
TEST(handles_that_coincide)
{
  rigid r = rigid_new(zoo_grid(6, 6, 1, 1), 2);
  memcpy(r.f->exemplars + 3 * 9, r.f->exemplars + 3 * 8, 3 * sizeof(float));
  uint32_t const at[] = {8, 9, 40};
  for (size_t i = 0; i < 3; ++i) {
    fixture_handle(r.f, i == 2 ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, 1, &at[i]);
  }
  REQUIRE(rigid_bind(&r));
  for (int same = 0; same < 2; ++same) {
    double *targets = rigid_bend(&r, 0.3);
    for (size_t h = 0; h < 3; ++h) {
      for (size_t k = 0; k < 3; ++k) {
        targets[12 * h + 4 * k + 3] = same ? 0.5 : targets[12 * h + 4 * k + 3] + (h == 0 && k == 2 ? 0.3 : 0);
      }
    }
    double *positions = rigid_solve(&r, targets, NULL, NULL);
    for (size_t i = 0; i < 3 * r.f->vertex_count; ++i) {
      CHECK(fabs(positions[i]) < 5);
    }
    free(positions);
    free(targets);
  }
  rigid_free(&r);
}

/* ----------------------------------------------------------------------------------------------------------- learning
 */

TEST(learn_without_what_it_needs)
{
  rigid r = good();
  fixture *f = r.f;
  int32_t *radii = test_array(f->vertex_count, sizeof *radii);
  exm_rigidity_learn_settings settings;
  exm_rigidity_learn_settings_init(&settings);
  CHECK_STATUS(exm_rigidity_learn(NULL, f->exemplars, 1, NULL, NULL, NULL, radii, NULL), EXM_ERROR_ARGUMENT, "mesh");
  CHECK_STATUS(exm_rigidity_learn(f->reference, NULL, 1, NULL, NULL, NULL, radii, NULL), EXM_ERROR_ARGUMENT, "poses");
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 1, NULL, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT,
               "radii");
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 0, NULL, NULL, NULL, radii, NULL), EXM_ERROR_ARGUMENT,
               "pose_count is 0");
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, SIZE_MAX / 4, NULL, NULL, NULL, radii, NULL),
               EXM_ERROR_OUT_OF_MEMORY, "poses");
  settings.radius_min = 0;
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 1, &settings, NULL, NULL, radii, NULL),
               EXM_ERROR_ARGUMENT, "settings.radius_min", "0");
  settings.radius_min = 4;
  settings.radius_max = 3;
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 1, &settings, NULL, NULL, radii, NULL),
               EXM_ERROR_ARGUMENT, "settings.radius_max", "3");
  settings.radius_max = EXM_RADIUS_MAX + 1;
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 1, &settings, NULL, NULL, radii, NULL),
               EXM_ERROR_ARGUMENT, "settings.radius_max");
  settings.radius_max = 6;
  settings.omega = -1;
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 1, &settings, NULL, NULL, radii, NULL),
               EXM_ERROR_ARGUMENT, "settings.omega", "-1");
  f->exemplars[3 * 4] = NAN;
  CHECK_STATUS(exm_rigidity_learn(f->reference, f->exemplars, 1, NULL, NULL, NULL, radii, NULL), EXM_ERROR_ARGUMENT,
               "pose 0", "vertex 4");
  check_element(EXM_ELEMENT_VERTEX, 4);
  for (size_t v = 0; v < f->vertex_count; ++v) {
    CHECK(radii[v] == 0); /* as it was */
  }
  free(radii);
  rigid_free(&r);
}

TEST(learning_can_be_cancelled)
{
  rigid r = good();
  int32_t *radii = test_array(r.f->vertex_count, sizeof *radii);
  int more = 1;
  for (int stop = 0; more && stop < 100; ++stop) {
    int left = stop;
    exm_status const status =
        exm_rigidity_learn(r.f->reference, r.f->exemplars, 1, NULL, cancel_after, &left, radii, NULL);
    more = status == EXM_ERROR_CANCELLED;
    CHECK((radii[0] == 0) == more);
  }
  CHECK(!more);
  free(radii);
  rigid_free(&r);
}

/* The zoo's flawed meshes have vertices and triangles of no area. */
TEST(learning_on_any_mesh_of_the_zoo)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  for (size_t i = 0; i < count; ++i) {
    test_about("%s", all[i].name);
    exm_mesh *m = zoo_create(&all[i]);
    int32_t *radii = test_array(all[i].vertex_count, sizeof *radii);
    CHECK_STATUS(exm_rigidity_learn(m, all[i].positions[0], 1, NULL, NULL, NULL, radii, NULL), EXM_OK);
    for (size_t v = 0; v < all[i].vertex_count; ++v) {
      CHECK(radii[v] == 6); /* nothing moved */
    }
    free(radii);
    exm_mesh_destroy(m);
  }
}
