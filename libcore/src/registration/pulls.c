/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/pulls.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* As in the deformer: what nothing determines stays at rest. */
static double const FLOOR = 1e-9;
/* Conjugate gradients, preconditioned by pulls that are alike in all directions. ICP comes back with other
 * correspondences anyway. */
enum { STEPS = 6 };
static double const TOLERANCE = 1e-3;

exm_status pulls_create(arena *owner, const registration *r, size_t capacity, pulls *out)
{
  const blended_basis *basis = registration_basis(r);
  size_t const rank = basis->rank;
  *out = (pulls){.basis = basis,
                 .capacity = capacity,
                 .list = ARENA_NEW(owner, pull, capacity),
                 .rows = ARENA_NEW(owner, double, capacity *rank),
                 .base = ARENA_NEW(owner, double, rank *rank),
                 .factor = ARENA_NEW(owner, double, rank *rank),
                 .weighted = ARENA_NEW(owner, double, capacity *rank),
                 .images = ARENA_NEW(owner, double, capacity * 3),
                 .right = ARENA_NEW(owner, double, rank * 3),
                 .residual = ARENA_NEW(owner, double, rank * 3),
                 .direction = ARENA_NEW(owner, double, rank * 3),
                 .applied = ARENA_NEW(owner, double, rank * 3),
                 .precondition = ARENA_NEW(owner, double, rank * 3),
                 .column = ARENA_NEW(owner, double, rank)};
  if (!out->list || !out->rows || !out->base || !out->factor || !out->weighted || !out->images || !out->right ||
      !out->residual || !out->direction || !out->applied || !out->precondition || !out->column) {
    return status_no_memory("the fit");
  }
  memcpy(out->base, basis->elastic, rank * rank * sizeof(double));
  dense_axpy(rank * rank, r->deformer->solver.beta_sm, basis->bending, out->base);
  for (size_t i = 0; i < rank; i++) {
    out->base[i * (rank + 1)] += FLOOR;
  }
  return EXM_OK;
}

exm_status pulls_factor(pulls *p)
{
  size_t const rank = p->basis->rank;
  for (size_t i = 0; i < p->count; i++) {
    const pull *one = &p->list[i];
    double const mean = one->weight * ((1 - one->slip) / 3 + one->slip);
    for (size_t k = 0; k < rank; k++) {
      p->weighted[i * rank + k] = mean * p->rows[i * rank + k];
    }
  }
  memcpy(p->factor, p->base, rank * rank * sizeof(double));
  dense_multiply(1, 0, rank, rank, p->count, 1, p->rows, p->weighted, 1, p->factor);
  if (!dense_cholesky(rank, p->factor)) {
    return status_set(EXM_ERROR_NUMERIC, "the fit's matrix is not positive definite");
  }
  return EXM_OK;
}

/** images of constraint i -> its metric times them */
static void weigh(const pull *one, double image[3])
{
  double const along = dense_dot(3, one->normal, image) * (1 - one->slip);
  for (size_t k = 0; k < 3; k++) {
    image[k] = one->weight * (along * one->normal[k] + one->slip * image[k]);
  }
}

static void apply(pulls *p, const double *u, double *out)
{
  size_t const rank = p->basis->rank;
  dense_times(p->count, rank, 3, p->rows, u, p->images);
  for (size_t i = 0; i < p->count; i++) {
    weigh(&p->list[i], p->images + 3 * i);
  }
  dense_times_transposed(p->count, rank, 3, p->rows, rank, p->images, out);
  dense_multiply(0, 0, rank, 3, rank, 1, p->base, u, 1, out);
}

static void precondition(pulls *p, const double *from, double *out)
{
  size_t const rank = p->basis->rank;
  for (size_t k = 0; k < 3; k++) {
    for (size_t i = 0; i < rank; i++) {
      p->column[i] = from[3 * i + k];
    }
    dense_cholesky_forward(rank, p->factor, p->column);
    dense_cholesky_backward(rank, p->factor, p->column);
    for (size_t i = 0; i < rank; i++) {
      out[3 * i + k] = p->column[i];
    }
  }
}

static void set_right(pulls *p, const double *elastic)
{
  size_t const rank = p->basis->rank;
  for (size_t i = 0; i < p->count; i++) {
    memcpy(p->images + 3 * i, p->list[i].target, 3 * sizeof(double));
    weigh(&p->list[i], p->images + 3 * i);
  }
  dense_times_transposed(p->count, rank, 3, p->rows, rank, p->images, p->right);
  dense_axpy(rank * 3, 1, elastic, p->right);
}

void pulls_solve(pulls *p, const double *elastic, double *u)
{
  size_t const size = p->basis->rank * 3;
  set_right(p, elastic);
  apply(p, u, p->applied);
  memcpy(p->residual, p->right, size * sizeof(double));
  dense_axpy(size, -1, p->applied, p->residual);
  precondition(p, p->residual, p->precondition);
  memcpy(p->direction, p->precondition, size * sizeof(double));
  double left = dense_dot(size, p->residual, p->precondition);
  double const enough = TOLERANCE * TOLERANCE * left;
  for (int step = 0; step < STEPS && left > enough && left > 0; step++) {
    apply(p, p->direction, p->applied);
    double const length = left / dense_dot(size, p->direction, p->applied);
    dense_axpy(size, length, p->direction, u);
    dense_axpy(size, -length, p->applied, p->residual);
    precondition(p, p->residual, p->precondition);
    double const before = left;
    left = dense_dot(size, p->residual, p->precondition);
    for (size_t i = 0; i < size; i++) {
      p->direction[i] = p->precondition[i] + left / before * p->direction[i];
    }
  }
}
