/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What callers get wrong, binds that are cancelled, and meshes that no artist would make. */
#include "allocation.h"
#include "amrap_fixture.h"

/* A bound bar with what a call needs; tests spoil one thing. */
static fixture *good_fixture(void)
{
  fixture *f = fixture_bar(3);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  if (!fixture_bind(f)) {
    exit(1);
  }
  return f;
}

/* ------------------------------------------------------------------------------------------------------------ binding
 */

typedef struct binding {
  fixture *f;
  exm_mesh *mesh;
  const float *exemplars;
  size_t exemplar_count;
  exm_handles handles;
  exm_amrap_bind_settings settings;
} binding;

static binding good_binding(void)
{
  binding b = {.f = good_fixture()};
  b.mesh = b.f->reference;
  b.exemplars = b.f->exemplars;
  b.exemplar_count = b.f->exemplar_count;
  b.handles = fixture_handles(b.f);
  exm_amrap_bind_settings_init(&b.settings);
  return b;
}

static exm_status bind(const binding *b)
{
  exm_deformer *out = (exm_deformer *)(uintptr_t)1;
  exm_status const status =
      exm_amrap_create(b->mesh, b->exemplars, b->exemplar_count, &b->handles, &b->settings, NULL, NULL, &out);
  if (status < 0) {
    CHECK(out == NULL);
  } else {
    exm_deformer_destroy(out);
  }
  return status;
}

static void check_element(exm_element expected, size_t expected_index)
{
  exm_element kind = EXM_ELEMENT_NONE;
  size_t index = SIZE_MAX;
  exm_last_error_element(&kind, &index);
  CHECK(kind == expected && index == expected_index);
}

TEST(create_without_its_arguments)
{
  binding b = good_binding();
  exm_deformer *out = (exm_deformer *)(uintptr_t)1;
  CHECK_STATUS(bind(&b), EXM_OK);
  CHECK_STATUS(exm_amrap_create(NULL, b.exemplars, 3, &b.handles, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "mesh",
               "NULL");
  CHECK(out == NULL);
  CHECK_STATUS(exm_amrap_create(b.mesh, NULL, 3, &b.handles, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "exemplars",
               "NULL");
  CHECK_STATUS(exm_amrap_create(b.mesh, b.exemplars, 3, NULL, NULL, NULL, NULL, &out), EXM_ERROR_ARGUMENT, "handles",
               "NULL");
  CHECK_STATUS(exm_amrap_create(b.mesh, b.exemplars, 3, &b.handles, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "out",
               "NULL");
  fixture_free(b.f);
}

TEST(create_with_exemplars_that_are_none)
{
  binding b = good_binding();
  b.exemplar_count = 0;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "exemplar_count", "0");
  b.exemplar_count = SIZE_MAX / 8;
  CHECK_STATUS(bind(&b), EXM_ERROR_OUT_OF_MEMORY, "exemplars");
  b.exemplar_count = 3;
  size_t const V = b.f->vertex_count;
  float const bad[] = {NAN, INFINITY, -INFINITY};
  for (size_t i = 0; i < 3; ++i) {
    float *at = b.f->exemplars + (2 * V + 7) * 3 + i;
    float const kept = *at;
    *at = bad[i];
    CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "exemplar 2", "vertex 7");
    check_element(EXM_ELEMENT_VERTEX, 7);
    *at = kept;
  }
  CHECK_STATUS(bind(&b), EXM_OK);
  fixture_free(b.f);
}

TEST(create_with_too_few_handles)
{
  binding b = good_binding();
  b.handles.count = 1;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "handles", "1", "two");
  b.handles.count = 0;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "handles", "0");
  fixture_free(b.f);
}

TEST(create_with_handles_without_arrays)
{
  binding b = good_binding();
  exm_handles const good = b.handles;
  b.handles.kinds = NULL;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "kinds", "NULL");
  b.handles = good;
  b.handles.vertex_offsets = NULL;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertex_offsets", "NULL");
  b.handles = good;
  b.handles.vertices = NULL;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertices", "NULL");
  fixture_free(b.f);
}

TEST(create_with_a_handle_of_no_kind)
{
  binding b = good_binding();
  int32_t const kinds[] = {3, -1, INT32_MAX};
  for (size_t i = 0; i < 3; ++i) {
    b.f->kinds[i + 1] = kinds[i];
    char value[32], handle[32];
    snprintf(value, sizeof value, "%d", kinds[i]);
    snprintf(handle, sizeof handle, "handle %zu", i + 1);
    CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, handle, value);
    check_element(EXM_ELEMENT_HANDLE, i + 1);
    b.f->kinds[i + 1] = EXM_HANDLE_PINNED;
  }
  fixture_free(b.f);
}

TEST(create_with_wrong_offsets)
{
  binding b = good_binding();
  size_t *offsets = b.f->offsets;
  offsets[0] = 1;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertex_offsets", "1");
  offsets[0] = 0;
  offsets[3] = offsets[2];
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "handle 2", "no vertices");
  check_element(EXM_ELEMENT_HANDLE, 2);
  offsets[3] = 1;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "handle 2", "1");
  offsets[3] = 3;
  offsets[5] = SIZE_MAX;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertices");
  fixture_free(b.f);
}

