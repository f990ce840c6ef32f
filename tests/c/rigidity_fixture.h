/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Small meshes bound by Rigidity, on top of what AMRAP's tests have. */
#ifndef EXM_TESTS_RIGIDITY_FIXTURE_H
#define EXM_TESTS_RIGIDITY_FIXTURE_H

#include "amrap_fixture.h"

typedef struct rigid {
  fixture *f; /* its only exemplar is the reference */
  int32_t *radii;
  exm_rigidity_bind_settings settings;
} rigid;

/* `shape` now belongs to it. */
static inline rigid rigid_new(zoo_mesh shape, int32_t radius)
{
  rigid r = {.f = fixture_new(shape, 1, 0)};
  exm_rigidity_bind_settings_init(&r.settings);
  r.settings.radius = radius;
  return r;
}

/* Radii 1, 2, 3, 4, 5, 1, ... */
static inline void rigid_mix_radii(rigid *r)
{
  r->radii = test_array(r->f->vertex_count, sizeof *r->radii);
  for (size_t v = 0; v < r->f->vertex_count; ++v) {
    r->radii[v] = 1 + (int32_t)(v % 5);
  }
  r->settings.radii = r->radii;
}

static inline exm_status rigid_try(rigid *r)
{
  fixture *f = r->f;
  exm_handles const handles = fixture_handles(f);
  if (!f->reference && exm_mesh_create(f->exemplars, f->vertex_count, f->shape.triangles[0], f->shape.triangle_count,
                                       &f->reference) < 0) {
    return EXM_ERROR_INTERNAL;
  }
  exm_deformer_destroy(f->deformer);
  return exm_rigidity_create(f->reference, &handles, &r->settings, NULL, NULL, &f->deformer);
}

static inline int rigid_bind(rigid *r)
{
  exm_status const status = rigid_try(r);
  if (status < 0) {
    test_fail(__FILE__, __LINE__, "binding returned %d: %s", status, exm_last_error());
  }
  return status >= 0;
}

static inline void rigid_free(rigid *r)
{
  free(r->radii);
  fixture_free(r->f);
}

/* A bar of 8 x 2 x 2 whose ends are oriented. */
static inline rigid rigid_bar(int32_t radius)
{
  rigid r = rigid_new(zoo_bar(8, 2), radius);
  fixture_handle_near(r.f, EXM_HANDLE_ORIENTED, 0, 0.1, 0.1, 1);
  fixture_handle_near(r.f, EXM_HANDLE_ORIENTED, 1, 0.1, 0.1, 1);
  return r;
}

static inline exm_rigidity_solve_settings rigid_settings(double tolerance, int32_t iterations)
{
  exm_rigidity_solve_settings settings;
  exm_rigidity_solve_settings_init(&settings);
  settings.tolerance = tolerance;
  settings.iterations = iterations;
  return settings;
}

/* Solve and read the positions; free them. */
static inline double *rigid_solve(const rigid *r, const double *targets, const exm_rigidity_solve_settings *settings,
                                  exm_solve_report *report)
{
  exm_status const status = exm_rigidity_solve(r->f->deformer, targets, settings, report);
  if (status < 0) {
    test_fail(__FILE__, __LINE__, "solving returned %d: %s", status, exm_last_error());
  }
  return fixture_positions(r->f);
}

/* Handles where the reference has them, the last one turned and moved. */
static inline double *rigid_bend(const rigid *r, double angle)
{
  double *targets = fixture_targets(r->f);
  CHECK_STATUS(exm_deformer_handle_pose(r->f->deformer, 0, targets), EXM_OK);
  double *last = targets + 12 * (r->f->handle_count - 1), R[3][3];
  fixture_rotation(0.1, 1, 0.3, angle, R);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      last[4 * i + j] = R[i][j];
    }
    last[4 * i + 3] += r->f->diagonal * angle * (i == 0 ? -0.2 : i == 1 ? 0.1 : 0.3);
  }
  return targets;
}

#endif
