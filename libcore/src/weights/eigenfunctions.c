/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every connected part adds a function of eigenvalue 0, its indicator. Those are known beforehand, and are kept out of
 * the search: it would have to tell apart what nothing tells apart. */
#include "weights/eigenfunctions.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "linalg/eigen.h"
#include "linalg/sparse.h"

/* Beside 4 pi / area, which is what eigenvalues are about: small enough to tell the lowest apart, large enough for the
 * factorisation to keep its digits. */
static double const SHIFT = 1e-3;

/* M-orthonormal functions that are constant on each part, `count` of them; the first is constant on all. */
static exm_status constants(const mesh *reference, size_t count, double *out)
{
  size_t const V = reference->vertex_count, parts = reference->report.component_count;
  arena scratch = {0};
  double *masses = ARENA_NEW(&scratch, double, parts);
  double *basis = ARENA_NEW(&scratch, double, count *parts);
  if (!masses || !basis) {
    arena_release(&scratch);
    return status_no_memory("eigenfunctions");
  }
  double total = 0;
  for (size_t v = 0; v < V; v++) {
    masses[reference->components[v]] += reference->masses[v];
    total += reference->masses[v];
  }
  /* Function i >= 1 is positive on part i - 1, negative on all later parts, and zero on those before it: orthogonal as
   * they are, and to the constant. */
  double rest = total;
  for (size_t p = 0; p < parts; p++) {
    basis[p] = 1 / sqrt(total);
  }
  for (size_t i = 1; i < count; i++) {
    double const own = masses[i - 1];
    rest -= own;
    double const height = sqrt(rest / (own * (own + rest)));
    for (size_t p = i - 1; p < parts; p++) {
      basis[i * parts + p] = p == i - 1 ? height : -height * own / rest;
    }
  }
  for (size_t i = 0; i < count; i++) {
    for (size_t v = 0; v < V; v++) {
      out[i * V + v] = basis[i * parts + reference->components[v]];
    }
  }
  arena_release(&scratch);
  return EXM_OK;
}

/* Eigenfunctions are defined up to their sign: the third moment is positive, or what comes first where it vanishes. */
static void choose_sign(const mesh *reference, double *function)
{
  double third = 0, size = 0;
  for (size_t v = 0; v < reference->vertex_count; v++) {
    double const f = function[v];
    third += reference->masses[v] * f * f * f;
    size += reference->masses[v] * fabs(f * f * f);
  }
  if (fabs(third) < 1e-6 * size) {
    size_t v = 0;
    while (v + 1 < reference->vertex_count && fabs(function[v]) < 1e-6) {
      v++;
    }
    third = function[v];
  }
  for (size_t v = 0; v < reference->vertex_count && third < 0; v++) {
    function[v] = -function[v];
  }
}

typedef struct watch {
  const progress *report;
  size_t steps;
} watch;

/* How many steps there will be is not known; this approaches the end. */
static int stop(void *user)
{
  watch *w = user;
  w->steps++;
  double const steps = (double)w->steps;
  return progress_report(w->report, steps / (steps + 60), "eigenfunctions") < 0;
}

exm_status weights_eigenfunctions(const mesh *reference, size_t count, const progress *report, double *values,
                                  double *functions)
{
  size_t const V = reference->vertex_count, parts = reference->report.component_count;
  size_t const flat = parts < count ? parts : count;
  double total = 0;
  arena scratch = {0};
  sparse laplacian;
  watch w = {.report = report};
  for (size_t v = 0; v < V; v++) {
    total += reference->masses[v];
  }
  TRY(constants(reference, flat, functions));
  memset(values, 0, flat * sizeof(double));
  if (flat == count) {
    return EXM_OK;
  }
  exm_status status =
      sparse_laplacian(&scratch, V, reference->triangle_count, (const uint32_t(*)[3])reference->triangles,
                       (const double(*)[3])reference->cotangents, &laplacian);
  if (status == EXM_OK) {
    eigen_problem const problem = {.lower = &laplacian,
                                   .masses = reference->masses,
                                   .shift = SHIFT * 4 * M_PI / total,
                                   .known_count = flat,
                                   .known = functions,
                                   .stop = stop,
                                   .user = &w};
    status = eigen_lowest(&problem, count - flat, values + flat, functions + flat * V);
  }
  for (size_t i = flat; i < count && status == EXM_OK; i++) {
    choose_sign(reference, functions + i * V);
  }
  arena_release(&scratch);
  return status;
}
