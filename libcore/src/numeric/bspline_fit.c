/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Least squares for control points, by Givens rotations of one row after the other. A row has four entries next to each
 * other, so the triangle is a band; those that go round a closed curve fill the last three columns, which are kept
 * beside the band. No normal equations: spans with a single point at their end are legal, and ill-conditioned enough.
 */
#include <math.h>
#include <string.h>

#include "numeric/bspline.h"

enum { BAND = 4, BORDER = 3 };

/* Weight of the ends' curvature beside the points, squared in its effect: where they compete (k = n + 1), the curve
 * misses the points by rounding. */
static double const END_WEIGHT = 1e-7;

typedef struct triangle {
  size_t size;
  double (*band)[BAND];     /* [k] columns c .. c + 3 of row c, those before the border */
  double (*border)[BORDER]; /* [k] the last three columns */
  double (*right)[2];       /* [k] */
  double *row;              /* [k] that is being rotated in */
} triangle;

static double *entry(const triangle *t, size_t row, size_t column)
{
  return column + BORDER >= t->size ? &t->border[row][column + BORDER - t->size] : &t->band[row][column - row];
}

/** Rotate t->row with right-hand side into the triangle; the row is zero afterwards. */
static void rotate_in(triangle *t, double right[2])
{
  size_t const k = t->size, border = k - BORDER;
  for (size_t c = 0; c < k; c++) {
    double const below = t->row[c];
    if (below == 0) {
      continue;
    }
    double *diagonal = entry(t, c, c);
    double const length = hypot(*diagonal, below), cosine = *diagonal / length, sine = below / length;
    for (size_t j = c; j < k; j = j + 1 == c + BAND && j + 1 < border ? border : j + 1) {
      double *above = entry(t, c, j);
      double const old = *above;
      *above = cosine * old + sine * t->row[j];
      t->row[j] = cosine * t->row[j] - sine * old;
    }
    for (int i = 0; i < 2; i++) {
      double const old = t->right[c][i];
      t->right[c][i] = cosine * old + sine * right[i];
      right[i] = cosine * right[i] - sine * old;
    }
    t->row[c] = 0;
  }
}

static void add_point(triangle *t, const bspline *curve, curve_place place, const double point[2])
{
  double values[4], slopes[4], right[2] = {point[0], point[1]};
  size_t controls[4];
  bspline_basis(curve, place, values, slopes);
  bspline_controls(curve, place.span, controls);
  for (int j = 0; j < 4; j++) {
    t->row[controls[j]] += values[j]; /* a closed curve of four control points meets one twice no more than that */
  }
  rotate_in(t, right);
}

/** The second derivative at one end, from the first, which is quadratic over a span. */
static void add_end(triangle *t, const bspline *curve, size_t span, int is_last)
{
  double const length = bspline_span(curve, span), sign = is_last ? -1 : 1;
  double const weights[3] = {is_last ? -1 : -3, 4, is_last ? -3 : -1};
  double right[2] = {0, 0};
  size_t controls[4];
  bspline_controls(curve, span, controls);
  for (int i = 0; i < 3; i++) {
    double values[4], slopes[4];
    bspline_basis(curve, (curve_place){span, length * i / 2}, values, slopes);
    for (int j = 0; j < 4; j++) {
      t->row[controls[j]] += END_WEIGHT * sign * weights[i] * slopes[j] * length;
    }
  }
  rotate_in(t, right);
}

static exm_status substitute(const triangle *t, bspline *curve)
{
  for (size_t c = t->size; c-- > 0;) {
    double const diagonal = *entry(t, c, c);
    if (!(fabs(diagonal) > 0)) {
      return status_set(EXM_ERROR_NUMERIC, "control point %zu is not determined by the frames", c);
    }
    for (int i = 0; i < 2; i++) {
      double sum = t->right[c][i];
      for (size_t j = c + 1; j < c + BAND && j + BORDER < t->size; j++) {
        sum -= t->band[c][j - c] * curve->points[j][i];
      }
      for (size_t j = c + 1 > t->size - BORDER ? c + 1 : t->size - BORDER; j < t->size; j++) {
        sum -= *entry(t, c, j) * curve->points[j][i];
      }
      curve->points[c][i] = sum / diagonal;
    }
  }
  return EXM_OK;
}

exm_status bspline_fit(bspline *curve, size_t count, const curve_place *places, const double (*points)[2])
{
  arena scratch = {0};
  size_t const k = curve->control_count;
  triangle t = {.size = k};
  t.band = arena_array(&scratch, k, sizeof *t.band);
  t.border = arena_array(&scratch, k, sizeof *t.border);
  t.right = arena_array(&scratch, k, sizeof *t.right);
  t.row = ARENA_NEW(&scratch, double, k);
  exm_status status = t.band && t.border && t.right && t.row ? EXM_OK : status_no_memory("the time signal");
  if (status >= 0) {
    for (size_t i = 0; i < count; i++) {
      add_point(&t, curve, places[i], points[i]);
    }
    if (!curve->is_cyclic && k > count) {
      add_end(&t, curve, 0, 0);
      add_end(&t, curve, k - 4, 1);
    }
    status = substitute(&t, curve);
  }
  arena_release(&scratch);
  return status;
}
