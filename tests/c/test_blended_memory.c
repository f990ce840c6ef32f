/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every allocation fails once: of a bind, and of what changes constraints and interpolates. */
#include "allocation.h"
#include "blended_fixture.h"

static exm_status bind_and_destroy(void *context)
{
  bent_bar *bar = context;
  exm_deformer *deformer = NULL;
  exm_blended_bind_settings settings;
  exm_blended_bind_settings_init(&settings);
  settings.dictionary = EXM_DICTIONARY_SKELETON;
  exm_status const status =
      exm_blended_create(bar->mesh, bar->exemplars, BAR_SHAPES, bar_handles(bar), &settings, NULL, NULL, &deformer);
  exm_deformer_destroy(deformer);
  return status;
}

TEST(every_allocation_of_a_bind_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail in this build");
  }
  bent_bar bar = bar_make();
  CHECK(for_each_failed_allocation(bind_and_destroy, &bar) > 50);
  bar_free(&bar);
}

typedef struct bound {
  exm_deformer *deformer;
  exm_rows rows;
  double targets[BAR_HANDLES * 12], row_target[3];
  double *key;
} bound;

/* Adds a row, solves, interpolates and takes the row away again. */
static exm_status change_and_solve(void *context)
{
  bound *b = context;
  exm_blended_solve_settings settings;
  exm_blended_solve_settings_init(&settings);
  settings.row_targets = b->row_target;
  settings.begin = EXM_BEGIN_PLAIN;
  exm_status status = exm_blended_add_rows(b->deformer, &b->rows);
  if (status < 0) {
    return status;
  }
  status = exm_blended_solve(b->deformer, b->targets, &settings, NULL);
  if (status >= 0) {
    status = exm_blended_get_key(b->deformer, b->key);
  }
  double const time = 0;
  if (status >= 0) {
    status = exm_blended_interpolate(b->deformer, b->key, &time, 1, 0);
  }
  /* Removing allocates, too: where that fails it is tried again, as a caller would. */
  exm_status const removed = exm_blended_remove_rows(b->deformer, 0, 1);
  if (removed < 0) {
    CHECK(exm_blended_remove_rows(b->deformer, 0, 1) == EXM_OK);
    return removed;
  }
  return status < 0 ? status : EXM_OK;
}

TEST(every_allocation_of_a_change_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail in this build");
  }
  static size_t const offsets[2] = {0, 1};
  static double const one = 1;
  bent_bar bar = bar_make();
  bound b = {.rows = {.count = 1, .offsets = offsets, .vertices = &bar.vertices[1], .coefficients = &one}};
  size_t size = 0;
  REQUIRE(exm_blended_create(bar.mesh, bar.exemplars, BAR_SHAPES, bar_handles(&bar), NULL, NULL, NULL, &b.deformer) ==
          EXM_OK);
  CHECK(exm_deformer_handle_pose(b.deformer, 2, b.targets) == EXM_OK);
  for (size_t k = 0; k < 3; k++) {
    b.row_target[k] = b.targets[12 + 4 * k + 3];
  }
  CHECK(exm_blended_key_size(b.deformer, &size) == EXM_OK);
  b.key = test_array(size, sizeof(double));
  /* The constraints' arrays replace each other, so that the balance of allocations holds. */
  CHECK(for_each_failed_allocation(change_and_solve, &b) > 10);
  free(b.key);
  exm_deformer_destroy(b.deformer);
  bar_free(&bar);
}
