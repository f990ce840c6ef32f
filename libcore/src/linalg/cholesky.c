/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The only user of CHOLMOD. Each factor has a cholmod_common of its own: there is no shared state.
 *
 * Ordered by approximate minimum degree. On surface meshes nested dissection by METIS saves up to a third of a solve,
 * but costs five times the analysis, and it seeds the C library's generator, sets signal handlers and prints when it is
 * out of memory, all of which belong to the program that loaded us. Always supernodal: a little faster at every size
 * met here, and made of dense panels, which solves run on: our own solver serves up to sixteen right-hand sides a pass,
 * with no allocation. (CHOLMOD's does one to four, and in version 3.0.14 crashes where its workspace does not fit.) */
#include "linalg/cholesky.h"

#include <cholmod.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "linalg/panel.h"
#include "linalg/single_blas.h"

struct cholesky {
  cholmod_common common;
  cholmod_factor *factor;
  int is_factored;
  double *rows; /* [size][PANEL_WIDEST] right-hand sides in the order of the factor */
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
  common->supernodal = CHOLMOD_SUPERNODAL;
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
  SINGLE_BLAS(cholmod_factorize(&a, c->factor, &c->common));
  TRY(translate(&c->common, "factorisation"));
  /* Overflow inside leaves infinities or NaN on the diagonal, where comparisons with zero do not notice them. */
  double const condition = cholmod_rcond(c->factor, &c->common);
  if (!(condition > 0) || !isfinite(condition)) {
    return status_set(EXM_ERROR_NUMERIC, "factorisation: the matrix is not positive definite");
  }
  c->is_factored = 1;
  return EXM_OK;
}

/* The analysis is made, or taken from `like`. */
static exm_status create(const sparse *lower, const cholesky *like, cholesky **out)
{
  *out = NULL;
  cholesky *c = calloc(1, sizeof *c);
  if (!c) {
    return status_no_memory("a factorisation");
  }
  configure(&c->common);
  if (like) {
    c->factor = cholmod_copy_factor(like->factor, &c->common);
  } else {
    cholmod_sparse a = view(lower);
    c->factor = cholmod_analyze(&a, &c->common);
  }
  exm_status status = translate(&c->common, "the analysis of a sparse matrix");
  c->rows = aligned_alloc(64, (lower->size + 1) * PANEL_WIDEST * sizeof(double)); /* two cache lines a row */
  if (status == EXM_OK && !c->rows) {
    status = status_no_memory("a factorisation");
  }
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

exm_status cholesky_create(const sparse *lower, cholesky **out)
{
  return create(lower, NULL, out);
}

exm_status cholesky_create_like(const cholesky *like, const sparse *lower, cholesky **out)
{
  if (lower->size != like->factor->n) {
    *out = NULL;
    return status_set(EXM_ERROR_INTERNAL, "a factor of %zu rows was given a matrix of %zu", like->factor->n,
                      lower->size);
  }
  return create(lower, like, out);
}

exm_status cholesky_refactor(cholesky *c, const sparse *lower)
{
  if (lower->size != c->factor->n) {
    return status_set(EXM_ERROR_INTERNAL, "a factor of %zu rows was given a matrix of %zu", c->factor->n, lower->size);
  }
  return factorize(c, lower);
}

static panels panels_of(const cholmod_factor *factor)
{
  return (panels){.count = factor->nsuper,
                  .columns = factor->super,
                  .row_starts = factor->pi,
                  .value_starts = factor->px,
                  .rows = factor->s,
                  .values = factor->x};
}

static void solve_one(cholesky *c, const panels *factor, size_t step, double *values)
{
  size_t const size = c->factor->n;
  const int32_t *order = c->factor->Perm;
  for (size_t i = 0; i < size; i++) {
    c->rows[i] = values[(size_t)order[i] * step];
  }
  panels_solve_one(factor, c->rows, c->rows + size);
  for (size_t i = 0; i < size; i++) {
    values[(size_t)order[i] * step] = c->rows[i];
  }
}

/* Right-hand side q has its entry of row i at values[i * row_step + q * column_step]; rows are in the factor's order on
 * the side that only one of the sweeps leaves. */
static exm_status solve(cholesky *c, size_t count, size_t row_step, size_t column_step, double *values, sweeps wanted)
{
  size_t const size = c->factor->n;
  const int32_t *order = c->factor->Perm;
  if (!c->is_factored) {
    return status_set(EXM_ERROR_NUMERIC, "no factorisation to solve with");
  }
  /* Half a solve permutes rows in place: all of a block's columns are read before any is written. */
  panels const factor = panels_of(c->factor);
  if (count == 1 && wanted == BOTH) {
    solve_one(c, &factor, row_step, values);
    return EXM_OK;
  }
  for (size_t first = 0; first < count; first += PANEL_WIDEST) {
    size_t const some = count - first < PANEL_WIDEST ? count - first : PANEL_WIDEST;
    size_t const width = (some + 3) / 4 * 4;
    for (size_t i = 0; i < size; i++) {
      size_t const row = wanted & FORWARD ? (size_t)order[i] : i;
      const double *from = values + row * row_step + first * column_step;
      for (size_t q = 0; q < width; q++) {
        c->rows[i * width + q] = q < some ? from[q * column_step] : 0;
      }
    }
    panels_solve(&factor, width, wanted, c->rows);
    for (size_t i = 0; i < size; i++) {
      size_t const row = wanted & BACKWARD ? (size_t)order[i] : i;
      double *to = values + row * row_step + first * column_step;
      for (size_t q = 0; q < some; q++) {
        to[q * column_step] = c->rows[i * width + q];
      }
    }
  }
  return EXM_OK;
}

exm_status cholesky_solve(cholesky *c, size_t count, double *columns)
{
  return solve(c, count, 1, c->factor->n, columns, BOTH);
}

exm_status cholesky_solve_rows(cholesky *c, size_t count, double *rows)
{
  return solve(c, count, count, 1, rows, BOTH);
}

exm_status cholesky_solve_root_rows(cholesky *c, size_t count, double *rows)
{
  return solve(c, count, count, 1, rows, FORWARD);
}

exm_status cholesky_solve_root_transposed_rows(cholesky *c, size_t count, double *rows)
{
  return solve(c, count, count, 1, rows, BACKWARD);
}

void cholesky_destroy(cholesky *c)
{
  if (!c) {
    return;
  }
  free(c->rows);
  cholmod_free_factor(&c->factor, &c->common);
  cholmod_finish(&c->common);
  free(c);
}
