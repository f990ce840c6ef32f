/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Saddles of the pose signal [SEQ, 3.2.1, figure 3, and section 6]. Scaling knows nothing of the frames' order: where
 * it puts poses that follow each other next to others that do not, a surface through all of them must bend one way
 * along the curve and the other way across it, and the motion bulges between frames. The paper asks a user to move
 * frames by hand. Here the frames at the worst bulge are kept further from those that they were squeezed against: their
 * wanted distances grow, the layout relaxes, and what moves least violently is kept. */
#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "sequence/sequence.h"

/* Layouts that are tried, and how much further apart frames are wanted in each. */
enum { MOST_ROUNDS = 24, CLOSEST = 6, SAMPLES = 4 };
static double const STRETCH = 1.3;

/* A bulge counts as a saddle from this share of the way between its two frames on. */
static double const SMALLEST_BULGE = 0.1;

static size_t interval_count(const window *w)
{
  return w->time.curve.is_cyclic ? w->time.frame_count : w->time.frame_count - 1;
}

static void coordinates_at(const window *w, double time, double *values)
{
  double point[2];
  time_signal_evaluate(&w->time, time, point, NULL);
  thin_plate_evaluate(&w->plate, point, values);
}

/** The largest second difference of the coordinates within an interval, per frame squared. scratch [3][m] */
static double interval_acceleration(const window *w, size_t i, double *scratch)
{
  size_t const m = w->plate.value_count;
  double const step = 1.0 / SAMPLES;
  double most = 0;
  for (size_t s = 0; s <= SAMPLES; s++) { /* three in a row are kept */
    coordinates_at(w, (double)i + step * (double)s, scratch + s % 3 * m);
    double sum = 0;
    for (size_t k = 0; k < m && s >= 2; k++) {
      double const second = scratch[s % 3 * m + k] - 2 * scratch[(s + 2) % 3 * m + k] + scratch[(s + 1) % 3 * m + k];
      sum += second * second;
    }
    most = fmax(most, sqrt(sum) / (step * step));
  }
  return most;
}

/** Does the surface bend one way along the curve and the other across it, in the middle of an interval? */
static int is_saddle(const window *w, size_t i, double *scratch)
{
  size_t const m = w->plate.value_count;
  double *along = scratch, *across = scratch + m, *slope = scratch + 2 * m;
  double point[2], speed[2];
  time_signal_evaluate(&w->time, (double)i + 0.5, point, speed);
  double const length = hypot(speed[0], speed[1]);
  if (!(length > 0)) {
    return 0;
  }
  double const direction[2] = {speed[0] / length, speed[1] / length};
  thin_plate_derivative(&w->plate, point, direction, slope);
  thin_plate_curvature(&w->plate, point, direction, along, across);
  double const bulge = sqrt(dense_dot(m, along, along)) * length / 8, way = sqrt(dense_dot(m, slope, slope));
  return dense_dot(m, along, across) < 0 && bulge > SMALLEST_BULGE * way;
}

exm_status window_judge(const window *w, window_unrest *out)
{
  arena scratch = {0};
  double *values = ARENA_NEW(&scratch, double, 3 * w->plate.value_count);
  if (!values) {
    return status_no_memory("the saddles");
  }
  *out = (window_unrest){0};
  for (size_t i = 0; i < interval_count(w); i++) {
    double const acceleration = interval_acceleration(w, i, values);
    out->saddle_count += (size_t)is_saddle(w, i, values);
    if (acceleration > out->acceleration) {
      out->acceleration = acceleration;
      out->interval = i;
    }
  }
  arena_release(&scratch);
  return EXM_OK;
}

/** Want frame a further away from the few frames that are closest to it in the plane and do not follow it. */
static void push_away(const window *w, size_t a, size_t interval, double *stretch, uint8_t *is_done)
{
  size_t const n = w->fitted_count;
  memset(is_done, 0, n);
  for (int round = 0; round < CLOSEST; round++) {
    size_t closest = n;
    double least = INFINITY;
    for (size_t j = 0; j < w->timed_count; j++) {
      double const dx = w->positions[a][0] - w->positions[j][0], dy = w->positions[a][1] - w->positions[j][1];
      int const follows = j + 1 >= interval && j <= interval + 2;
      if (!follows && !is_done[j] && dx * dx + dy * dy < least) {
        least = dx * dx + dy * dy;
        closest = j;
      }
    }
    if (closest == n) {
      return;
    }
    is_done[closest] = 1;
    stretch[a * n + closest] *= STRETCH;
    stretch[closest * n + a] = stretch[a * n + closest];
  }
}

static exm_status try_rounds(const window_request *request, arena *scratch, const progress *report, window *best,
                             window_errors *errors, window_unrest *unrest)
{
  size_t const n = best->fitted_count;
  double *stretch = ARENA_NEW(scratch, double, n *n);
  double(*places)[2] = arena_array(scratch, n, sizeof *places);
  uint8_t *is_done = ARENA_NEW(scratch, uint8_t, n);
  window_unrest now = *unrest;
  if (!stretch || !places || !is_done) {
    return status_no_memory("the saddles");
  }
  for (size_t i = 0; i < n * n; i++) {
    stretch[i] = 1;
  }
  memcpy(places, best->positions, n * sizeof *places);
  window_request again = *request;
  again.start = (const double(*)[2])places;
  again.stretch = stretch;
  again.site_count = request->site_count ? request->site_count : best->plate.site_count;
  again.control_count = best->time.curve.control_count;
  window current = *best; /* not owned here: what was tried last, or the best */
  for (int round = 0; round < MOST_ROUNDS; round++) {
    window fresh;
    window_errors left = {0};
    TRY(progress_report(report, (double)round / MOST_ROUNDS, "curing saddles"));
    push_away(&current, now.interval, now.interval, stretch, is_done);
    push_away(&current, (now.interval + 1) % best->timed_count, now.interval, stretch, is_done);
    TRY(window_fit(&again, NULL, &fresh, &left));
    exm_status const status = window_judge(&fresh, &now);
    if (status < 0) {
      window_release(&fresh);
      return status;
    }
    memcpy(places, fresh.positions, n * sizeof *places);
    if (now.acceleration < unrest->acceleration) {
      window_release(best);
      *best = fresh;
      *errors = left;
      *unrest = now;
      current = fresh;
    } else {
      window_release(&fresh);
      memcpy(places, best->positions, n * sizeof *places);
      current = *best;
    }
  }
  return EXM_OK;
}

exm_status window_cure(const window_request *request, const progress *report, window *w, window_errors *errors)
{
  arena scratch = {0};
  window_unrest unrest;
  exm_status status = window_judge(w, &unrest);
  if (status >= 0) {
    status = try_rounds(request, &scratch, report, w, errors, &unrest);
  }
  arena_release(&scratch);
  return status;
}
