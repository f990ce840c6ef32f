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

#include "linalg/four.h"

struct cholesky {
  cholmod_common common;
  cholmod_factor *factor;
  int is_factored;
  double *rows; /* [size][WIDEST] right-hand sides in the order of the factor */
};

/* The most right-hand sides of one pass over the factor: two cache lines a row, four `four`s. */
enum { WIDEST = 16, UNROLL = 4 };

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
  c->rows = aligned_alloc(64, (lower->size + 1) * WIDEST * sizeof(double)); /* two cache lines a row */
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

/* A panel of the factor: columns `first`.. that share their pattern, as a dense column-major block. */
typedef struct panel {
  size_t first, column_count, row_count;
  const int32_t *rows; /* [row_count] the columns' own come first */
  const double *values;
} panel;

static panel panel_of(const cholmod_factor *factor, size_t index)
{
  const int32_t *super = factor->super, *starts = factor->pi, *values = factor->px;
  return (panel){.first = (size_t)super[index],
                 .column_count = (size_t)(super[index + 1] - super[index]),
                 .row_count = (size_t)(starts[index + 1] - starts[index]),
                 .rows = (const int32_t *)factor->s + starts[index],
                 .values = (const double *)factor->x + values[index]};
}

/* x_i -= sum_c L_ic x_c for `some` rows i below the panel's own. Several rows together are several independent chains
 * of operations, where one would wait for itself. */
INLINE void forward_rows(const panel *p, four *x, size_t n, size_t row, size_t some)
{
  const four *own = x + p->first * n;
  four sum[UNROLL][WIDEST / 4];
  for (size_t r = 0; r < some; r++) {
    for (size_t q = 0; q < n; q++) {
      sum[r][q] = x[(size_t)p->rows[row + r] * n + q];
    }
  }
  for (size_t c = 0; c < p->column_count; c++) {
    const double *column = p->values + c * p->row_count + row;
    for (size_t r = 0; r < some; r++) {
      for (size_t q = 0; q < n; q++) {
        four_subtract(&sum[r][q], column[r], &own[c * n + q]);
      }
    }
  }
  for (size_t r = 0; r < some; r++) {
    for (size_t q = 0; q < n; q++) {
      x[(size_t)p->rows[row + r] * n + q] = sum[r][q];
    }
  }
}

/* L x = b, one panel. `n` fours a row; a constant where this is inlined. */
INLINE void forward(const panel *p, four *x, size_t n)
{
  size_t const columns = p->column_count, rows = p->row_count;
  four *own = x + p->first * n;
  for (size_t c = 0; c < columns; c++) {
    const double *column = p->values + c * rows;
    double const inverse = 1 / column[c];
    for (size_t q = 0; q < n; q++) {
      four_scale(&own[c * n + q], inverse);
    }
    for (size_t r = c + 1; r < columns; r++) {
      for (size_t q = 0; q < n; q++) {
        four_subtract(&own[r * n + q], column[r], &own[c * n + q]);
      }
    }
  }
  size_t r = columns;
  for (; r + UNROLL <= rows; r += UNROLL) {
    forward_rows(p, x, n, r, UNROLL);
  }
  for (; r < rows; r++) {
    forward_rows(p, x, n, r, 1);
  }
}

/* x_c -= sum_i L_ic x_i over the rows i below the panel's own, for `some` columns c. */
INLINE void backward_columns(const panel *p, four *x, size_t n, size_t column, size_t some)
{
  four *own = x + (p->first + column) * n;
  const double *values = p->values + column * p->row_count;
  four sum[UNROLL][WIDEST / 4];
  for (size_t c = 0; c < some; c++) {
    for (size_t q = 0; q < n; q++) {
      sum[c][q] = own[c * n + q];
    }
  }
  for (size_t r = p->column_count; r < p->row_count; r++) {
    const four *row = x + (size_t)p->rows[r] * n;
    for (size_t c = 0; c < some; c++) {
      for (size_t q = 0; q < n; q++) {
        four_subtract(&sum[c][q], values[c * p->row_count + r], &row[q]);
      }
    }
  }
  for (size_t c = 0; c < some; c++) {
    for (size_t q = 0; q < n; q++) {
      own[c * n + q] = sum[c][q];
    }
  }
}

/* L' x = b, one panel. */
INLINE void backward(const panel *p, four *x, size_t n)
{
  size_t const columns = p->column_count, rows = p->row_count;
  four *own = x + p->first * n;
  size_t begin = 0;
  for (; begin + UNROLL <= columns; begin += UNROLL) {
    backward_columns(p, x, n, begin, UNROLL);
  }
  for (; begin < columns; begin++) {
    backward_columns(p, x, n, begin, 1);
  }
  for (size_t c = columns; c-- > 0;) {
    const double *column = p->values + c * rows;
    double const inverse = 1 / column[c];
    for (size_t r = c + 1; r < columns; r++) {
      for (size_t q = 0; q < n; q++) {
        four_subtract(&own[c * n + q], column[r], &own[r * n + q]);
      }
    }
    for (size_t q = 0; q < n; q++) {
      four_scale(&own[c * n + q], inverse);
    }
  }
}

/* What of A = P' L L' P a call undoes. */
typedef enum sweeps { FORWARD = 1, BACKWARD = 2, BOTH = FORWARD | BACKWARD } sweeps;

INLINE void sweep(const cholmod_factor *factor, four *x, size_t n, sweeps wanted)
{
  for (size_t s = 0; (wanted & FORWARD) && s < factor->nsuper; s++) {
    panel const p = panel_of(factor, s);
    forward(&p, x, n);
  }
  for (size_t s = factor->nsuper; (wanted & BACKWARD) && s-- > 0;) {
    panel const p = panel_of(factor, s);
    backward(&p, x, n);
  }
}

SIMD_CLONES static void sweep_any(const cholmod_factor *factor, four *x, size_t n, sweeps wanted)
{
  switch (n) {
  case 1:
    sweep(factor, x, 1, wanted);
    break;
  case 2:
    sweep(factor, x, 2, wanted);
    break;
  case 3:
    sweep(factor, x, 3, wanted);
    break;
  default:
    sweep(factor, x, 4, wanted);
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
  for (size_t first = 0; first < count; first += WIDEST) {
    size_t const some = count - first < WIDEST ? count - first : WIDEST;
    size_t const width = (some + 3) / 4 * 4;
    for (size_t i = 0; i < size; i++) {
      size_t const row = wanted & FORWARD ? (size_t)order[i] : i;
      const double *from = values + row * row_step + first * column_step;
      for (size_t q = 0; q < width; q++) {
        c->rows[i * width + q] = q < some ? from[q * column_step] : 0;
      }
    }
    sweep_any(c->factor, (four *)c->rows, width / 4, wanted);
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
