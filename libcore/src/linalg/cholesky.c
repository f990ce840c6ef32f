/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The only user of CHOLMOD. Each factor has a cholmod_common of its own: there is no shared state.
 *
 * Ordered by approximate minimum degree. On surface meshes nested dissection by METIS saves up to a third of a solve,
 * but costs five times the analysis, and it seeds the C library's generator, sets signal handlers and prints when it is
 * out of memory, all of which belong to the program that loaded us. */
#include "linalg/cholesky.h"

#include <cholmod.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

struct cholesky {
  cholmod_common common;
  cholmod_factor *factor;
  int is_factored;
  /* Kept between solves. */
  cholmod_dense *solution, *y, *e;
};

static exm_status translate(const cholmod_common *common, const char *what)
{
  switch (common->status) {
  case CHOLMOD_OK:
    return EXM_OK;
  case CHOLMOD_OUT_OF_MEMORY:
  case CHOLMOD_TOO_LARGE:
    return status_no_memory(what);
  case CHOLMOD_NOT_POSDEF:
    return status_set(EXM_ERROR_NUMERIC, "%s: the matrix is not positive definite", what);
  default:
    return status_set(EXM_ERROR_INTERNAL, "%s: CHOLMOD reports %d", what, common->status);
  }
}

static cholmod_sparse view(const sparse *lower)
{
  cholmod_sparse a = {0};
  a.nrow = a.ncol = lower->size;
  a.nzmax = (size_t)lower->starts[lower->size];
  a.p = lower->starts;
  a.i = lower->rows;
  a.x = lower->values;
  a.stype = -1;
  a.itype = CHOLMOD_INT;
  a.xtype = CHOLMOD_REAL;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = 1;
  return a;
}

static void configure(cholmod_common *common)
{
  cholmod_start(common);
  common->print = 0;
  common->error_handler = NULL;
  common->try_catch = 1; /* no message for errors that are ours to translate */
  common->nmethods = 1;
  common->method[0].ordering = CHOLMOD_AMD;
  common->postorder = 1;
  common->final_ll = 1;
  common->quick_return_if_not_posdef = 1;
}

static exm_status factorize(cholesky *c, const sparse *lower)
{
  size_t const entries = (size_t)lower->starts[lower->size];
  c->is_factored = 0;
  for (size_t e = 0; e < entries; e++) {
    if (!isfinite(lower->values[e])) {
      return status_set(EXM_ERROR_NUMERIC, "factorisation: the matrix is not finite in row %d", (int)lower->rows[e]);
    }
  }
  cholmod_sparse a = view(lower);
  cholmod_factorize(&a, c->factor, &c->common);
  TRY(translate(&c->common, "factorisation"));
  /* Overflow inside leaves infinities or NaN on the diagonal, where comparisons with zero do not notice them. */
  double const condition = cholmod_rcond(c->factor, &c->common);
  if (!(condition > 0) || !isfinite(condition)) {
    return status_set(EXM_ERROR_NUMERIC, "factorisation: the matrix is not positive definite");
  }
  c->is_factored = 1;
  return EXM_OK;
}

exm_status cholesky_create(const sparse *lower, cholesky **out)
{
  *out = NULL;
  cholesky *c = calloc(1, sizeof *c);
  if (!c) {
    return status_no_memory("a factorisation");
  }
  configure(&c->common);
  cholmod_sparse a = view(lower);
  c->factor = cholmod_analyze(&a, &c->common);
  exm_status status = translate(&c->common, "the analysis of a sparse matrix");
  if (status == EXM_OK) {
    status = factorize(c, lower);
  }
  if (status < 0) {
    cholesky_destroy(c);
    return status;
  }
  *out = c;
  return EXM_OK;
}

exm_status cholesky_refactor(cholesky *c, const sparse *lower)
{
  if (lower->size != c->factor->n) {
    return status_set(EXM_ERROR_INTERNAL, "a factor of %zu rows was given a matrix of %zu", c->factor->n, lower->size);
  }
  return factorize(c, lower);
}

exm_status cholesky_solve(cholesky *c, size_t count, double *columns)
{
  size_t const size = c->factor->n;
  if (!c->is_factored) {
    return status_set(EXM_ERROR_NUMERIC, "no factorisation to solve with");
  }
  if (count == 0 || size == 0) {
    return EXM_OK;
  }
  cholmod_dense b = {0};
  b.nrow = b.d = size;
  b.ncol = count;
  b.nzmax = size * count;
  b.x = columns;
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_solve2(CHOLMOD_A, c->factor, &b, NULL, &c->solution, NULL, &c->y, &c->e, &c->common);
  TRY(translate(&c->common, "the solution of a sparse system"));
  memcpy(columns, c->solution->x, size * count * sizeof *columns);
  return EXM_OK;
}

void cholesky_destroy(cholesky *c)
{
  if (!c) {
    return;
  }
  cholmod_free_dense(&c->solution, &c->common);
  cholmod_free_dense(&c->y, &c->common);
  cholmod_free_dense(&c->e, &c->common);
  cholmod_free_factor(&c->factor, &c->common);
  cholmod_finish(&c->common);
  free(c);
}
