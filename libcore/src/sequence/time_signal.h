/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The time signal f [SEQ, 2.3]: a cubic B-spline in the pose plane, the places of the frames on it, and the monotone
 * interpolant between frames and places. Everything is kept as differences to what is next to it [numeric/bspline.h],
 * so that an edit changes what it touches and not a bit elsewhere. */
#ifndef EXM_SEQUENCE_TIME_SIGNAL_H
#define EXM_SEQUENCE_TIME_SIGNAL_H

#include "numeric/bspline.h"

typedef struct time_signal {
  arena memory;
  bspline curve;
  size_t frame_count;  /* n */
  curve_place *places; /* [n] */
  double *steps;       /* [n] of the parameter from each frame to the next; the last one closes, or is 0 */
} time_signal;

/** Fit a curve to the frames' points [SEQ, 3.3]. control_count at most n + 2, cyclic n. */
exm_status time_signal_fit(size_t frame_count, const double (*points)[2], size_t control_count, int is_cyclic,
                           time_signal *out);

/** A curve as it was drawn, with frames at equal steps. knots: see exm_sequence_draw. */
exm_status time_signal_draw(size_t control_count, const double (*points)[2], const double *knots, int is_cyclic,
                            size_t frame_count, time_signal *out);

/** Room for a curve and frames, all zero. */
exm_status time_signal_allocate(size_t control_count, int is_cyclic, size_t frame_count, time_signal *out);

/** The place at a time, in frames, moved into 0 .. n - 1 or wrapped; speed: how fast the parameter passes there (may be
 *  NULL). */
curve_place time_signal_place(const time_signal *signal, double time, double *speed);

/** f and its derivative in time (may be NULL). */
void time_signal_evaluate(const time_signal *signal, double time, double point[2], double derivative[2]);

/** Knots [interval count + 1] from 0 at the beginning of the curve. */
void time_signal_knots(const time_signal *signal, double *knots);
/** Parameters [n] of the frames, in the same unit. */
void time_signal_parameters(const time_signal *signal, double *parameters);

void time_signal_release(time_signal *signal);

#endif