TEST(create_with_overlapping_handles)
{
  binding b = good_binding();
  char vertex[32];
  uint32_t const kept = b.f->vertices[3];
  b.f->vertices[3] = b.f->vertices[1];
  snprintf(vertex, sizeof vertex, "vertex %u", b.f->vertices[1]);
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, vertex, "1 and 3");
  check_element(EXM_ELEMENT_VERTEX, b.f->vertices[1]);
  b.f->vertices[3] = (uint32_t)b.f->vertex_count;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "handle 3", "vertex");
  b.f->vertices[3] = kept;
  uint32_t const twice[] = {20, 20};
  fixture_handle(b.f, EXM_HANDLE_PINNED, 2, twice);
  b.handles = fixture_handles(b.f);
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertex 20", "twice", "handle 5");
  fixture_free(b.f);
}

TEST(create_where_nothing_is_held)
{
  binding b = good_binding();
  for (size_t h = 0; h < 5; ++h) {
    b.f->kinds[h] = EXM_HANDLE_FREE;
  }
  CHECK_STATUS(bind(&b), EXM_ERROR_UNCONSTRAINED, "free", "vertex 0");
  check_element(EXM_ELEMENT_VERTEX, 0);
  b.f->kinds[2] = EXM_HANDLE_PINNED;
  CHECK_STATUS(bind(&b), EXM_OK);
  fixture_free(b.f);
}

/* Two spheres, vertices interleaved: one of them has no handle, or only a free one. */
TEST(create_where_a_part_is_not_held)
{
  zoo_mesh const *spheres = zoo_find("two components");
  exm_mesh *mesh = zoo_create(spheres);
  int32_t kinds[] = {EXM_HANDLE_PINNED, EXM_HANDLE_PINNED, EXM_HANDLE_FREE};
  size_t const offsets[] = {0, 1, 2, 3};
  uint32_t const even[] = {0, 2, 4}, mixed[] = {0, 2, 5};
  exm_handles handles = {.count = 3, .kinds = kinds, .vertex_offsets = offsets, .vertices = even};
  exm_deformer *out;
  CHECK_STATUS(exm_amrap_create(mesh, spheres->positions[0], 1, &handles, NULL, NULL, NULL, &out),
               EXM_ERROR_UNCONSTRAINED, "1 of 2", "vertex 1");
  check_element(EXM_ELEMENT_VERTEX, 1);
  handles.vertices = mixed;
  CHECK_STATUS(exm_amrap_create(mesh, spheres->positions[0], 1, &handles, NULL, NULL, NULL, &out),
               EXM_ERROR_UNCONSTRAINED, "1 of 2", "vertex 1", "free");
  kinds[2] = EXM_HANDLE_ORIENTED;
  CHECK_STATUS(exm_amrap_create(mesh, spheres->positions[0], 1, &handles, NULL, NULL, NULL, &out), EXM_OK);
  exm_deformer_destroy(out);
  exm_mesh_destroy(mesh);
}

TEST(create_in_a_dimension_that_is_not)
{
  binding b = good_binding();
  b.settings.dimension = 1;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "settings.dimension", "1");
  b.settings.dimension = -2;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "settings.dimension", "-2");
  b.settings.dimension = 2;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "settings.dimension", "vertex", "plane");
  b.settings.dimension = 3;
  CHECK_STATUS(bind(&b), EXM_OK);
  fixture_free(b.f);
}

/* A flat mesh with an exemplar that is not. */
TEST(create_flat_with_an_exemplar_that_is_not)
{
  fixture *f = fixture_grid(3);
  fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
  f->exemplars[(2 * f->vertex_count + 33) * 3 + 2] = 0.25F;
  exm_handles const handles = fixture_handles(f);
  REQUIRE(fixture_bind(f));
  exm_deformer_info info;
  exm_deformer_info_init(&info);
  CHECK_STATUS(exm_deformer_get_info(f->deformer, &info), EXM_OK);
  CHECK(info.dimension == 3);
  f->settings.dimension = 2;
  exm_deformer *out;
  CHECK_STATUS(exm_amrap_create(f->reference, f->exemplars, 3, &handles, &f->settings, NULL, NULL, &out),
               EXM_ERROR_ARGUMENT, "vertex 33", "exemplar 2", "0.25");
  fixture_free(f);
}

TEST(create_with_too_many_edge_groups)
{
  binding b = good_binding();
  b.settings.edge_group_count = b.f->vertex_count + 1;
  char value[32];
  snprintf(value, sizeof value, "%zu", b.f->vertex_count + 1);
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "settings.edge_group_count", value);
  b.settings.edge_group_count = b.f->vertex_count;
  CHECK_STATUS(bind(&b), EXM_OK);
  b.settings.edge_group_count = 1;
  CHECK_STATUS(bind(&b), EXM_OK);
  fixture_free(b.f);
}

