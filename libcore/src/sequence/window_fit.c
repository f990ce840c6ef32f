/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Pose and time signals of a window of frames, given their coordinates in the shape signal [SEQ, 3.2 and 3.3]. */
#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "numeric/stress.h"
#include "sequence/sequence.h"

/** Distances between the frames' coordinates, in the unit of the plane. */
static void find_distances(const window_request *request, double *distances)
{
  const pca *shape = &request->fitted->shape;
  size_t const n = request->count, m = shape->component_count;
  const double *x = shape->coordinates + request->first_frame * m;
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < i; j++) {
      double sum = 0;
      for (size_t k = 0; k < m; k++) {
        double const difference = x[i * m + k] - x[j * m + k];
        sum += difference * difference;
      }
      double const stretch = request->stretch ? request->stretch[i * n + j] : 1;
      distances[i * n + j] = distances[j * n + i] = stretch * request->fitted->unit * sqrt(sum);
    }
  }
}

static exm_status set_pins(const window_request *request, const double *distances, window *w)
{
  size_t const n = request->count;
  for (size_t i = 0; i < request->pins->count; i++) {
    size_t const frame = request->pins->frames[i] - request->first_frame;
    if (request->pins->frames[i] < request->first_frame || frame >= n) {
      continue;
    }
    for (size_t j = 0; j < n; j++) {
      const double *given = request->pins->positions + 2 * i, *other = w->positions[j];
      if (w->pinned[j] && given[0] == other[0] && given[1] == other[1] && distances[frame * n + j] > 0) {
        return status_set(EXM_ERROR_ARGUMENT, "pins: frames %zu and %zu are held at one point, but differ in shape",
                          j + request->first_frame, frame + request->first_frame);
      }
    }
    w->pinned[frame] = 1;
    memcpy(w->positions[frame], request->pins->positions + 2 * i, 2 * sizeof(double));
  }
  return EXM_OK;
}

static void mean_of_pinned(const window *w, const double (*points)[2], double mean[2], double *count)
{
  mean[0] = mean[1] = *count = 0;
  for (size_t i = 0; i < w->fitted_count; i++) {
    if (w->pinned[i]) {
      mean[0] += points[i][0];
      mean[1] += points[i][1];
      *count += 1;
    }
  }
  for (int k = 0; k < 2; k++) {
    mean[k] = *count > 0 ? mean[k] / *count : 0;
  }
}

/** Move the free points of `from` so that the pinned ones come to lie on their pins as well as a turn, a reflection and
 *  a shift allow: a layout that is right but for these would else have to unfold through its own mirror image. */
static void align_to_pins(const double (*from)[2], window *w)
{
  double source[2], target[2], count, same[2] = {0}, mirrored[2] = {0};
  mean_of_pinned(w, from, source, &count);
  mean_of_pinned(w, (const double(*)[2])w->positions, target, &count);
  for (size_t i = 0; i < w->fitted_count; i++) {
    if (w->pinned[i]) {
      double const a = from[i][0] - source[0], b = from[i][1] - source[1];
      double const x = w->positions[i][0] - target[0], y = w->positions[i][1] - target[1];
      same[0] += a * x + b * y; /* conj(a + ib)(x + iy), summed: the turn that fits best is its direction */
      same[1] += a * y - b * x;
      mirrored[0] += a * x - b * y; /* the same for a - ib */
      mirrored[1] += a * y + b * x;
    }
  }
  double const flip = hypot(mirrored[0], mirrored[1]) > 1.000001 * hypot(same[0], same[1]) ? -1 : 1;
  const double *turn = flip < 0 ? mirrored : same;
  double const length = hypot(turn[0], turn[1]);
  double const cosine = length > 0 ? turn[0] / length : 1, sine = length > 0 ? turn[1] / length : 0;
  for (size_t i = 0; i < w->fitted_count; i++) {
    if (!w->pinned[i]) {
      double const a = from[i][0] - source[0], b = flip * (from[i][1] - source[1]);
      w->positions[i][0] = target[0] + cosine * a - sine * b;
      w->positions[i][1] = target[1] + sine * a + cosine * b;
    }
  }
}

