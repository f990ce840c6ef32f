/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every allocation of a sequence's life fails once; what was there before is still there. */
#include "allocation.h"
#include "sequence_fixture.h"

typedef struct life {
  walk *w;
  exm_sequence *standing; /* fitted while memory was plenty */
  float *before, *after;
  int32_t space;
  char path[512];
} life;

static exm_status live(void *context)
{
  life *l = context;
  exm_sequence *sequence = (exm_sequence *)(uintptr_t)1, *loaded = NULL, *carried = NULL;
  uint32_t const frame = 1;
  double const point[2] = {0.2, 0.1}, path[8] = {0};
  exm_pins const pins = {1, &frame, point};
  exm_status status = exm_sequence_create(l->w->mesh, l->space, &sequence);
  CHECK((status < 0) == (sequence == NULL));
  for (size_t i = 0; i < l->w->frame_count && status >= 0; i++) {
    status = exm_sequence_add_frame(sequence, l->w->frames + i * l->w->size, l->w->shape.vertex_count, NULL, 0);
  }
  if (status >= 0 && (status = exm_sequence_fit(sequence, NULL, NULL, NULL, NULL)) >= 0 &&
      (status = exm_sequence_place(sequence, &pins, 5, NULL)) >= 0 &&
      (status = exm_sequence_insert_control_point(sequence, 0, 2, NULL)) >= 0 &&
      (status = exm_sequence_delete_control_point(sequence, 0, 2)) >= 0 &&
      (status = exm_sequence_evaluate(sequence, 1.5, l->after)) >= 0 &&
      (status = exm_sequence_measure(sequence, NULL, NULL)) >= 0 &&
      (status = exm_sequence_save(sequence, l->path, NULL)) >= 0 &&
      (status = exm_sequence_load(l->path, NULL, &loaded)) >= 0 &&
      (status = exm_sequence_draw(loaded, 4, path, NULL, 7)) >= 0 &&
      (status = exm_sequence_loop(sequence, 0, 6, 2)) >= 0 &&
      (status = exm_sequence_convert_rate(sequence, 0.7)) >= 0 &&
      (status = exm_sequence_add_pose(sequence, l->w->frames, path)) >= 0) {
    status = exm_sequence_transfer(sequence, l->w->frames, l->w->mesh, l->space, l->w->frames, 3, &carried);
  }
  exm_sequence_destroy(carried);
  exm_sequence_destroy(sequence);
  exm_sequence_destroy(loaded);
  return status;
}

static exm_status refit(void *context)
{
  life *l = context;
  exm_status const status = exm_sequence_fit(l->standing, NULL, NULL, NULL, NULL);
  CHECK_STATUS(exm_sequence_evaluate(l->standing, 1.7, l->after), EXM_OK);
  CHECK(memcmp(l->before, l->after, l->w->size * sizeof(float)) == 0);
  return status;
}

TEST(every_allocation_may_fail)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  walk w;
  walk_begin(&w, 7, 5.1);
  life l = {.w = &w, .standing = walk_sequence(&w, 0)};
  snprintf(l.path, sizeof l.path, "%s", test_file("life.exmseq", "", 0));
  l.before = test_array(w.size, sizeof(float));
  l.after = test_array(w.size, sizeof(float));
  for (l.space = 0; l.space < 5; l.space++) {
    test_about("shape space %d", l.space);
    CHECK(for_each_failed_allocation(live, &l) > 50);
  }
  CHECK_STATUS(exm_sequence_fit(l.standing, NULL, NULL, NULL, NULL), EXM_OK);
  exm_sequence_evaluate(l.standing, 1.7, l.before);
  CHECK(for_each_failed_allocation(refit, &l) > 20);
  free(l.before);
  free(l.after);
  exm_sequence_destroy(l.standing);
  walk_end(&w);
}
