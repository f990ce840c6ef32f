/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Skinning weights out of poses: a bar that two bones moved is found out; laws of weights; refusals. */
#include "allocation.h"
#include "blended_fixture.h"

typedef struct result {
  float *weights;
  double *transforms;
  uint32_t *labels;
  exm_decompose_report report;
} result;

static result decompose(const bent_bar *bar, const float *poses, size_t pose_count, size_t bones, exm_status *status)
{
  size_t const V = bar->shape.vertex_count;
  exm_decompose_settings settings;
  exm_decompose_settings_init(&settings);
  settings.bone_count = bones;
  size_t const capacity = bones ? bones : settings.bone_limit;
  result r = {.weights = test_array(capacity * V, sizeof(float)),
              .transforms = test_array(pose_count * capacity * 12, sizeof(double)),
              .labels = test_array(V, sizeof(uint32_t))};
  exm_decompose_report_init(&r.report);
  *status = exm_weights_decompose(bar->mesh, poses, pose_count, &settings, NULL, NULL, capacity, r.weights,
                                  r.transforms, r.labels, &r.report);
  return r;
}

static void release(result *r)
{
  free(r->weights);
  free(r->transforms);
  free(r->labels);
}

static void check_weights(const bent_bar *bar, const result *r, size_t capacity)
{
  size_t const V = bar->shape.vertex_count;
  for (size_t v = 0; v < V; v++) {
    double sum = 0;
    size_t used = 0, best = 0;
    for (size_t b = 0; b < capacity; b++) {
      float const w = r->weights[b * V + v];
      CHECK(w >= 0 && (w == 0 || b < r->report.bone_count));
      sum += (double)w;
      used += w > 0;
      best = w > r->weights[best * V + v] ? b : best;
    }
    CHECK_NEAR(sum, 1, 1e-5);
    CHECK(used >= 1 && used <= 4);
    CHECK_NEAR((double)r->weights[r->labels[v] * V + v], (double)r->weights[best * V + v], 1e-6);
  }
}

/** The error of weights and transforms as they were written, by skinning with them. */
static double skinned_error(const bent_bar *bar, const float *poses, size_t pose_count, const result *r,
                            size_t capacity)
{
  size_t const V = bar->shape.vertex_count;
  double sum = 0, mass = 0;
  double *areas = test_array(V, sizeof(double));
  for (size_t t = 0; t < bar->shape.triangle_count; t++) {
    const uint32_t *c = bar->shape.triangles[t];
    const float *a = bar->exemplars + 3 * c[0], *b = bar->exemplars + 3 * c[1], *d = bar->exemplars + 3 * c[2];
    double u[3], w[3], n[3];
    for (int k = 0; k < 3; k++) {
      u[k] = (double)b[k] - (double)a[k];
      w[k] = (double)d[k] - (double)a[k];
    }
    for (int k = 0; k < 3; k++) {
      n[k] = u[(k + 1) % 3] * w[(k + 2) % 3] - u[(k + 2) % 3] * w[(k + 1) % 3];
    }
    for (int i = 0; i < 3; i++) {
      areas[c[i]] += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 6;
    }
  }
  for (size_t v = 0; v < V; v++) {
    mass += areas[v];
    for (size_t s = 0; s < pose_count; s++) {
      for (size_t k = 0; k < 3; k++) {
        double value = 0;
        for (size_t b = 0; b < r->report.bone_count; b++) {
          const double *row = r->transforms + (s * capacity + b) * 12 + 4 * k;
          const float *x = bar->exemplars + 3 * v;
          value += (double)r->weights[b * V + v] *
                   (row[0] * (double)x[0] + row[1] * (double)x[1] + row[2] * (double)x[2] + row[3]);
        }
        double const miss = value - (double)poses[(s * V + v) * 3 + k];
        sum += areas[v] * miss * miss;
      }
    }
  }
  free(areas);
  return sqrt(sum / (mass * (double)pose_count));
}

