/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What registration refuses and warns of, what a failure leaves behind, and every allocation failed once. Whether poses
 * are found is seen in tests/python. */
#include "allocation.h"
#include "harness.h"
#include "zoo.h"

enum { LANDMARKS = 6 };

typedef struct body {
  zoo_mesh bar;
  exm_mesh *mesh;
  float *exemplars; /* [2][V][3] */
  exm_registration *registration;
  exm_scan *scan; /* of the second exemplar */
  uint32_t vertices[LANDMARKS];
  double points[LANDMARKS][3];
} body;

/** The bar, and bent: isometric along its axis. */
static void body_shapes(body *b)
{
  size_t const V = b->bar.vertex_count;
  b->exemplars = test_array(2 * V * 3, sizeof(float));
  for (size_t v = 0; v < V; v++) {
    const float *p = b->bar.positions[v];
    float const angle = 0.12F * p[0], radius = 1 / 0.12F - p[1];
    memcpy(b->exemplars + 3 * v, p, 3 * sizeof(float));
    b->exemplars[3 * (V + v)] = radius * sinf(angle);
    b->exemplars[3 * (V + v) + 1] = 1 / 0.12F - radius * cosf(angle);
    b->exemplars[3 * (V + v) + 2] = p[2];
  }
}

static exm_status body_scan(const body *b, exm_scan **out)
{
  exm_scan_settings settings;
  exm_scan_settings_init(&settings);
  settings.triangles = (const uint32_t *)b->bar.triangles;
  settings.triangle_count = b->bar.triangle_count;
  return exm_scan_create(b->exemplars + 3 * b->bar.vertex_count, b->bar.vertex_count, &settings, out);
}

static exm_status body_register(const body *b, exm_registration **out)
{
  exm_blended_bind_settings settings;
  exm_blended_bind_settings_init(&settings);
  settings.eigenfunction_count = 5;
  settings.start_eigenfunction_count = 3;
  settings.cluster_count = 6;
  return exm_registration_create(b->mesh, b->exemplars, 2, &settings, NULL, NULL, out);
}

static body body_create(void)
{
  body b = {.bar = zoo_bar(10, 2)};
  size_t const V = b.bar.vertex_count;
  body_shapes(&b);
  b.mesh = zoo_create(&b.bar);
  CHECK(body_register(&b, &b.registration) >= 0);
  CHECK(body_scan(&b, &b.scan) == EXM_OK);
  for (size_t i = 0; i < LANDMARKS; i++) {
    b.vertices[i] = (uint32_t)(i * (V - 1) / (LANDMARKS - 1));
    for (size_t k = 0; k < 3; k++) {
      b.points[i][k] = (double)b.exemplars[3 * (V + b.vertices[i]) + k];
    }
  }
  return b;
}

static void body_destroy(body *b)
{
  exm_registration_destroy(b->registration);
  exm_scan_destroy(b->scan);
  exm_mesh_destroy(b->mesh);
  free(b->exemplars);
  zoo_free(&b->bar);
}

static exm_landmarks landmarks_of(const body *b, size_t count)
{
  return (exm_landmarks){.count = count, .vertices = b->vertices, .points = &b->points[0][0]};
}

static exm_status fit(const body *b, const exm_landmarks *l)
{
  return exm_registration_fit(b->registration, b->scan, l, NULL, NULL, NULL, NULL);
}

TEST(an_exemplar_is_found_and_everything_corresponds)
{
  body b = body_create();
  size_t const V = b.bar.vertex_count;
  exm_landmarks const l = landmarks_of(&b, LANDMARKS);
  exm_registration_fit_report report;
  exm_registration_info info;
  exm_registration_fit_report_init(&report);
  exm_registration_info_init(&info);
  float *positions = test_array(3 * V, sizeof(float));
  uint32_t *points = test_array(V, sizeof *points);
  CHECK_STATUS(exm_registration_fit(b.registration, b.scan, &l, NULL, NULL, NULL, &report), EXM_OK, "");
  CHECK(report.quality > 0.99);
  CHECK(report.seen > 0.9);
  CHECK(report.rejected_count == 0);
  CHECK_NEAR(report.scale, 1, 0.02);
  CHECK_STATUS(exm_registration_positions(b.registration, positions), EXM_OK, "");
  CHECK_STATUS(exm_registration_vertex_matches(b.registration, points, NULL), EXM_OK, "");
  CHECK_STATUS(exm_registration_get_info(b.registration, &info), EXM_OK, "");
  CHECK(info.point_count == V && info.landmark_count == LANDMARKS && info.exemplar_count == 2);
  for (size_t i = 0; i < 3 * V; i++) {
    CHECK_NEAR((double)positions[i], (double)b.exemplars[3 * V + i], 0.15);
  }
  free(positions);
  free(points);
  body_destroy(&b);
}