TEST(create_with_weights_that_are_none)
{
  binding b = good_binding();
  size_t const V = b.f->vertex_count;
  float *weights = test_array(5 * V, sizeof *weights);
  CHECK_STATUS(exm_deformer_weights(b.f->deformer, weights), EXM_OK);
  b.settings.weights = weights;
  CHECK_STATUS(bind(&b), EXM_OK);
  float *at = weights + 2 * V + 9;
  float const kept = *at;
  *at = kept + 0.1F;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertex 9", "1");
  check_element(EXM_ELEMENT_VERTEX, 9);
  *at = NAN;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertex 9", "handle 2");
  *at = -0.25F;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "vertex 9", "handle 2", "-0.25");
  *at = kept;
  uint32_t const held = b.f->vertices[1];
  weights[1 * V + held] = 0;
  weights[0 * V + held] = 1;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "handle 1", "0");
  check_element(EXM_ELEMENT_VERTEX, held);
  free(weights);
  fixture_free(b.f);
}

/* ------------------------------------------------------------------------------------------------- structs that grow
 */

typedef struct longer_settings {
  exm_amrap_solve_settings known;
  double unknown[4];
} longer_settings;

TEST(struct_sizes_of_settings)
{
  binding b = good_binding();
  double targets[60];
  exm_amrap_solve_settings settings;
  CHECK_STATUS(exm_deformer_handle_pose(b.f->deformer, 1, targets), EXM_OK);
  exm_amrap_solve_settings_init(&settings);
  settings.struct_size = 0;
  CHECK_STATUS(exm_amrap_solve(b.f->deformer, targets, &settings, NULL), EXM_ERROR_ARGUMENT, "settings", "struct_size",
               "0", "_init");
  settings.struct_size = 1 << 20;
  CHECK_STATUS(exm_amrap_solve(b.f->deformer, targets, &settings, NULL), EXM_ERROR_ARGUMENT, "struct_size", "1048576");
  b.settings.struct_size = 0;
  CHECK_STATUS(bind(&b), EXM_ERROR_ARGUMENT, "settings", "struct_size", "0");
  /* An older caller knew dimension, but not weights: what lies there is not looked at. */
  b.settings.struct_size = offsetof(exm_amrap_bind_settings, weights);
  b.settings.weights = (const float *)(uintptr_t)8;
  CHECK_STATUS(bind(&b), EXM_OK);
  /* And lambda alone: a blend that is none goes unseen. */
  exm_amrap_solve_settings_init(&settings);
  settings.struct_size = offsetof(exm_amrap_solve_settings, blend);
  settings.blend = 77;
  settings.tolerance = NAN;
  CHECK_STATUS(exm_amrap_solve(b.f->deformer, targets, &settings, NULL), EXM_OK);
  settings.lambda = -1;
  CHECK_STATUS(exm_amrap_solve(b.f->deformer, targets, &settings, NULL), EXM_ERROR_ARGUMENT, "lambda", "-1");
  /* A newer caller knows more than we do. */
  longer_settings longer = {.unknown = {1, 2, 3, 4}};
  exm_amrap_solve_settings_init(&longer.known);
  longer.known.struct_size = sizeof longer;
  CHECK_STATUS(exm_amrap_solve(b.f->deformer, targets, &longer.known, NULL), EXM_OK);
  fixture_free(b.f);
}

typedef struct longer_report {
  exm_solve_report known;
  unsigned char unknown[32];
} longer_report;

