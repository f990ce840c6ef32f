/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Triangular solves with a supernodal Cholesky factor, which is made of dense panels. */
#ifndef EXM_LINALG_PANEL_H
#define EXM_LINALG_PANEL_H

#include <stddef.h>
#include <stdint.h>

/* The most right-hand sides of one pass over the factor: two cache lines a row. */
enum { PANEL_WIDEST = 16 };

/** The factor as CHOLMOD keeps it. */
typedef struct panels {
  size_t count;
  const int32_t *columns;      /* [count + 1] first column of each panel */
  const int32_t *row_starts;   /* [count + 1] into rows */
  const int32_t *value_starts; /* [count + 1] into values */
  const int32_t *rows;         /* of each panel; its columns' own come first */
  const double *values;        /* column-major blocks */
} panels;

/* What of A = P' L L' P a call undoes. */
typedef enum sweeps { FORWARD = 1, BACKWARD = 2, BOTH = FORWARD | BACKWARD } sweeps;

/** L L' x = b in place, or one half of it. x [size][width], width a multiple of 4 up to PANEL_WIDEST; aligned to 32
 * bytes. */
void panels_solve(const panels *factor, size_t width, sweeps wanted, double *x);

/** All of it for a single right-hand side x [size], along the panels' columns. buffer: as many doubles as the highest
 *  panel has rows. */
void panels_solve_one(const panels *factor, double *x, double *buffer);

#endif
