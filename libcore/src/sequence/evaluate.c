/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "sequence/sequence.h"

/* Half the interval, in frames, over which velocities are compared for an acceleration: a thin plate has no second
 * derivative at its sites, and the time signal's own jumps at frames. */
static double const ACCELERATION_REACH = 1e-2;

/* Way, in frames, to either side of a time at which decoded shapes are compared for a velocity. */
static double const DIFFERENCE_REACH = 1e-4;

size_t signals_frame_count(const signals *fitted)
{
  const window *last = &fitted->windows[fitted->window_count - 1];
  return last->first_frame + last->time.frame_count;
}

/** The part of the way, smoothed, from the beginning of what window i shares with the one before to its end. */
static double share_of(const signals *fitted, size_t i, double time, double *slope)
{
  const window *before = &fitted->windows[i - 1], *w = &fitted->windows[i];
  double const begin = (double)w->first_frame;
  double const length = (double)(before->first_frame + before->time.frame_count - 1) - begin;
  double const part = length > 0 ? fmin(fmax((time - begin) / length, 0), 1) : (double)(time >= begin);
  *slope = length > 0 ? 6 * part * (1 - part) / length : 0;
  return part * part * (3 - 2 * part);
}

double signals_weight(const signals *fitted, size_t i, double time, double *slope)
{
  double rise_slope = 0, fall_slope = 0;
  double const rise = i > 0 ? share_of(fitted, i, time, &rise_slope) : 1;
  double const fall = i + 1 < fitted->window_count ? share_of(fitted, i + 1, time, &fall_slope) : 0;
  *slope = rise_slope - fall_slope;
  return rise - fall;
}

void sequence_coordinates(const exm_sequence *sequence, double time, double *coordinates)
{
  const signals *fitted = sequence->fitted;
  size_t const m = fitted->shape.component_count;
  double point[2], slope;
  if (fitted->window_count > 1) {
    memset(coordinates, 0, m * sizeof(double));
  }
  for (size_t i = 0; i < fitted->window_count; i++) {
    const window *w = &fitted->windows[i];
    double const weight = signals_weight(fitted, i, time, &slope);
    if (weight > 0) {
      double *values = fitted->window_count > 1 ? sequence->window_coordinates : coordinates;
      time_signal_evaluate(&w->time, time - (double)w->first_frame, point, NULL);
      thin_plate_evaluate(&w->plate, point, values);
      if (fitted->window_count > 1) {
        dense_axpy(m, weight, values, coordinates);
      }
    }
  }
}

/** Velocity of the coordinates. */
static void coordinate_velocity(const exm_sequence *sequence, double time, double *velocity)
{
  const signals *fitted = sequence->fitted;
  size_t const m = fitted->shape.component_count;
  double point[2], direction[2], slope;
  memset(velocity, 0, m * sizeof(double));
  for (size_t i = 0; i < fitted->window_count; i++) {
    const window *w = &fitted->windows[i];
    double const weight = signals_weight(fitted, i, time, &slope);
    if (weight > 0 || slope != 0) {
      time_signal_evaluate(&w->time, time - (double)w->first_frame, point, direction);
      thin_plate_derivative(&w->plate, point, direction, sequence->window_coordinates);
      dense_axpy(m, weight, sequence->window_coordinates, velocity);
      thin_plate_evaluate(&w->plate, point, sequence->window_coordinates);
      dense_axpy(m, slope, sequence->window_coordinates, velocity);
    }
  }
}

static exm_status decode(exm_sequence *sequence, const double *coordinates, double *positions)
{
  if (!sequence->space.methods) {
    pca_combine(&sequence->fitted->shape, coordinates, positions);
    return EXM_OK;
  }
  pca_combine(&sequence->fitted->shape, coordinates, sequence->encoded);
  return sequence->space.methods->decode(&sequence->space, sequence->encoded, positions);
}

static exm_status decode_single(exm_sequence *sequence, const double *coordinates, float *positions)
{
  if (!sequence->space.methods) {
    pca_combine_single(&sequence->fitted->shape, coordinates, positions);
    return EXM_OK;
  }
  TRY(decode(sequence, coordinates, sequence->positions));
  for (size_t i = 0; i < 3 * sequence->reference->vertex_count; i++) {
    positions[i] = (float)sequence->positions[i];
  }
  return EXM_OK;
}

exm_status sequence_evaluate(exm_sequence *sequence, double time, float *positions)
{
  sequence_coordinates(sequence, time, sequence->coordinates);
  return decode_single(sequence, sequence->coordinates, positions);
}

