/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Solves run in the frame of the exemplar that lies on the targets best: then neither the elastic net, which knows
 * coordinate axes and lengths, nor anything after it sees how the targets are turned, moved or scaled. */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"

/* Second moments of the targets below this share of the diagonal squared are one point: they have no scale. */
static double const POINT = 1e-12;

/** Weighted least squares over turn, shift and scale: y_i = scale turn a_i + h_i shift, with h_i the rows' sums
 * [Umeyama, "Least-squares estimation of transformation parameters between two point patterns", 1991, with rows that
 * only turn]. */
static void fit_frame(const blended *b, size_t exemplar, int has_scale, blended_frame *out)
{
  const blended_constraints *c = &b->held;
  size_t const d = b->dimension, width = b->exemplar_count * d;
  double mean_a[3] = {0}, mean_y[3] = {0}, sums = 0, spread = 0, moment[9] = {0}, size = 0;
  for (size_t i = 0; i < c->row_count; i++) {
    double const w = c->weights[i] * c->sums[i];
    dense_axpy(d, w, c->on_exemplars + i * width + exemplar * d, mean_a);
    dense_axpy(d, w, c->targets + i * d, mean_y);
    sums += w * c->sums[i];
  }
  for (size_t k = 0; k < d; k++) {
    mean_a[k] = sums > 0 ? mean_a[k] / sums : 0;
    mean_y[k] = sums > 0 ? mean_y[k] / sums : 0;
  }
  for (size_t i = 0; i < c->row_count; i++) {
    const double *a = c->on_exemplars + i * width + exemplar * d, *y = c->targets + i * d;
    for (size_t j = 0; j < d; j++) {
      double const from = a[j] - c->sums[i] * mean_a[j];
      double const own = y[j] - c->sums[i] * mean_y[j];
      spread += c->weights[i] * from * from;
      size += c->weights[i] * own * own;
      for (size_t k = 0; k < d; k++) {
        moment[k * d + j] += c->weights[i] * (y[k] - c->sums[i] * mean_y[k]) * from;
      }
    }
  }
  rotation_fit(d, 1, moment, out->turn);
  double const along = dense_dot(d * d, out->turn, moment);
  out->scale = has_scale && spread > POINT && along > POINT ? along / spread : 1;
  out->residual = size - 2 * out->scale * along + out->scale * out->scale * spread;
  dense_times(d, d, 1, out->turn, mean_a, out->shift);
  for (size_t k = 0; k < d; k++) {
    out->shift[k] = sums > 0 ? mean_y[k] - out->scale * out->shift[k] : 0;
  }
}

void blended_set_frame(blended *b, int has_scale)
{
  size_t best = 0;
  for (size_t s = 0; s < b->exemplar_count; s++) {
    fit_frame(b, s, has_scale, &b->frames[s]);
    best = b->frames[s].residual < b->frames[best].residual ? s : best;
  }
  b->frame = b->frames[best];
}

void blended_hold(blended *b, int stage, size_t first, size_t last)
{
  blended_constraints *c = &b->held;
  blended_factor *f = &c->factors[stage];
  size_t const d = b->dimension, rank = b->bases[stage].rank, block = b->group_count * d;
  const blended_frame *frame = &b->frame;
  double size = 0;
  for (size_t i = 0; i < c->row_count; i++) {
    double own[3] = {0};
    memcpy(own, c->targets + i * d, d * sizeof(double));
    dense_axpy(d, -c->sums[i], frame->shift, own);
    dense_times_transposed(d, d, 1, frame->turn, d, own, c->framed + i * d);
    for (size_t k = 0; k < d; k++) {
      c->framed[i * d + k] /= frame->scale;
      c->weighted[i * d + k] = b->beta_lc * c->weights[i] * c->framed[i * d + k];
      size += c->weighted[i * d + k] * c->framed[i * d + k];
    }
  }
  dense_times_transposed(c->row_count, rank, d, f->held, rank, c->weighted, f->z);
  dense_times((last - first) * block, rank, d, f->responses + first * block * rank, f->z, f->y + first * block * d);
  f->lost = size - dense_dot(rank * d, f->z, f->z);
}