TEST(landmarks_that_are_wrong_are_refused)
{
  body b = body_create();
  exm_landmarks l = landmarks_of(&b, 2);
  double const weights[LANDMARKS] = {1, 1, 0, 0, 0, 0}, negative[LANDMARKS] = {1, 1, -2, 1, 1, 1};
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_UNCONSTRAINED, "2 landmarks", "3");
  CHECK_STATUS(fit(&b, NULL), EXM_ERROR_UNCONSTRAINED, "0 landmarks");
  l = landmarks_of(&b, LANDMARKS);
  l.weights = weights;
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_UNCONSTRAINED, "2 landmarks");
  l.weights = negative;
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_ARGUMENT, "landmark 2", "-2");
  l.weights = NULL;
  b.vertices[4] = 4000000;
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_ARGUMENT, "landmark 4", "4000000");
  b.vertices[4] = b.vertices[1];
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_ARGUMENT, "landmarks 1 and 4");
  b.vertices[4]++;
  b.points[3][1] = NAN;
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_ARGUMENT, "landmark 3", "y coordinate");
  b.points[3][1] = 1000;
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_ARGUMENT, "landmark 3", "away from the scan");
  for (size_t i = 0; i < LANDMARKS; i++) {
    for (size_t k = 0; k < 3; k++) {
      b.points[i][k] = k == 0 ? (double)i : 0;
    }
  }
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_UNCONSTRAINED, "on one line");
  l.vertices = NULL;
  CHECK_STATUS(fit(&b, &l), EXM_ERROR_ARGUMENT, "landmarks->vertices");
  float *positions = test_array(3 * b.bar.vertex_count, sizeof(float));
  CHECK_STATUS(exm_registration_positions(b.registration, positions), EXM_OK, "");
  CHECK(memcmp(positions, b.bar.positions, 3 * b.bar.vertex_count * sizeof(float)) == 0);
  CHECK_STATUS(exm_registration_vertex_matches(b.registration, NULL, NULL), EXM_ERROR_ARGUMENT, "not fitted");
  free(positions);
  body_destroy(&b);
}

