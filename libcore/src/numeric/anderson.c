/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/anderson.h"

#include <float.h>
#include <string.h>

#include "linalg/dense.h"

/* Relative to the trace of the least-squares problem: keeps nearly parallel steps from adding up to large ones. */
static double const REGULARISATION = 1e-9;

exm_status anderson_create(arena *owner, size_t size, size_t depth, anderson *out)
{
  anderson a = {.size = size, .depth = depth};
  a.residual_steps = ARENA_NEW(owner, double, depth *size);
  a.image_steps = ARENA_NEW(owner, double, depth *size);
  a.last_residual = ARENA_NEW(owner, double, size);
  a.last_image = ARENA_NEW(owner, double, size);
  a.gram = ARENA_NEW(owner, double, depth *depth);
  a.coefficients = ARENA_NEW(owner, double, depth);
  if (!a.residual_steps || !a.image_steps || !a.last_residual || !a.last_image || !a.gram || !a.coefficients) {
    return status_no_memory("the acceleration");
  }
  *out = a;
  return EXM_OK;
}

void anderson_reset(anderson *a)
{
  a->count = a->next = 0;
  a->has_last = 0;
}

/** Differences to the last evaluation take the place of the oldest. */
static void remember(anderson *a, const double *image, const double *x)
{
  double *residual_step = a->residual_steps + a->next * a->size, *image_step = a->image_steps + a->next * a->size;
  for (size_t i = 0; i < a->size; i++) {
    residual_step[i] = image[i] - x[i] - a->last_residual[i];
    image_step[i] = image[i] - a->last_image[i];
  }
  a->next = (a->next + 1) % a->depth;
  a->count = a->count < a->depth ? a->count + 1 : a->depth;
}

/** Least squares of the residual by the residual steps, by normal equations. */
static int fit(anderson *a)
{
  double trace = 0;
  for (size_t i = 0; i < a->count; i++) {
    for (size_t j = 0; j <= i; j++) {
      a->gram[i * a->count + j] = dense_dot(a->size, a->residual_steps + i * a->size, a->residual_steps + j * a->size);
    }
    trace += a->gram[i * a->count + i];
    a->coefficients[i] = dense_dot(a->size, a->residual_steps + i * a->size, a->last_residual);
  }
  for (size_t i = 0; i < a->count; i++) {
    a->gram[i * a->count + i] += REGULARISATION * trace + DBL_MIN;
  }
  if (!dense_cholesky(a->count, a->gram)) {
    return 0;
  }
  dense_cholesky_forward(a->count, a->gram, a->coefficients);
  dense_cholesky_backward(a->count, a->gram, a->coefficients);
  return 1;
}

void anderson_mix(anderson *a, const double *image, double *x)
{
  if (a->has_last) {
    remember(a, image, x);
  }
  for (size_t i = 0; i < a->size; i++) {
    a->last_residual[i] = image[i] - x[i];
  }
  memcpy(a->last_image, image, a->size * sizeof(double));
  a->has_last = 1;
  memcpy(x, image, a->size * sizeof(double));
  if (a->count > 0 && fit(a)) {
    for (size_t i = 0; i < a->count; i++) {
      dense_axpy(a->size, -a->coefficients[i], a->image_steps + i * a->size, x);
    }
  }
}