TEST(struct_sizes_of_reports)
{
  fixture *f = good_fixture();
  double targets[60];
  exm_solve_report report;
  exm_deformer_info info;
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  exm_solve_report_init(&report);
  report.struct_size = 0;
  CHECK_STATUS(exm_amrap_solve(f->deformer, targets, NULL, &report), EXM_ERROR_ARGUMENT, "report", "struct_size", "0");
  exm_deformer_info_init(&info);
  info.struct_size = 3;
  CHECK_STATUS(exm_deformer_get_info(f->deformer, &info), EXM_ERROR_ARGUMENT, "info", "struct_size", "3");
  /* An older caller's report ends before the seconds. */
  exm_solve_report_init(&report);
  report.struct_size = offsetof(exm_solve_report, seconds);
  report.seconds = -5;
  report.history = (double *)(uintptr_t)8;
  report.history_capacity = 99;
  CHECK_STATUS(exm_amrap_solve(f->deformer, targets, NULL, &report), EXM_OK);
  CHECK(report.iterations == 5 && report.seconds == -5 && report.history_capacity == 99);
  CHECK(report.struct_size == offsetof(exm_solve_report, seconds));
  exm_deformer_info_init(&info);
  info.struct_size = offsetof(exm_deformer_info, exemplar_count);
  CHECK_STATUS(exm_deformer_get_info(f->deformer, &info), EXM_OK);
  CHECK(info.handle_count == 5 && info.exemplar_count == 0);
  /* A newer caller's has room that we do not know of. */
  longer_report longer;
  memset(&longer, 0x5a, sizeof longer);
  exm_solve_report_init(&longer.known);
  longer.known.struct_size = sizeof longer;
  CHECK_STATUS(exm_amrap_solve(f->deformer, targets, NULL, &longer.known), EXM_OK);
  CHECK(longer.known.iterations == 5 && longer.known.seconds > 0);
  for (size_t i = 0; i < sizeof longer.unknown; ++i) {
    CHECK(longer.unknown[i] == 0x5a);
  }
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------------------ solving
 */

#define CHECK_SETTING(field, value, ...)                                                                               \
  do {                                                                                                                 \
    exm_amrap_solve_settings_init(&settings);                                                                          \
    settings.field = (value);                                                                                          \
    CHECK_STATUS(exm_amrap_solve(f->deformer, targets, &settings, NULL), EXM_ERROR_ARGUMENT, "settings." #field,       \
                 __VA_ARGS__);                                                                                         \
  } while (0)

TEST(solve_with_settings_out_of_range)
{
  fixture *f = good_fixture();
  double targets[60];
  exm_amrap_solve_settings settings;
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  double *before = fixture_solve(f, targets, NULL, NULL);
  targets[3] += 1;
  CHECK_SETTING(lambda, -0.5, "-0.5");
  CHECK_SETTING(lambda, NAN, "nan");
  CHECK_SETTING(lambda, INFINITY, "inf");
  CHECK_SETTING(blend, 2, "2");
  CHECK_SETTING(blend, -1, "-1");
  CHECK_SETTING(rotations, 2, "2");
  CHECK_SETTING(rotations, -1, "-1");
  CHECK_SETTING(start, 2, "2");
  CHECK_SETTING(start, -1, "-1");
  CHECK_SETTING(descent, 3, "3");
  CHECK_SETTING(descent, -1, "-1");
  CHECK_SETTING(iterations, -1, "-1");
  CHECK_SETTING(tolerance, -1e-3, "-0.001");
  CHECK_SETTING(tolerance, NAN, "nan");
  CHECK_SETTING(tolerance, INFINITY, "inf");
  double *after = fixture_positions(f); /* nothing has changed */
  CHECK(memcmp(before, after, 3 * f->vertex_count * sizeof(double)) == 0);
  free(before);
  free(after);
  fixture_free(f);
}

TEST(solve_for_targets_that_are_none)
{
  fixture *f = fixture_bar(2);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
  fixture_handle_near(f, EXM_HANDLE_ORIENTED, 1, 0.1, 0.1, 1);
  fixture_handle_near(f, EXM_HANDLE_FREE, 0.5, 0.1, 0.1, 0);
  REQUIRE(fixture_bind(f));
  double targets[36], bad[] = {NAN, INFINITY, -INFINITY};
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  CHECK_STATUS(exm_amrap_solve(NULL, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "deformer", "NULL");
  CHECK_STATUS(exm_amrap_solve(f->deformer, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "targets", "NULL");
  double *before = fixture_solve(f, targets, NULL, NULL);
  for (size_t i = 0; i < 36; ++i) {
    double const kept = targets[i];
    int const counts = i < 12 ? i % 4 == 3 : i < 24;
    char handle[32];
    snprintf(handle, sizeof handle, "handle %zu", i / 12);
    test_about("number %zu", i);
    targets[i] = bad[i % 3];
    if (counts) {
      CHECK_STATUS(exm_amrap_solve(f->deformer, targets, NULL, NULL), EXM_ERROR_ARGUMENT, "targets", handle, "finite");
      check_element(EXM_ELEMENT_HANDLE, i / 12);
    } else {
      CHECK_STATUS(exm_amrap_solve(f->deformer, targets, NULL, NULL), EXM_OK);
    }
    targets[i] = kept;
    double *after = fixture_positions(f);
    CHECK(memcmp(before, after, 3 * f->vertex_count * sizeof(double)) == 0);
    free(after);
  }
  free(before);
  fixture_free(f);
}

/* Targets so far away that their squares are not finite: an error that names its kind, and the last result stays. */
TEST(solve_for_targets_beyond_numbers)
{
  fixture *f = good_fixture();
  double targets[60], far[] = {1e160, 1e300, 1e308};
  exm_amrap_solve_settings warm;
  exm_amrap_solve_settings_init(&warm);
  warm.start = EXM_START_WARM;
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  double *expected = fixture_solve(f, targets, NULL, NULL);
  for (int i = 0; i < 6; ++i) {
    double const kept = targets[3];
    test_about("%g, %s", far[i / 2], i % 2 ? "warm" : "stateless");
    targets[3] = far[i / 2];
    CHECK(exm_amrap_solve(f->deformer, targets, i % 2 ? &warm : NULL, NULL) == EXM_ERROR_NUMERIC);
    targets[3] = kept;
    double *stayed = fixture_positions(f), *further = fixture_solve(f, targets, &warm, NULL);
    double *again = fixture_solve(f, targets, NULL, NULL);
    CHECK(memcmp(stayed, expected, 3 * f->vertex_count * sizeof(double)) == 0);
    CHECK_NEAR(fixture_distance(f->vertex_count, further, expected) / f->diagonal, 0, 1e-5);
    CHECK(memcmp(again, expected, 3 * f->vertex_count * sizeof(double)) == 0);
    free(stayed);
    free(further);
    free(again);
  }
  free(expected);
  fixture_free(f);
}

/* Far away, but within reach. */
TEST(solve_for_distant_targets)
{
  fixture *f = good_fixture();
  double targets[60];
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  for (double far = 10; far < 1e7; far *= 10) {
    exm_solve_report report;
    exm_solve_report_init(&report);
    test_about("%g", far);
    targets[3] = far;
    double *positions = fixture_solve(f, targets, NULL, &report);
    CHECK_NEAR(report.constraint_residual / far, 0, 1e-9);
    CHECK_NEAR(positions[3 * f->vertices[0]] / far, 1, 1e-6);
    free(positions);
  }
  fixture_free(f);
}

/* All handles on one point; handles mirrored; nothing finite is refused. */
TEST(solve_for_targets_no_shape_can_have)
{
  fixture *f = good_fixture();
  for (int kind = 0; kind < 4; ++kind) {
    double targets[60] = {0};
    exm_solve_report report;
    exm_solve_report_init(&report);
    CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 0, targets), EXM_OK);
    for (size_t h = 0; h < 5; ++h) {
      for (size_t k = 0; k < 3; ++k) {
        double *at = targets + 12 * h + 4 * k + 3;
        *at = kind == 0 ? 0 : kind == 1 ? (k == 0 ? -*at : *at) : kind == 2 ? (k == 0 ? *at : 0) : -*at;
      }
    }
    test_about("kind %d", kind);
    double *positions = fixture_solve(f, targets, NULL, &report);
    CHECK(isfinite(report.objective) && report.objective >= 0);
    CHECK_NEAR(report.constraint_residual / f->diagonal, 0, 1e-6);
    CHECK(isfinite(fixture_distance_to_exemplar(f, 0, positions)));
    free(positions);
  }
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------------------ reading
 */

TEST(readers_without_their_arguments)
{
  fixture *f = good_fixture();
  exm_deformer *d = f->deformer;
  exm_deformer_info info;
  double numbers[12];
  float floats[3];
  uint32_t groups[1];
  exm_deformer_info_init(&info);
  CHECK_STATUS(exm_deformer_get_info(NULL, &info), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_deformer_get_info(d, NULL), EXM_ERROR_ARGUMENT, "info");
  CHECK_STATUS(exm_deformer_handle_pose(NULL, 0, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_deformer_handle_pose(d, 0, NULL), EXM_ERROR_ARGUMENT, "targets");
  CHECK_STATUS(exm_deformer_handle_pose(d, 3, numbers), EXM_ERROR_ARGUMENT, "exemplar", "3");
  check_element(EXM_ELEMENT_EXEMPLAR, 3);
  CHECK_STATUS(exm_deformer_positions(NULL, 0, floats), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_deformer_positions(d, 0, NULL), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_deformer_positions(d, -1, floats), EXM_ERROR_ARGUMENT, "thread_count", "-1");
  CHECK_STATUS(exm_deformer_positions_f64(NULL, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_deformer_positions_f64(d, NULL), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_deformer_weights(NULL, floats), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_deformer_weights(d, NULL), EXM_ERROR_ARGUMENT, "weights");
  CHECK_STATUS(exm_amrap_blend_weights(NULL, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_amrap_blend_weights(d, NULL), EXM_ERROR_ARGUMENT, "blend");
  CHECK_STATUS(exm_amrap_blend_average(NULL, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_amrap_blend_average(d, NULL), EXM_ERROR_ARGUMENT, "average");
  CHECK_STATUS(exm_amrap_edge_groups(NULL, groups), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_amrap_edge_groups(d, NULL), EXM_ERROR_ARGUMENT, "groups");
  CHECK_STATUS(exm_amrap_rotations(NULL, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_amrap_rotations(d, NULL), EXM_ERROR_ARGUMENT, "rotations");
  CHECK_STATUS(exm_amrap_exemplar_energies(NULL, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_amrap_exemplar_energies(d, NULL), EXM_ERROR_ARGUMENT, "energies");
  CHECK_STATUS(exm_amrap_exemplar_positions(NULL, 0, numbers), EXM_ERROR_ARGUMENT, "deformer");
  CHECK_STATUS(exm_amrap_exemplar_positions(d, 0, NULL), EXM_ERROR_ARGUMENT, "positions");
  CHECK_STATUS(exm_amrap_exemplar_positions(d, 3, numbers), EXM_ERROR_ARGUMENT, "exemplar", "3");
  check_element(EXM_ELEMENT_EXEMPLAR, 3);
  exm_deformer_destroy(NULL);
  fixture_free(f);
}

/* What the readers say before there was a solve is finite, and not what lay in memory. */
TEST(readers_before_the_first_solve)
{
  fixture *f = good_fixture();
  exm_deformer_info info;
  exm_deformer_info_init(&info);
  CHECK_STATUS(exm_deformer_get_info(f->deformer, &info), EXM_OK);
  size_t const count = info.edge_group_count * 3;
  double *numbers = test_array(9 * count + 3 * f->vertex_count, sizeof *numbers);
  CHECK_STATUS(exm_amrap_blend_weights(f->deformer, numbers), EXM_OK);
  CHECK_STATUS(exm_amrap_blend_average(f->deformer, numbers), EXM_OK);
  CHECK_STATUS(exm_amrap_rotations(f->deformer, numbers), EXM_OK);
  CHECK_STATUS(exm_amrap_exemplar_energies(f->deformer, numbers), EXM_OK);
  CHECK_STATUS(exm_amrap_exemplar_positions(f->deformer, 1, numbers), EXM_OK);
  for (size_t i = 0; i < 9 * count; ++i) {
    CHECK(isfinite(numbers[i]));
  }
  free(numbers);
  fixture_free(f);
}

/* The mesh, the exemplars and the handles may go once it is bound. */
TEST(a_deformer_needs_nothing_of_what_it_was_made_from)
{
  fixture *f = good_fixture();
  double targets[60];
  exm_mesh_destroy(f->reference);
  f->reference = NULL;
  for (size_t i = 0; i < 9 * f->vertex_count; ++i) {
    f->exemplars[i] = NAN;
  }
  memset(f->vertices, 0xff, sizeof f->vertices);
  CHECK_STATUS(exm_deformer_handle_pose(f->deformer, 1, targets), EXM_OK);
  double *positions = fixture_solve(f, targets, NULL, NULL), sum = 0;
  for (size_t i = 0; i < 3 * f->vertex_count; ++i) {
    sum += positions[i];
  }
  CHECK(isfinite(sum));
  free(positions);
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------- progress */

typedef struct progress_log {
  size_t calls, stop_at;
  double last;
  int is_in_order;
} progress_log;

static int watch(void *user, double fraction, const char *stage)
{
  progress_log *log = user;
  log->is_in_order &= fraction >= log->last && fraction <= 1 && stage && stage[0];
  log->last = fraction;
  return ++log->calls == log->stop_at;
}

TEST(binding_can_be_cancelled_wherever_it_reports)
{
  fixture *f = good_fixture();
  exm_handles const handles = fixture_handles(f);
  progress_log whole = {.is_in_order = 1};
  exm_deformer *out = NULL;
  CHECK_STATUS(exm_amrap_create(f->reference, f->exemplars, 3, &handles, NULL, watch, &whole, &out), EXM_OK);
  exm_deformer_destroy(out);
  CHECK(whole.is_in_order && whole.last == 1 && whole.calls >= 5);
  for (size_t stop = 1; stop <= whole.calls; ++stop) {
    progress_log log = {.is_in_order = 1, .stop_at = stop};
    long const before = allocation_balance();
    test_about("call %zu of %zu", stop, whole.calls);
    out = (exm_deformer *)(uintptr_t)1;
    CHECK_STATUS(exm_amrap_create(f->reference, f->exemplars, 3, &handles, NULL, watch, &log, &out),
                 EXM_ERROR_CANCELLED);
    CHECK(out == NULL);
    CHECK(log.calls == stop); /* who has said stop is not asked again */
    CHECK(exm_last_error()[0] != 0);
    CHECK(allocation_balance() == before);
  }
  fixture_free(f);
}

/* ------------------------------------------------------------------------------------------------- degenerate meshes
 */

/* What one ulp of a float is worth, in the units of the mesh. */
static double rounding_of(const fixture *f)
{
  double largest = 0;
  for (size_t i = 0; i < 3 * f->exemplar_count * f->vertex_count; ++i) {
    largest = fmax(largest, fabs((double)f->exemplars[i]));
  }
  return 1.2e-7 * largest;
}

/* One solve: nothing may be infinite, and every handle is met. At an exemplar's own handles nothing is strained; where
 * is_unique, they determine it. */
static void survive_solve(const fixture *f, size_t s, int is_exemplar, int is_unique, const double *targets,
                          const exm_amrap_solve_settings *settings)
{
  exm_solve_report report;
  exm_solve_report_init(&report);
  /* Where handles leave turns open, the way to an unstrained pose is longer than the rounds a solve makes by default.
   */
  exm_amrap_solve_settings own = *settings;
  own.tolerance = is_unique ? own.tolerance : 1e-8;
  double *positions = fixture_solve(f, targets, &own, &report);
  double const distance = fixture_distance_to_exemplar(f, s, positions), rounding = rounding_of(f) / f->diagonal;
  CHECK(isfinite(distance) && distance < 100 * f->diagonal);
  CHECK(isfinite(report.objective) && isfinite(report.optimality_gap) && report.objective >= 0);
  CHECK_NEAR(report.constraint_residual / f->diagonal, 0, 1e-6 + rounding);
  if (is_exemplar) {
    CHECK_NEAR(report.objective / f->diagonal, 0, (is_unique ? 1e-5 : 1e-3) + rounding);
    CHECK(!is_unique || distance / f->diagonal <= 1e-5 + rounding);
  }
  free(positions);
}

/* Bind, come back to every exemplar, and go elsewhere. */
static void survive(fixture *f, int is_unique)
{
  if (fixture_bind(f)) {
    test_random random = {1};
    double *targets = fixture_targets(f);
    for (size_t round = 0; round < 3 * f->exemplar_count; ++round) {
      exm_amrap_solve_settings settings;
      int const is_exemplar = round < f->exemplar_count;
      size_t const s = round % f->exemplar_count;
      exm_amrap_solve_settings_init(&settings);
      settings.start = round % 2 && !is_exemplar ? EXM_START_WARM : EXM_START_STATELESS;
      settings.descent = (int32_t)(round % 3);
      fixture_mix(f, s, (s + 1) % f->exemplar_count, is_exemplar ? 0 : 0.4, is_exemplar ? 0 : 0.1, &random, targets);
      survive_solve(f, s, is_exemplar, is_unique, targets, &settings);
    }
    free(targets);
  }
  fixture_free(f);
}

/* Handles that ask for more than there is are refused, and the sentence names one. */
static int is_refused(const fixture *f)
{
  exm_handles const handles = fixture_handles(f);
  exm_deformer *out = NULL;
  exm_mesh *mesh = NULL;
  CHECK(exm_mesh_create(f->exemplars, f->vertex_count, f->shape.triangles[0], f->shape.triangle_count, &mesh) >= 0);
  exm_status const status = exm_amrap_create(mesh, f->exemplars, f->exemplar_count, &handles, NULL, NULL, NULL, &out);
  CHECK(status >= 0 || (status == EXM_ERROR_NUMERIC && strstr(exm_last_error(), "cannot be held")));
  exm_deformer_destroy(out);
  exm_mesh_destroy(mesh);
  return status < 0;
}

/* A fixture of a specimen, with poses of its size. */
static fixture *specimen(const zoo_mesh *from, size_t exemplar_count, int is_planar)
{
  zoo_mesh copy = *from;
  copy.positions = test_array(from->vertex_count, sizeof *copy.positions);
  copy.triangles = test_array(from->triangle_count, sizeof *copy.triangles);
  memcpy(copy.positions, from->positions, from->vertex_count * sizeof *copy.positions);
  memcpy(copy.triangles, from->triangles, from->triangle_count * sizeof *copy.triangles);
  return fixture_new(copy, exemplar_count, is_planar);
}

/* A handle on the first and one on the last vertex of every part, or one where the part has but one. */
static void hold_every_part(fixture *f, exm_handle_kind first_kind)
{
  uint32_t *part = test_array(f->vertex_count, sizeof *part);
  for (uint32_t v = 0; v < f->vertex_count; ++v) {
    part[v] = v;
  }
  for (size_t pass = 0; pass < f->vertex_count; ++pass) {
    for (size_t t = 0; t < f->shape.triangle_count; ++t) {
      const uint32_t *c = f->shape.triangles[t];
      uint32_t lowest = part[c[0]] < part[c[1]] ? part[c[0]] : part[c[1]];
      lowest = lowest < part[c[2]] ? lowest : part[c[2]];
      part[c[0]] = part[c[1]] = part[c[2]] = lowest;
    }
  }
  for (uint32_t v = 0; v < f->vertex_count; ++v) {
    uint32_t last = v;
    for (uint32_t u = v; u < f->vertex_count; ++u) {
      last = part[u] == v ? u : last;
    }
    if (part[v] == v) {
      fixture_handle(f, first_kind, 1, &v);
      if (last != v) {
        fixture_handle(f, EXM_HANDLE_PINNED, 1, &last);
      }
    }
  }
  free(part);
}

TEST(every_specimen_of_the_zoo)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  for (size_t i = 0; i < count; ++i) {
    for (int kind = 0; kind < 2; ++kind) {
      test_about("%s, %s", all[i].name, kind ? "oriented" : "pinned");
      fixture *f = specimen(&all[i], 3, 0);
      hold_every_part(f, kind ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED);
      if (kind && f->vertex_count <= 5 && is_refused(f)) { /* its frame is all there is */
        fixture_free(f);
      } else {
        survive(f, 0);
      }
    }
  }
}

TEST(exemplars_that_are_the_same)
{
  size_t const counts[] = {2, 3, 9};
  for (size_t i = 0; i < 3; ++i) {
    test_about("%zu times the same", counts[i]);
    fixture *f = fixture_bar(counts[i]);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    for (size_t s = 1; s < counts[i]; ++s) {
      memcpy(f->exemplars + s * 3 * f->vertex_count, f->exemplars, 3 * f->vertex_count * sizeof(float));
    }
    survive(f, 1);
  }
}

/* Exemplars that differ by a reflection, by half a turn, by a rotation only. */
TEST(exemplars_that_are_moved_copies)
{
  double half[3][3], turned[3][3];
  double const mirror[3][3] = {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  fixture_rotation(0, 0, 1, M_PI, half);
  fixture_rotation(1, 2, 3, 2, turned);
  const double(*const matrices[])[3] = {mirror, (const double(*)[3])half, (const double(*)[3])turned};
  for (int which = 0; which < 3; ++which) {
    for (int kind = 0; kind < 2; ++kind) {
      test_about("%s, %s",
                 which == 0   ? "mirrored"
                 : which == 1 ? "half a turn"
                              : "turned",
                 kind ? "oriented" : "pinned");
      fixture *f = fixture_bar(2);
      fixture_usual_handles(f, kind ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, kind);
      for (size_t v = 0; v < f->vertex_count; ++v) {
        for (size_t k = 0; k < 3; ++k) {
          double moved = 0;
          for (size_t j = 0; j < 3; ++j) {
            moved += matrices[which][k][j] * (double)f->exemplars[3 * v + j];
          }
          f->exemplars[(f->vertex_count + v) * 3 + k] = (float)moved;
        }
      }
      survive(f, 1);
    }
  }
}

/* An exemplar that is flat, or a point, where the reference has volume. */
TEST(exemplars_that_collapse)
{
  for (int flat = 1; flat <= 3; ++flat) {
    test_about("%d dimensions less", flat);
    fixture *f = fixture_bar(3);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    for (size_t v = 0; v < f->vertex_count; ++v) {
      for (int k = 0; k < flat; ++k) {
        f->exemplars[(2 * f->vertex_count + v) * 3 + (size_t)(2 - k)] = 0;
      }
    }
    survive(f, 1);
  }
}

/* The same, so that the dictionary has fewer atoms than the handles have constraints. */
TEST(more_constraints_than_atoms)
{
  fixture *f = fixture_new(zoo_bar(20, 3), 9, 0); /* more vertices than atoms, or those would be left out */
  fixture_usual_handles(f, EXM_HANDLE_ORIENTED, 1);
  for (size_t i = 0; i < f->vertex_count; ++i) {
    for (size_t s = 1; s < 9; ++s) {
      memcpy(f->exemplars + (s * f->vertex_count + i) * 3, f->exemplars + 3 * i, 3 * sizeof(float));
      f->exemplars[(s * f->vertex_count + i) * 3 + 2] = 0;
    }
  }
  exm_handles const handles = fixture_handles(f);
  exm_deformer *out = NULL;
  CHECK(exm_mesh_create(f->exemplars, f->vertex_count, f->shape.triangles[0], f->shape.triangle_count, &f->reference) >=
        0);
  CHECK_STATUS(exm_amrap_create(f->reference, f->exemplars + 3 * f->vertex_count, 8, &handles, NULL, NULL, NULL, &out),
               EXM_ERROR_NUMERIC, "handle", "cannot be held");
  CHECK(out == NULL);
  fixture_free(f);
}

/* Everything lies in a plane that handles are asked to leave: there is nothing to turn an oriented handle with, and a
 * refusal has to say so. The number of exemplars changes how the dictionary is kept. */
TEST(oriented_handles_of_exemplars_without_volume)
{
  size_t const counts[] = {1, 2, 8, 12};
  for (size_t i = 0; i < 4; ++i) {
    fixture *f = fixture_bar(counts[i] + 1);
    fixture_usual_handles(f, EXM_HANDLE_ORIENTED, 1);
    exm_handles const handles = fixture_handles(f);
    exm_deformer *out = NULL;
    test_about("%zu flat exemplars", counts[i]);
    CHECK(exm_mesh_create(f->exemplars, f->vertex_count, f->shape.triangles[0], f->shape.triangle_count,
                          &f->reference) >= 0);
    for (size_t v = 0; v < counts[i] * f->vertex_count; ++v) {
      f->exemplars[(f->vertex_count + v) * 3 + 2] = 0;
    }
    exm_status const status =
        exm_amrap_create(f->reference, f->exemplars + 3 * f->vertex_count, counts[i], &handles, NULL, NULL, NULL, &out);
    if (status < 0) {
      CHECK(status == EXM_ERROR_NUMERIC && strstr(exm_last_error(), "handle"));
    } else {
      exm_deformer_destroy(out);
    }
    fixture_free(f);
  }
}

TEST(handles_in_a_line)
{
  for (int kind = 0; kind < 2; ++kind) {
    test_about(kind ? "one of them oriented" : "all pinned");
    fixture *f = fixture_bar(3);
    for (int i = 0; i < 4; ++i) {
      fixture_handle_near(f, kind && i == 1 ? EXM_HANDLE_ORIENTED : EXM_HANDLE_PINNED, 0.3 * i, 0, 0, 0);
    }
    survive(f, kind);
  }
}

TEST(handles_that_hold_every_vertex)
{
  fixture *f = fixture_bar(3);
  uint32_t vertices[FIXTURE_HELD];
  for (uint32_t v = 0; v < f->vertex_count; ++v) {
    vertices[v] = v;
  }
  size_t const half = f->vertex_count / 2;
  fixture_handle(f, EXM_HANDLE_ORIENTED, half, vertices);
  fixture_handle(f, EXM_HANDLE_PINNED, f->vertex_count - half, vertices + half);
  survive(f, 1);
}

/* Each corner of the only triangle is a handle. */
TEST(a_triangle_held_by_its_corners)
{
  for (int kind = 0; kind < 3; ++kind) {
    test_about("kind %d", kind);
    fixture *f = specimen(zoo_find("triangle"), 3, 1);
    for (uint32_t v = 0; v < 3; ++v) {
      fixture_handle(f, v == 2 ? (exm_handle_kind)kind : EXM_HANDLE_PINNED, 1, &v);
    }
    if (kind == EXM_HANDLE_ORIENTED) {
      CHECK(is_refused(f)); /* three corners have no more than three positions */
      fixture_free(f);
    } else {
      survive(f, kind == EXM_HANDLE_PINNED);
    }
  }
}

TEST(far_from_the_origin_and_in_odd_units)
{
  double const offsets[] = {0, 0, 1e4}, scales[] = {1e15, 1e-15, 1};
  for (int i = 0; i < 3; ++i) {
    double const scale = scales[i], matrix[3][3] = {{scale, 0, 0}, {0, scale, 0}, {0, 0, scale}};
    double const offset[3] = {offsets[i], -offsets[i], 0};
    test_about("scale %g, offset %g", scale, offsets[i]);
    fixture *f = fixture_bar(3);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    fixture_move(f, matrix, offset);
    survive(f, 1);
  }
}

/* As many groups as vertices, or one. */
TEST(any_number_of_edge_groups)
{
  size_t const counts[] = {1, 2, 40, 98};
  for (size_t i = 0; i < 4; ++i) {
    test_about("%zu groups", counts[i]);
    fixture *f = fixture_bar(3);
    fixture_usual_handles(f, EXM_HANDLE_PINNED, 0);
    f->settings.edge_group_count = counts[i] < f->vertex_count ? counts[i] : f->vertex_count;
    survive(f, 1);
  }
}