TEST(settings_out_of_range_are_refused)
{
  body b = body_create();
  exm_landmarks const l = landmarks_of(&b, LANDMARKS);
  const struct {
    const char *name;
    size_t at;
    double value;
  } numbers[] = {{"known_scale", offsetof(exm_registration_fit_settings, known_scale), 0},
                 {"disc_radius", offsetof(exm_registration_fit_settings, disc_radius), -1},
                 {"reach", offsetof(exm_registration_fit_settings, reach), NAN},
                 {"max_angle", offsetof(exm_registration_fit_settings, max_angle), 181},
                 {"tightness", offsetof(exm_registration_fit_settings, tightness), 0},
                 {"landmark_share", offsetof(exm_registration_fit_settings, landmark_share), -0.5},
                 {"detail", offsetof(exm_registration_fit_settings, detail), INFINITY}};
  const struct {
    const char *name;
    size_t at;
    int32_t value;
  } integers[] = {{"scale", offsetof(exm_registration_fit_settings, scale), 2},
                  {"finish", offsetof(exm_registration_fit_settings, finish), -1},
                  {"start", offsetof(exm_registration_fit_settings, start), 7},
                  {"iterations", offsetof(exm_registration_fit_settings, iterations), -1},
                  {"reject_landmarks", offsetof(exm_registration_fit_settings, reject_landmarks), 3}};
  exm_registration_fit_settings settings;
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    exm_registration_fit_settings_init(&settings);
    memcpy((char *)&settings + numbers[i].at, &numbers[i].value, sizeof numbers[i].value);
    CHECK_STATUS(exm_registration_fit(b.registration, b.scan, &l, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT,
                 numbers[i].name);
  }
  for (size_t i = 0; i < sizeof integers / sizeof *integers; i++) {
    exm_registration_fit_settings_init(&settings);
    memcpy((char *)&settings + integers[i].at, &integers[i].value, sizeof integers[i].value);
    CHECK_STATUS(exm_registration_fit(b.registration, b.scan, &l, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT,
                 integers[i].name);
  }
  exm_registration_fit_settings_init(&settings);
  settings.disc_count = 0;
  CHECK_STATUS(exm_registration_fit(b.registration, b.scan, &l, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT,
               "disc_count");
  exm_registration_fit_settings_init(&settings);
  settings.sample_count = 0;
  CHECK_STATUS(exm_registration_fit(b.registration, b.scan, &l, &settings, NULL, NULL, NULL), EXM_ERROR_ARGUMENT,
               "sample_count");
  CHECK_STATUS(exm_registration_fit(NULL, b.scan, &l, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "registration");
  CHECK_STATUS(exm_registration_fit(b.registration, NULL, &l, NULL, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "scan");
  body_destroy(&b);
}

TEST(scans_that_are_wrong_are_refused)
{
  float points[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  uint32_t triangles[2][3] = {{0, 1, 2}, {1, 2, 9}};
  exm_scan_settings settings;
  exm_scan_settings_init(&settings);
  exm_scan *scan = (exm_scan *)&settings;
  CHECK_STATUS(exm_scan_create(&points[0][0], 3, NULL, &scan), EXM_ERROR_ARGUMENT, "3 points");
  CHECK(scan == NULL);
  CHECK_STATUS(exm_scan_create(&points[0][0], 0, NULL, &scan), EXM_ERROR_ARGUMENT, "0 points");
  CHECK_STATUS(exm_scan_create(NULL, 5, NULL, &scan), EXM_ERROR_ARGUMENT, "points is NULL");
  settings.triangles = &triangles[0][0];
  settings.triangle_count = 2;
  CHECK_STATUS(exm_scan_create(&points[0][0], 5, &settings, &scan), EXM_ERROR_TOPOLOGY, "triangle 1", "point 9");
  settings.triangles = NULL;
  CHECK_STATUS(exm_scan_create(&points[0][0], 5, &settings, &scan), EXM_ERROR_ARGUMENT, "settings.triangles");
  exm_scan_settings_init(&settings);
  settings.neighbor_count = 1;
  CHECK_STATUS(exm_scan_create(&points[0][0], 5, &settings, &scan), EXM_ERROR_ARGUMENT, "neighbor_count is 1");
  points[4][2] = NAN;
  CHECK_STATUS(exm_scan_create(&points[0][0], 5, NULL, &scan), EXM_ERROR_ARGUMENT, "z coordinate of point 4");
  memset(points, 0, sizeof points);
  CHECK_STATUS(exm_scan_create(&points[0][0], 5, NULL, &scan), EXM_ERROR_ARGUMENT, "the same");
  CHECK_STATUS(exm_scan_read("nowhere.ply", &scan), EXM_ERROR_IO, "nowhere.ply");
  exm_scan_destroy(NULL);
  exm_registration_destroy(NULL);
}

static int stop_at(void *user, double fraction, const char *stage)
{
  (void)stage;
  return fraction >= *(const double *)user;
}

TEST(a_fit_that_is_cancelled_leaves_the_last_one)
{
  body b = body_create();
  size_t const V = b.bar.vertex_count;
  exm_landmarks const l = landmarks_of(&b, LANDMARKS);
  float *before = test_array(3 * V, sizeof(float)), *after = test_array(3 * V, sizeof(float));
  CHECK(fit(&b, &l) == EXM_OK);
  CHECK(exm_registration_positions(b.registration, before) == EXM_OK);
  b.points[0][1] += 0.3;
  for (double at = 0.05; at < 1; at += 0.3) {
    CHECK_STATUS(exm_registration_fit(b.registration, b.scan, &l, NULL, stop_at, &at, NULL), EXM_ERROR_CANCELLED,
                 "cancelled");
    CHECK(exm_registration_positions(b.registration, after) == EXM_OK);
    CHECK(memcmp(before, after, 3 * V * sizeof(float)) == 0);
  }
  free(before);
  free(after);
  body_destroy(&b);
}

TEST(a_search_says_what_it_cannot_do)
{
  body b = body_create();
  exm_landmarks l = landmarks_of(&b, LANDMARKS);
  int32_t const groups[LANDMARKS] = {-1, 0, 0, 0, -1, -1};
  uint32_t order[LANDMARKS];
  exm_registration_match_report report;
  exm_registration_match_report_init(&report);
  CHECK(exm_registration_match(b.registration, &l, groups, NULL, NULL, NULL, order, NULL, &report) >= 0);
  CHECK(report.permissible == 6);
  for (uint32_t i = 0; i < LANDMARKS; i++) {
    CHECK(order[i] == i);
  }
  CHECK_STATUS(exm_registration_match(b.registration, &l, NULL, NULL, NULL, NULL, order, NULL, NULL),
               EXM_ERROR_ARGUMENT, "groups");
  CHECK_STATUS(exm_registration_match(b.registration, &l, groups, NULL, NULL, NULL, NULL, NULL, NULL),
               EXM_ERROR_ARGUMENT, "order");
  l.count = 3;
  CHECK_STATUS(exm_registration_match(b.registration, &l, groups, NULL, NULL, NULL, order, NULL, NULL),
               EXM_ERROR_UNCONSTRAINED, "3 landmarks", "4");
  body_destroy(&b);
}

static exm_status fit_once(void *context)
{
  const body *b = context;
  exm_registration *registration = NULL;
  exm_scan *scan = NULL;
  exm_landmarks const l = landmarks_of(b, LANDMARKS);
  exm_registration_fit_settings settings;
  exm_registration_fit_settings_init(&settings);
  settings.iterations = 2;
  settings.sample_count = 60;
  exm_status status = body_register(b, &registration);
  if (status >= 0) {
    status = body_scan(b, &scan);
  }
  if (status >= 0) {
    status = exm_registration_fit(registration, scan, &l, &settings, NULL, NULL, NULL);
  }
  exm_registration_destroy(registration);
  exm_scan_destroy(scan);
  return status;
}

TEST(every_allocation_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  body b = body_create();
  CHECK(for_each_failed_allocation(fit_once, &b) > 100);
  body_destroy(&b);
}
