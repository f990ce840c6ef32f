/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/stress.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/simd.h"
#include "numeric/anderson.h"

/* A layout has settled when a step moves the points by this share of their spread (both in the mean square). */
static double const SETTLED = 1e-5;

enum { MOST_ITERATIONS = 1000, DEPTH = 6 };

typedef struct layout {
  size_t count, pinned_count;
  const double *distances;
  const uint8_t *pinned;
  double *x, *y; /* [n] coordinates apart: what vector instructions want */
} layout;

/** Sum over j of d_ij / |p_i - p_j| (p_i - p_j), and point i's share of the stress (each pair is met twice). */
SIMD_CLONES static double pull(const layout *l, size_t i, double out[2])
{
  const double *row = l->distances + i * l->count;
  double const px = l->x[i], py = l->y[i];
  double fx = 0, fy = 0, stress = 0;
#pragma omp simd reduction(+ : fx, fy, stress)
  for (size_t j = 0; j < l->count; j++) {
    double const dx = px - l->x[j], dy = py - l->y[j];
    double const length = sqrt(dx * dx + dy * dy);
    double const ratio = row[j] / (length + 1e-300); /* coinciding points do not pull: dx and dy are 0 */
    fx += ratio * dx;
    fy += ratio * dy;
    stress += (length - row[j]) * (length - row[j]);
  }
  out[0] = fx;
  out[1] = fy;
  return stress;
}

/**
 * One step of the majorisation: points -> image; gives the stress of `points`.
 *
 * The majoriser is quadratic with V = n I - 1 1' (each pair counts once). With free points f and pinned ones c,
 * V_ff p_f = (B p)_f + 1 sum_c p_c, and V_ff^-1 = (I + 1 1' / |c|) / n; without pins V^+ = I / n on centred points.
 */
static double step(layout *l, const double (*points)[2], double (*image)[2])
{
  size_t const n = l->count;
  double stress = 0, free_sum[2] = {0}, held_sum[2] = {0};
  for (size_t i = 0; i < n; i++) {
    l->x[i] = points[i][0];
    l->y[i] = points[i][1];
  }
  for (size_t i = 0; i < n; i++) {
    int const is_held = l->pinned && l->pinned[i];
    stress += pull(l, i, image[i]);
    for (int k = 0; k < 2; k++) {
      free_sum[k] += is_held ? 0 : image[i][k];
      held_sum[k] += is_held ? points[i][k] : 0;
    }
  }
  size_t const held = l->pinned_count, free_count = n - held;
  for (size_t i = 0; i < n; i++) {
    for (int k = 0; k < 2; k++) {
      double const right = image[i][k] + held_sum[k];
      double const sum = held ? (free_sum[k] + (double)free_count * held_sum[k]) / (double)held : 0;
      image[i][k] = l->pinned && l->pinned[i] ? points[i][k] : (right + sum) / (double)n;
    }
  }
  return stress / 2;
}

/** Squared movement over squared spread. */
static double movement(size_t n, const double (*points)[2], const double (*image)[2])
{
  double moved = 0, spread = 0, mean[2] = {0};
  for (size_t i = 0; i < n; i++) {
    mean[0] += image[i][0] / (double)n;
    mean[1] += image[i][1] / (double)n;
  }
  for (size_t i = 0; i < n; i++) {
    for (int k = 0; k < 2; k++) {
      moved += (image[i][k] - points[i][k]) * (image[i][k] - points[i][k]);
      spread += (image[i][k] - mean[k]) * (image[i][k] - mean[k]);
    }
  }
  return spread > 0 ? moved / spread : 0;
}

static exm_status iterate(layout *l, size_t most, const progress *report, anderson *mixing, double (*points)[2],
                          double (*image)[2], double (*safe)[2], double *stress)
{
  size_t const bytes = l->count * sizeof *points;
  double best = INFINITY;
  for (size_t i = 0; i < most; i++) {
    TRY(progress_report(report, (double)i / (double)most, "placing frames"));
    double now = step(l, (const double(*)[2])points, image);
    if (now > best) { /* the mixed point is worse than the one it replaced: back to that, and on without memory */
      memcpy(points, safe, bytes);
      anderson_reset(mixing);
      now = step(l, (const double(*)[2])points, image);
    }
    best = now;
    if (movement(l->count, (const double(*)[2])points, (const double(*)[2])image) <= SETTLED * SETTLED) {
      break;
    }
    memcpy(safe, image, bytes);
    anderson_mix(mixing, &image[0][0], &points[0][0]);
  }
  /* The last step is a plain one: it never raises the stress, and leaves `image` as the result. */
  (void)step(l, (const double(*)[2])points, image);
  memcpy(points, image, bytes);
  *stress = step(l, (const double(*)[2])points, image);
  return EXM_OK;
}

exm_status stress_majorise(size_t count, const double *distances, const uint8_t *pinned, size_t iterations,
                           const progress *report, double (*points)[2], double *stress)
{
  arena scratch = {0};
  layout l = {.count = count, .distances = distances, .pinned = pinned};
  anderson mixing = {0};
  for (size_t i = 0; pinned && i < count; i++) {
    l.pinned_count += pinned[i];
  }
  l.x = ARENA_NEW(&scratch, double, count);
  l.y = ARENA_NEW(&scratch, double, count);
  double(*image)[2] = arena_array(&scratch, count, sizeof *image);
  double(*safe)[2] = arena_array(&scratch, count, sizeof *safe);
  double(*moving)[2] = arena_array(&scratch, count, sizeof *moving);
  exm_status status = l.x && l.y && image && safe && moving ? EXM_OK : status_no_memory("the layout of the frames");
  if (status >= 0 && (status = anderson_create(&scratch, 2 * count, DEPTH, &mixing)) >= 0) {
    memcpy(moving, points, count * sizeof *points);
    status = iterate(&l, iterations ? iterations : MOST_ITERATIONS, report, &mixing, moving, image, safe, stress);
  }
  if (status >= 0) {
    memcpy(points, moving, count * sizeof *points);
  }
  arena_release(&scratch);
  return status;
}
