/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "sequence/sequence.h"

/* Half the interval, in frames, over which velocities are compared for an acceleration: a thin plate has no second
 * derivative at its sites, and the time signal's own jumps at frames. */
static double const ACCELERATION_REACH = 1e-2;

size_t signals_frame_count(const signals *fitted)
{
  const window *last = &fitted->windows[fitted->window_count - 1];
  return last->first_frame + last->time.frame_count;
}

void sequence_coordinates(const exm_sequence *sequence, double time, double *coordinates)
{
  double point[2];
  const window *w = &sequence->fitted->windows[0];
  time_signal_evaluate(&w->time, time, point, NULL);
  thin_plate_evaluate(&w->plate, point, coordinates);
}

/** Velocity of the coordinates. */
static void coordinate_velocity(const exm_sequence *sequence, double time, double *velocity)
{
  double point[2], direction[2];
  const window *w = &sequence->fitted->windows[0];
  time_signal_evaluate(&w->time, time, point, direction);
  thin_plate_derivative(&w->plate, point, direction, velocity);
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

exm_status sequence_derivative(exm_sequence *sequence, double time, int32_t order, double *derivative)
{
  size_t const m = sequence->fitted->shape.component_count;
  double *velocity = sequence->more_coordinates;
  coordinate_velocity(sequence, time, velocity);
  if (order == 2) {
    double const last = (double)(signals_frame_count(sequence->fitted) - 1);
    int const is_held = !sequence->fitted->is_cyclic && (time < 0 || time > last);
    double const reach = is_held ? 0 : ACCELERATION_REACH;
    double const before = sequence->fitted->is_cyclic ? time - reach : fmax(time - reach, 0);
    double const after = sequence->fitted->is_cyclic ? time + reach : fmin(time + reach, last);
    coordinate_velocity(sequence, after, velocity);
    coordinate_velocity(sequence, before, sequence->coordinates);
    for (size_t k = 0; k < m; k++) {
      velocity[k] = reach > 0 ? (velocity[k] - sequence->coordinates[k]) / (after - before) : 0;
    }
  }
  pca_combine_linear(&sequence->fitted->shape, velocity, derivative);
  return EXM_OK;
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
