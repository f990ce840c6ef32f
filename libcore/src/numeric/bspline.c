/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/bspline.h"

#include <math.h>
#include <string.h>

size_t bspline_span_count(size_t control_count, int is_cyclic)
{
  return is_cyclic || control_count < 4 ? control_count : control_count - 3;
}

size_t bspline_interval_count(size_t control_count, int is_cyclic)
{
  return is_cyclic ? control_count : control_count + 1;
}

/** The interval `away` (-2 .. 2) spans from a span. */
static double interval_near(const bspline *curve, size_t span, int away)
{
  size_t const k = curve->control_count;
  return curve->is_cyclic ? curve->intervals[(span + 2 * k + (size_t)(away + 2) - 2) % k]
                          : curve->intervals[span + (size_t)(away + 2)];
}

double bspline_span(const bspline *curve, size_t span)
{
  return interval_near(curve, span, 0);
}

curve_place bspline_walk(const bspline *curve, curve_place from, double advance)
{
  size_t const spans = bspline_span_count(curve->control_count, curve->is_cyclic);
  curve_place place = {from.span, from.offset + advance};
  for (size_t i = 0; i < 2 * spans; i++) {
    double const length = bspline_span(curve, place.span);
    if (place.offset < length) {
      return place;
    }
    if (!curve->is_cyclic && place.span + 1 == spans) {
      /* A last span without length has no basis functions: its neighbour ends at the same point. */
      while (place.span > 0 && bspline_span(curve, place.span) <= 0) {
        place.span--;
      }
      place.offset = bspline_span(curve, place.span);
      return place;
    }
    place.offset -= length;
    place.span = (place.span + 1) % spans;
  }
  return place;
}

void bspline_controls(const bspline *curve, size_t span, size_t controls[4])
{
  for (size_t j = 0; j < 4; j++) {
    controls[j] = curve->is_cyclic ? (span + j) % curve->control_count : span + j;
  }
}

/** Distances to the knots on the left and on the right, [1] to [3]; the classic names of de Boor's algorithm. */
static void knot_distances(const bspline *curve, curve_place place, double left[4], double right[4])
{
  left[0] = right[0] = 0;
  left[1] = place.offset;
  left[2] = left[1] + interval_near(curve, place.span, -1);
  left[3] = left[2] + interval_near(curve, place.span, -2);
  right[1] = interval_near(curve, place.span, 0) - place.offset;
  right[2] = right[1] + interval_near(curve, place.span, 1);
  right[3] = right[2] + interval_near(curve, place.span, 2);
}

void bspline_basis(const bspline *curve, curve_place place, double values[4], double derivatives[4])
{
  double left[4], right[4], quadratic[3] = {0}, widths[3];
  knot_distances(curve, place, left, right);
  values[0] = 1;
  for (int degree = 1; degree <= 3; degree++) {
    double carried = 0;
    if (degree == 3) {
      memcpy(quadratic, values, sizeof quadratic);
    }
    for (int r = 0; r < degree; r++) {
      double const width = right[r + 1] + left[degree - r], share = width > 0 ? values[r] / width : 0;
      values[r] = carried + right[r + 1] * share;
      carried = left[degree - r] * share;
    }
    values[degree] = carried;
  }
  for (int r = 0; r < 3; r++) {
    widths[r] = right[r + 1] + left[3 - r];
    quadratic[r] = widths[r] > 0 ? 3 * quadratic[r] / widths[r] : 0;
  }
  derivatives[0] = -quadratic[0];
  derivatives[1] = quadratic[0] - quadratic[1];
  derivatives[2] = quadratic[1] - quadratic[2];
  derivatives[3] = quadratic[2];
}

void bspline_evaluate(const bspline *curve, curve_place place, double point[2], double derivative[2])
{
  double values[4], slopes[4];
  size_t controls[4];
  bspline_basis(curve, place, values, slopes);
  bspline_controls(curve, place.span, controls);
  for (int k = 0; k < 2; k++) {
    double p = 0, d = 0;
    for (int j = 0; j < 4; j++) {
      p += values[j] * curve->points[controls[j]][k];
      d += slopes[j] * curve->points[controls[j]][k];
    }
    if (point) {
      point[k] = p;
    }
    if (derivative) {
      derivative[k] = d;
    }
  }
}

/** The s-th of the knots that divide the parameters' index into equal steps. */
static double knot_at(const double *parameters, size_t last, size_t spans, size_t s)
{
  if (spans == 0) {
    return 0;
  }
  size_t const whole = s * last / spans;
  double const share = (double)(s * last % spans) / (double)spans;
  return share > 0 ? parameters[whole] + share * (parameters[whole + 1] - parameters[whole]) : parameters[whole];
}

void bspline_choose_knots(size_t control_count, int is_cyclic, size_t count, const double *parameters,
                          double *intervals, curve_place *places)
{
  size_t const spans = bspline_span_count(control_count, is_cyclic), last = is_cyclic ? count : count - 1;
  double *lengths = intervals + (is_cyclic ? 0 : 2);
  memset(intervals, 0, bspline_interval_count(control_count, is_cyclic) * sizeof(double));
  for (size_t s = 0; s < spans; s++) {
    lengths[s] = knot_at(parameters, last, spans, s + 1) - knot_at(parameters, last, spans, s);
  }
  for (size_t i = 0; i < count; i++) {
    size_t const s = last > 0 ? i * spans / last : 0, span = s < spans ? s : spans - 1;
    places[i] = (curve_place){span, parameters[i] - knot_at(parameters, last, spans, span)};
  }
}

void bspline_insert_knot(const bspline *from, curve_place place, bspline *to)
{
  size_t const k = from->control_count, s = place.span, count = bspline_interval_count(k, from->is_cyclic);
  size_t const split = s + (from->is_cyclic ? 0 : 2);
  double left[4], right[4];
  knot_distances(from, place, left, right);
  to->control_count = k + 1;
  to->is_cyclic = from->is_cyclic;
  for (size_t i = 0; i <= k; i++) { /* new number s + i, going round where the curve does */
    size_t const now = (s + i) % (k + 1), old = (s + i) % k, older = (s + i + k - 1) % k;
    if (!from->is_cyclic && s + i > k) {
      break;
    }
    if (i == 0 || i > 3) {
      memcpy(to->points[now], from->points[i == 0 ? old : older], sizeof *to->points);
      continue;
    }
    double const share = left[4 - i] / (left[4 - i] + right[i]);
    for (int c = 0; c < 2; c++) {
      to->points[now][c] = (1 - share) * from->points[older][c] + share * from->points[old][c];
    }
  }
  for (size_t i = 0; !from->is_cyclic && i < s; i++) {
    memcpy(to->points[i], from->points[i], sizeof *to->points);
  }
  memcpy(to->intervals, from->intervals, split * sizeof(double));
  to->intervals[split] = place.offset;
  to->intervals[split + 1] = from->intervals[split] - place.offset;
  memcpy(to->intervals + split + 2, from->intervals + split + 1, (count - split - 1) * sizeof(double));
}
