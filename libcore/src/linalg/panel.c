/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/panel.h"

#include "base/simd.h"
#include "linalg/four.h"

enum { UNROLL = 4 };

/* A panel of the factor: columns `first`.. that share their pattern, as a dense column-major block. */
typedef struct panel {
  size_t first, column_count, row_count;
  const int32_t *rows; /* [row_count] the columns' own come first */
  const double *values;
} panel;

static panel panel_of(const panels *factor, size_t index)
{
  return (panel){.first = (size_t)factor->columns[index],
                 .column_count = (size_t)(factor->columns[index + 1] - factor->columns[index]),
                 .row_count = (size_t)(factor->row_starts[index + 1] - factor->row_starts[index]),
                 .rows = factor->rows + factor->row_starts[index],
                 .values = factor->values + factor->value_starts[index]};
}

/* x_i -= sum_c L_ic x_c for `some` rows i below the panel's own. Several rows together are several independent chains
 * of operations, where one would wait for itself. */
INLINE void forward_rows(const panel *p, four *x, size_t n, size_t row, size_t some)
{
  const four *own = x + p->first * n;
  four sum[UNROLL][PANEL_WIDEST / 4];
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
  four sum[UNROLL][PANEL_WIDEST / 4];
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

INLINE void sweep(const panels *factor, four *x, size_t n, sweeps wanted)
{
  for (size_t s = 0; (wanted & FORWARD) && s < factor->count; s++) {
    panel const p = panel_of(factor, s);
    forward(&p, x, n);
  }
  for (size_t s = factor->count; (wanted & BACKWARD) && s-- > 0;) {
    panel const p = panel_of(factor, s);
    backward(&p, x, n);
  }
}

SIMD_CLONES static void sweep_any(const panels *factor, four *x, size_t n, sweeps wanted)
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

void panels_solve(const panels *factor, size_t width, sweeps wanted, double *x)
{
  sweep_any(factor, (four *)x, width / 4, wanted);
}

/* ------------------------------------------------------------------------------------------- a single right-hand side
 */

/* x_r -= L_rc x_c for the rows of a panel, gathered side by side so that columns are read as they lie. */
INLINE void forward_one(const panel *p, double *x, double *buffer)
{
  size_t const columns = p->column_count, below = p->row_count - columns;
  double *own = x + p->first;
  for (size_t r = 0; r < below; r++) {
    buffer[r] = 0;
  }
  for (size_t c = 0; c < columns; c++) {
    const double *column = p->values + c * p->row_count;
    double const value = own[c] / column[c];
    own[c] = value;
    for (size_t r = c + 1; r < columns; r++) {
      own[r] -= column[r] * value;
    }
    for (size_t r = 0; r < below; r++) {
      buffer[r] += column[columns + r] * value;
    }
  }
  for (size_t r = 0; r < below; r++) {
    x[p->rows[columns + r]] -= buffer[r];
  }
}

INLINE void backward_one(const panel *p, double *x, double *buffer)
{
  size_t const columns = p->column_count, below = p->row_count - columns;
  double *own = x + p->first;
  for (size_t r = 0; r < below; r++) {
    buffer[r] = x[p->rows[columns + r]];
  }
  for (size_t c = columns; c-- > 0;) {
    const double *column = p->values + c * p->row_count;
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t r = 0; r < below; r++) {
      sum += column[columns + r] * buffer[r];
    }
    for (size_t r = c + 1; r < columns; r++) {
      sum += column[r] * own[r];
    }
    own[c] = (own[c] - sum) / column[c];
  }
}

SIMD_CLONES void panels_solve_one(const panels *factor, double *x, double *buffer)
{
  for (size_t s = 0; s < factor->count; s++) {
    panel const p = panel_of(factor, s);
    forward_one(&p, x, buffer);
  }
  for (size_t s = factor->count; s-- > 0;) {
    panel const p = panel_of(factor, s);
    backward_one(&p, x, buffer);
  }
}
