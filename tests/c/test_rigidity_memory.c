/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every allocation of binding, changing, solving and learning fails once. */
#include "allocation.h"
#include "rigidity_fixture.h"

typedef struct memory_case {
  rigid *r;
  double *targets, *wide;
  int32_t *radii;
} memory_case;

static exm_status bind_in_little_memory(void *context)
{
  memory_case *c = context;
  exm_handles const handles = fixture_handles(c->r->f);
  exm_deformer *out = (exm_deformer *)(uintptr_t)1;
  exm_status status = exm_rigidity_create(c->r->f->reference, &handles, &c->r->settings, NULL, NULL, &out);
  CHECK((status < 0) == (out == NULL));
  if (status >= 0) {
    exm_rigidity_solve_settings settings = rigid_settings(1e-3, 20);
    settings.coarse_start = 1; /* levels are made here */
    status = exm_rigidity_solve(out, c->targets, &settings, NULL);
  }
  exm_deformer_destroy(out);
  return status < 0 ? status : EXM_OK;
}

static exm_status change_in_little_memory(void *context)
{
  memory_case *c = context;
  exm_deformer *d = c->r->f->deformer;
  exm_handles const handles = fixture_handles(c->r->f);
  exm_status status = exm_rigidity_set_radii(d, NULL, 3, NULL, NULL);
  if (status >= 0) {
    status = exm_rigidity_set_handles(d, &handles, NULL, NULL);
  }
  if (status >= 0) {
    status = exm_rigidity_energies(d, c->wide);
  }
  /* Whatever failed, it can be used. */
  CHECK(exm_rigidity_solve(d, c->targets, NULL, NULL) >= 0);
  return status;
}

static exm_status learn_in_little_memory(void *context)
{
  memory_case *c = context;
  return exm_rigidity_learn(c->r->f->reference, c->r->f->exemplars, 1, NULL, NULL, NULL, c->radii, NULL);
}

TEST(every_allocation_may_fail)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  rigid r = rigid_new(zoo_bar(40, 4), 2); /* large enough to have a coarser level */
  fixture_handle_near(r.f, EXM_HANDLE_ORIENTED, 0, 0, 0, 1);
  fixture_handle_near(r.f, EXM_HANDLE_PINNED, 0.5, 0.1, 0.1, 1);
  fixture_handle_near(r.f, EXM_HANDLE_PINNED, 0.8, 0.1, 0.1, 0);
  REQUIRE(rigid_bind(&r));
  memory_case c = {.r = &r,
                   .targets = rigid_bend(&r, 0.4),
                   .wide = test_array(r.f->vertex_count, sizeof(double)),
                   .radii = test_array(r.f->vertex_count, sizeof(int32_t))};
  free(rigid_solve(&r, c.targets, NULL, NULL));
  CHECK(for_each_failed_allocation(bind_in_little_memory, &c) > 100);
  CHECK(for_each_failed_allocation(change_in_little_memory, &c) > 30);
  CHECK(for_each_failed_allocation(learn_in_little_memory, &c) > 30);
  free(c.targets);
  free(c.wide);
  free(c.radii);
  rigid_free(&r);
}