TEST(two_bones_are_found_out)
{
  enum { POSES = 3 };
  bent_bar bar = bar_make();
  size_t const V = bar.shape.vertex_count;
  float *poses = test_array(POSES * V * 3, sizeof(float));
  exm_status status;
  for (size_t s = 0; s < POSES; s++) { /* the far half turns about a hinge, its weight rises over two cells */
    double const angle = 0.5 * (double)s - 0.4, c = cos(angle), n = sin(angle);
    for (size_t v = 0; v < V; v++) {
      const float *x = bar.exemplars + 3 * v;
      double const w = fmin(fmax(((double)x[0] - 4) / 2, 0), 1), dx = (double)x[0] - 5, y = (double)x[1];
      double const turned[3] = {5 + c * dx - n * y, n * dx + c * y, (double)x[2]};
      for (size_t k = 0; k < 3; k++) {
        poses[(s * V + v) * 3 + k] = (float)((1 - w) * (double)x[k] + w * turned[k]);
      }
    }
  }
  result r = decompose(&bar, poses, POSES, 2, &status);
  CHECK(status == EXM_OK && r.report.bone_count == 2);
  CHECK_NEAR(r.report.error / bar.diagonal, 0, 1e-4);
  CHECK(r.report.error < 0.1 * r.report.begin_error);
  check_weights(&bar, &r, 2);
  CHECK_NEAR(skinned_error(&bar, poses, POSES, &r, 2), r.report.error, 1e-5);
  release(&r);
  free(poses);
  bar_free(&bar);
}

TEST(more_bones_mean_less_error_and_a_number_is_chosen)
{
  bent_bar bar = bar_make();
  double before = INFINITY;
  exm_status status;
  for (size_t bones = 1; bones <= 8; bones *= 2) {
    result r = decompose(&bar, bar.exemplars, BAR_SHAPES, bones, &status);
    CHECK(status == EXM_OK && r.report.bone_count <= bones);
    CHECK(r.report.error <= r.report.begin_error * (1 + 1e-9));
    CHECK(r.report.error < before);
    check_weights(&bar, &r, bones);
    before = r.report.error;
    release(&r);
  }
  result r = decompose(&bar, bar.exemplars, BAR_SHAPES, 0, &status);
  CHECK(status == EXM_OK && r.report.bone_count > 2 && r.report.bone_count <= 40);
  release(&r);
  r = decompose(&bar, bar.exemplars, 1, 0, &status); /* the rest pose alone: nothing moves */
  CHECK(status == EXM_OK && r.report.bone_count == 1);
  CHECK_NEAR(r.report.error, 0, 1e-6);
  release(&r);
  bar_free(&bar);
}

TEST(arguments)
{
  bent_bar bar = bar_make();
  float *weights = test_array(2 * bar.shape.vertex_count, sizeof(float));
  exm_decompose_settings settings;
  exm_decompose_settings_init(&settings);
#define REFUSED(field, value, ...)                                                                                     \
  do {                                                                                                                 \
    exm_decompose_settings_init(&settings);                                                                            \
    settings.bone_count = 2;                                                                                           \
    settings.field = (value);                                                                                          \
    CHECK_STATUS(exm_weights_decompose(bar.mesh, bar.exemplars, BAR_SHAPES, &settings, NULL, NULL, 2, weights, NULL,   \
                                       NULL, NULL),                                                                    \
                 EXM_ERROR_ARGUMENT, __VA_ARGS__);                                                                     \
  } while (0)
  REFUSED(bone_count, 3, "capacity is 2", "3 bones");
  REFUSED(bone_count, 0, "capacity is 2", "40 bones");
  REFUSED(bone_count, 1000000, "bone_count is 1000000");
  REFUSED(tolerance, -1, "tolerance is -1");
  REFUSED(influences, 0, "influences is 0");
  REFUSED(influences, 9, "influences is 9");
  REFUSED(iterations, -1, "iterations is -1");
  settings.iterations = 1;
  CHECK_STATUS(exm_weights_decompose(NULL, bar.exemplars, 1, &settings, NULL, NULL, 2, weights, NULL, NULL, NULL),
               EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_weights_decompose(bar.mesh, bar.exemplars, 0, &settings, NULL, NULL, 2, weights, NULL, NULL, NULL),
               EXM_ERROR_ARGUMENT, "exemplar_count is 0");
  CHECK_STATUS(exm_weights_decompose(bar.mesh, bar.exemplars, 1, &settings, NULL, NULL, 2, NULL, NULL, NULL, NULL),
               EXM_ERROR_ARGUMENT, "weights is NULL");
  free(weights);
  bar_free(&bar);
}

typedef struct job {
  const bent_bar *bar;
  float *weights;
} job;

static exm_status run(void *context)
{
  const job *j = context;
  exm_decompose_settings settings;
  exm_decompose_settings_init(&settings);
  settings.bone_count = 4;
  return exm_weights_decompose(j->bar->mesh, j->bar->exemplars, BAR_SHAPES, &settings, NULL, NULL, 4, j->weights, NULL,
                               NULL, NULL);
}

TEST(every_allocation_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail in this build");
  }
  bent_bar bar = bar_make();
  job j = {.bar = &bar, .weights = test_array(4 * bar.shape.vertex_count, sizeof(float))};
  CHECK(for_each_failed_allocation(run, &j) > 8);
  free(j.weights);
  bar_free(&bar);
}