exm_status sequence_evaluate_f64(exm_sequence *sequence, double time, double *positions)
{
  sequence_coordinates(sequence, time, sequence->coordinates);
  return decode(sequence, sequence->coordinates, positions);
}

/** The derivative of positions where coordinates change at a velocity: a central difference, in double precision, along
 *  a way short enough for its error of second order. */
static exm_status decode_derivative(exm_sequence *sequence, double *coordinates, const double *velocity,
                                    double *derivative)
{
  size_t const m = sequence->fitted->shape.component_count, count = 3 * sequence->reference->vertex_count;
  dense_axpy(m, DIFFERENCE_REACH, velocity, coordinates);
  TRY(decode(sequence, coordinates, derivative));
  dense_axpy(m, -2 * DIFFERENCE_REACH, velocity, coordinates);
  TRY(decode(sequence, coordinates, sequence->positions));
  for (size_t i = 0; i < count; i++) {
    derivative[i] = (derivative[i] - sequence->positions[i]) / (2 * DIFFERENCE_REACH);
  }
  return EXM_OK;
}

/** The first derivative of the positions; `time` is one that the sequence has. */
static exm_status find_velocity(exm_sequence *sequence, double time, double *velocity)
{
  coordinate_velocity(sequence, time, sequence->more_coordinates);
  if (sequence->space.methods) {
    sequence_coordinates(sequence, time, sequence->coordinates);
    return decode_derivative(sequence, sequence->coordinates, sequence->more_coordinates, velocity);
  }
  pca_combine_linear(&sequence->fitted->shape, sequence->more_coordinates, velocity);
  return EXM_OK;
}

static exm_status find_acceleration(exm_sequence *sequence, double time, double *acceleration)
{
  int const is_cyclic = sequence->fitted->is_cyclic;
  size_t const count = 3 * sequence->reference->vertex_count;
  double const last = (double)(signals_frame_count(sequence->fitted) - 1);
  double const before = is_cyclic ? time - ACCELERATION_REACH : fmax(time - ACCELERATION_REACH, 0);
  double const after = is_cyclic ? time + ACCELERATION_REACH : fmin(time + ACCELERATION_REACH, last);
  arena scratch = {0};
  double *velocity = ARENA_NEW(&scratch, double, count);
  exm_status status = velocity ? find_velocity(sequence, before, velocity) : status_no_memory("an acceleration");
  if (status >= 0 && (status = find_velocity(sequence, after, acceleration)) >= 0) {
    for (size_t i = 0; i < count; i++) {
      acceleration[i] = (acceleration[i] - velocity[i]) / (after - before);
    }
  }
  arena_release(&scratch);
  return status;
}

exm_status sequence_derivative(exm_sequence *sequence, double time, int32_t order, double *derivative)
{
  double const last = (double)(signals_frame_count(sequence->fitted) - 1);
  if (!sequence->fitted->is_cyclic && (time < 0 || time > last)) {
    memset(derivative, 0, 3 * sequence->reference->vertex_count * sizeof(double));
    return EXM_OK;
  }
  return order == 1 ? find_velocity(sequence, time, derivative) : find_acceleration(sequence, time, derivative);
}

exm_status sequence_pose(exm_sequence *sequence, size_t w, const double point[2], float *positions)
{
  thin_plate_evaluate(&sequence->fitted->windows[w].plate, point, sequence->coordinates);
  return decode_single(sequence, sequence->coordinates, positions);
}

exm_status sequence_measure(exm_sequence *sequence, double *rms, double *largest)
{
  size_t const V = sequence->reference->vertex_count;
  arena scratch = {0};
  double *positions = ARENA_NEW(&scratch, double, 3 * V);
  exm_status status = positions ? EXM_OK : status_no_memory("a frame");
  for (size_t i = 0; i < sequence->frame_count && status >= 0; i++) {
    double sum = 0, most = 0;
    status = sequence_evaluate_f64(sequence, (double)i, positions);
    for (size_t v = 0; v < V; v++) {
      double squared = 0;
      for (size_t k = 0; k < 3; k++) {
        double const difference = positions[3 * v + k] - (double)sequence->frames[i][3 * v + k];
        squared += difference * difference;
      }
      sum += squared;
      most = fmax(most, squared);
    }
    if (rms) {
      rms[i] = sqrt(sum / (double)V) / sequence->fitted->diagonal;
    }
    if (largest) {
      largest[i] = sqrt(most) / sequence->fitted->diagonal;
    }
  }
  arena_release(&scratch);
  return status;
}