/** [SEQ, 3.2.1] */
static exm_status place_frames(const window_request *request, arena *scratch, const progress *report, window *w,
                               window_errors *errors)
{
  const pca *shape = &request->fitted->shape;
  size_t const n = request->count, m = shape->component_count;
  double *distances = ARENA_NEW(scratch, double, n *n);
  double(*start)[2] = arena_array(scratch, n, sizeof *start);
  double stress = 0;
  if (!distances || !start) {
    return status_no_memory("the layout of the frames");
  }
  find_distances(request, distances);
  for (size_t i = 0; i < n; i++) {
    const double *x = shape->coordinates + (request->first_frame + i) * m;
    for (size_t k = 0; k < 2; k++) {
      start[i][k] = request->start ? request->start[i][k] : k < m ? request->fitted->unit * x[k] : 0;
    }
  }
  TRY(set_pins(request, distances, w));
  for (size_t i = request->timed_count; i < n && request->start; i++) { /* added poses stay unless they are moved */
    memcpy(w->positions[i], w->pinned[i] ? w->positions[i] : start[i], sizeof *start);
    w->pinned[i] = 1;
  }
  if (request->start) {
    for (size_t i = 0; i < n; i++) {
      memcpy(w->positions[i], w->pinned[i] ? w->positions[i] : start[i], sizeof *start);
    }
  } else {
    align_to_pins((const double(*)[2])start, w);
  }
  TRY(stress_majorise(n, distances, w->pinned, request->iterations, report, w->positions, &stress));
  errors->stress += stress;
  for (size_t i = 0; i < n; i++) {
    errors->distances += dense_dot(i, distances + i * n, distances + i * n);
  }
  return EXM_OK;
}

/** Sum of squares that f and g together leave: |x_i - g(f(t_i))|^2. */
static double squared_error(const window_request *request, const window *w, double *values)
{
  size_t const m = w->plate.value_count;
  const double *x = request->fitted->shape.coordinates + request->first_frame * m;
  double sum = 0;
  for (size_t i = 0; i < request->timed_count; i++) {
    double point[2];
    bspline_evaluate(&w->time.curve, w->time.places[i], point, NULL);
    thin_plate_evaluate(&w->plate, point, values);
    for (size_t k = 0; k < m; k++) {
      sum += (x[i * m + k] - values[k]) * (x[i * m + k] - values[k]);
    }
  }
  return sum;
}

static exm_status try_curve(const window_request *request, size_t control_count, double *values, window *w,
                            double *error)
{
  time_signal_release(&w->time);
  TRY(time_signal_fit(w->timed_count, (const double(*)[2])w->positions, control_count, request->fitted->is_cyclic,
                      &w->time));
  *error = squared_error(request, w, values);
  return EXM_OK;
}

/** [SEQ, 3.3]; the number of control points by bisection where it is left to the tolerance. */
static exm_status fit_curve(const window_request *request, arena *scratch, window *w, window_errors *errors)
{
  size_t const n = request->timed_count, most = request->fitted->is_cyclic ? n : n + 2;
  double *values = ARENA_NEW(scratch, double, w->plate.value_count);
  if (!values) {
    return status_no_memory("the time signal");
  }
  if (request->control_count) {
    size_t const wanted = request->control_count < most ? request->control_count : most;
    return try_curve(request, wanted, values, w, &errors->time);
  }
  size_t low = 4, high = most; /* `high` is good enough, or all there is; below `low` nothing is */
  while (low < high) {
    size_t const middle = low + (high - low) / 2;
    TRY(try_curve(request, middle, values, w, &errors->time));
    if (errors->time <= request->limit) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return try_curve(request, high, values, w, &errors->time);
}

static exm_status fit(const window_request *request, arena *scratch, const progress *report, window *w,
                      window_errors *errors)
{
  const pca *shape = &request->fitted->shape;
  progress const placing = progress_part(report, 0, 0.4), choosing = progress_part(report, 0.4, 0.8);
  size_t const n = request->count;
  w->positions = arena_array(&w->memory, n, sizeof *w->positions);
  w->pinned = ARENA_NEW(&w->memory, uint8_t, n);
  w->sites = ARENA_NEW(&w->memory, uint32_t, n);
  if (!w->positions || !w->pinned || !w->sites) {
    return status_no_memory("the pose signal");
  }
  double *weights = n > request->timed_count ? ARENA_NEW(scratch, double, n) : NULL;
  if (n > request->timed_count && !weights) {
    return status_no_memory("the pose signal");
  }
  for (size_t i = 0; weights && i < n; i++) {
    weights[i] = i < request->timed_count ? 1 : ADDED_POSE_WEIGHT;
  }
  TRY(place_frames(request, scratch, &placing, w, errors));
  thin_plate_request const plate = {.point_count = n,
                                    .value_count = shape->component_count,
                                    .points = (const double(*)[2])w->positions,
                                    .values = shape->coordinates + request->first_frame * shape->component_count,
                                    .weights = weights,
                                    .site_count = request->site_count < n ? request->site_count : n,
                                    .limit = request->pose_limit,
                                    .order = w->sites};
  TRY(thin_plate_fit(&w->memory, &plate, &choosing, &w->plate, &errors->pose));
  TRY(progress_report(report, 0.8, "fitting the curve"));
  return fit_curve(request, scratch, w, errors);
}

exm_status window_fit(const window_request *request, const progress *report, window *out, window_errors *errors)
{
  arena scratch = {0};
  window w = {.first_frame = request->first_frame, .fitted_count = request->count, .timed_count = request->timed_count};
  exm_status const status = fit(request, &scratch, report, &w, errors);
  arena_release(&scratch);
  if (status < 0) {
    window_release(&w);
    return status;
  }
  *out = w;
  return EXM_OK;
}
