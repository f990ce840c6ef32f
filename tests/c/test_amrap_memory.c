/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every allocation of binding, solving and reading fails once. */
#include "allocation.h"
#include "amrap_fixture.h"

/* OpenBLAS packs small matrices into memory that it does not check for being there, so that its products crash where a
 * status should come out, and nobody who calls them can help it. Here a product that asks for no memory stands in
 * front of its own, also of those that LAPACK asks for. */
__attribute__((visibility("default"), used)) void dgemm_(const char *ta, const char *tb, const int *m, const int *n,
                                                         const int *k, const double *alpha, const double *a,
                                                         const int *lda, const double *b, const int *ldb,
                                                         const double *beta, double *c, const int *ldc);

void dgemm_(const char *ta, const char *tb, const int *m, const int *n, const int *k, const double *alpha,
            const double *a, const int *lda, const double *b, const int *ldb, const double *beta, double *c,
            const int *ldc)
{
  int const is_a = *ta == 'N' || *ta == 'n', is_b = *tb == 'N' || *tb == 'n';
  for (int i = 0; i < *m; ++i) {
    for (int j = 0; j < *n; ++j) {
      double sum = 0;
      for (int p = 0; p < *k; ++p) {
        sum += a[is_a ? i + p * *lda : p + i * *lda] * b[is_b ? p + j * *ldb : j + p * *ldb];
      }
      c[i + j * *ldc] = *alpha * sum + (*beta != 0 ? *beta * c[i + j * *ldc] : 0);
    }
  }
}

typedef struct memory_case {
  fixture *f;
  double *targets, *wide;
  float *narrow;
} memory_case;

static exm_status bind_in_little_memory(void *context)
{
  memory_case *c = context;
  exm_handles const handles = fixture_handles(c->f);
  exm_deformer *out = (exm_deformer *)(uintptr_t)1;
  exm_status const status = exm_amrap_create(c->f->reference, c->f->exemplars, c->f->exemplar_count, &handles,
                                             &c->f->settings, NULL, NULL, &out);
  CHECK((status < 0) == (out == NULL));
  exm_deformer_destroy(out);
  return status;
}

static exm_status solve_in_little_memory(void *context)
{
  memory_case *c = context;
  exm_amrap_solve_settings settings;
  exm_amrap_solve_settings_init(&settings);
  exm_status status = EXM_OK;
  for (int32_t descent = 0; descent < 3 && status >= 0; ++descent) {
    settings.descent = descent;
    settings.tolerance = descent == 1 ? 1e-3 : 0;
    status = exm_amrap_solve(c->f->deformer, c->targets, &settings, NULL);
  }
  if (status >= 0) {
    status = exm_deformer_positions_f64(c->f->deformer, c->wide);
  }
  if (status >= 0) {
    status = exm_deformer_positions(c->f->deformer, 2, c->narrow);
  }
  return status < 0 ? status : exm_amrap_exemplar_positions(c->f->deformer, 1, c->wide);
}

static void check_little_memory(fixture *f)
{
  if (fixture_bind(f)) {
    memory_case c = {.f = f, .targets = fixture_targets(f)};
    test_random random = {1};
    c.wide = test_array(3 * f->vertex_count, sizeof(double));
    c.narrow = test_array(3 * f->vertex_count, sizeof(float));
    fixture_mix(f, 0, 1, 0.4, 0.1, &random, c.targets);
    CHECK(for_each_failed_allocation(bind_in_little_memory, &c) > 50);
    for_each_failed_allocation(solve_in_little_memory, &c); /* which may well ask for none */
    double *positions = fixture_solve(f, c.targets, NULL, NULL);
    CHECK(isfinite(fixture_distance_to_exemplar(f, 0, positions)));
    free(positions);
    free(c.targets);
    free(c.wide);
    free(c.narrow);
  }
  fixture_free(f);
}

TEST(every_allocation_may_fail)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  test_about("a bar");
  fixture *f = fixture_bar(2);
  fixture_handle_near(f, EXM_HANDLE_ORIENTED, 0, 0, 0, 1);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 1, 0.1, 0.1, 0);
  fixture_handle_near(f, EXM_HANDLE_FREE, 0.5, 0.1, 0.1, 0);
  check_little_memory(f);
  test_about("a grid with many exemplars"); /* a dictionary of mixtures, a working set of blend weights */
  f = fixture_new(zoo_grid(6, 4, 2, 1), 13, 1);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 0, 0, 0, 0);
  fixture_handle_near(f, EXM_HANDLE_PINNED, 1, 0.4, 0, 0);
  fixture_handle_near(f, EXM_HANDLE_FREE, 0.5, 0.1, 0, 0);
  check_little_memory(f);
}
