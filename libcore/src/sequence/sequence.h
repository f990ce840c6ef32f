/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A deforming mesh sequence and its three signals [SEQ]. */
#ifndef EXM_SEQUENCE_SEQUENCE_H
#define EXM_SEQUENCE_SEQUENCE_H

#include "base/progress.h"
#include "numeric/pca.h"
#include "numeric/thin_plate.h"
#include "sequence/shape_space.h"
#include "sequence/time_signal.h"

/* Weight of poses that were added, beside the frames' 1: the pose signal passes through them as exactly as it is large.
 */
static double const ADDED_POSE_WEIGHT = 1e5;

/** Pose and time signals of some of the frames. */
typedef struct window {
  arena memory; /* of everything here but the time signal, which comes and goes with edits */
  size_t first_frame;
  size_t fitted_count;    /* n of the fit: frames, then poses that were added */
  size_t timed_count;     /* the frames among them, which the time signal was fitted to */
  double (*positions)[2]; /* [n] p_i */
  uint8_t *pinned;        /* [n] */
  uint32_t *sites;        /* [l] numbers of the frames they are at */
  thin_plate plate;       /* values: coordinates in the shape signal */
  time_signal time;
} window;

typedef struct signals {
  arena memory; /* of the shape signal and the list of windows */
  pca shape;
  int is_cyclic;
  double diagonal; /* of the mesh */
  double unit;     /* of the pose plane over distances of coordinates */
  size_t window_count;
  window *windows;
} signals;

struct exm_sequence {
  mesh *reference;
  int32_t kind;
  shape_space space;
  float **frames; /* [frame_count] of [V][3], each its own */
  size_t frame_count, frame_capacity;
  signals *fitted;
  double *coordinates, *more_coordinates, *window_coordinates; /* [m] scratch of evaluation */
  double *encoded, *positions; /* [d], [3 V] scratch of shape spaces that are decoded; NULL for positions */
};

exm_status sequence_create(const mesh *reference, int32_t kind, exm_sequence **out);
exm_status sequence_add_frame(exm_sequence *sequence, const float *positions);
void sequence_drop_frames(exm_sequence *sequence);
void sequence_destroy(exm_sequence *sequence);

/** Put signals in the place of others; allocates what evaluation needs. On failure nothing has changed. */
exm_status sequence_adopt(exm_sequence *sequence, signals *fitted);
void signals_release(signals *fitted);
void window_release(window *w);

/** How much of window i's shape there is at a time, and how fast that changes: 0 but for two neighbours at most, which
 *  share by a cubic that rises and falls without a corner. */
double signals_weight(const signals *fitted, size_t i, double time, double *slope);

/* ------------------------------------------------------------------------------------------------------------- fit */

exm_status sequence_fit(exm_sequence *sequence, const exm_sequence_fit_settings *settings, const progress *report,
                        exm_sequence_fit_report *found);
exm_status sequence_place(exm_sequence *sequence, const exm_pins *pins, int32_t iterations,
                          exm_sequence_fit_report *found);

typedef struct window_request {
  const signals *fitted; /* the shape signal */
  size_t first_frame, count;
  const double *stretch;            /* [count][count] of the wanted distances; NULL: 1 */
  const exm_pins *pins;             /* of the whole sequence */
  const double (*start)[2];         /* [count] where the scaling begins; NULL: at the first two components */
  size_t iterations;                /* of the scaling; 0: until it has settled */
  size_t timed_count;               /* frames that the time signal is for: the first ones */
  size_t site_count, control_count; /* 0: by `limit` */
  double pose_limit, limit;         /* of the sum of squares that g, and that f and g, may leave */
} window_request;

typedef struct window_errors {
  double pose, time, stress, distances; /* sums of squares */
} window_errors;

exm_status window_fit(const window_request *request, const progress *report, window *out, window_errors *errors);

/** How violently a window's motion changes between frames. */
typedef struct window_unrest {
  size_t saddle_count; /* intervals in whose middle the surface bends one way along the curve, and the other across */
  double acceleration; /* the largest of the coordinates, per frame squared */
  size_t interval;     /* where that is */
} window_unrest;

exm_status window_judge(const window *w, window_unrest *out);
/** Try other layouts of a window that was fitted to this request, and keep the calmest. */
exm_status window_cure(const window_request *request, const progress *report, window *w, window_errors *errors);

/** Unit of the pose plane over distances of coordinates. */
double plane_unit(const exm_sequence *sequence);

/* ------------------------------------------------------------------------------------------------------ evaluation */

/** Coordinates [m] of the shape at a time. */
void sequence_coordinates(const exm_sequence *sequence, double time, double *coordinates);
exm_status sequence_evaluate(exm_sequence *sequence, double time, float *positions);
exm_status sequence_evaluate_f64(exm_sequence *sequence, double time, double *positions);
exm_status sequence_derivative(exm_sequence *sequence, double time, int32_t order, double *derivative);
exm_status sequence_pose(exm_sequence *sequence, size_t w, const double point[2], float *positions);
exm_status sequence_measure(exm_sequence *sequence, double *rms, double *largest);

/** n of the time signals together: times are 0 .. n - 1, cyclic 0 .. n. */
size_t signals_frame_count(const signals *fitted);

/* ----------------------------------------------------------------------------------------------------------- edits */

exm_status window_insert_control_point(window *w, size_t index, const double *point);
exm_status window_delete_control_point(window *w, size_t index);
exm_status window_resample(window *w, size_t count, const double *times);
/** Spans first + 1 .. last once more, `times` times. */
exm_status window_loop(window *w, size_t first, size_t last, size_t times);

struct shape_map; /* sequence/shape_signal.h */
/** The same pose and time signals in other coordinates. */
exm_status signals_map(const signals *from, const struct shape_map *map, signals *to);
exm_status sequence_transfer(exm_sequence *sequence, const float *source_examples, const mesh *target, int32_t kind,
                             const float *target_examples, size_t count, exm_sequence **out);
exm_status sequence_add_pose(exm_sequence *sequence, const float *positions, const double point[2]);

/* ----------------------------------------------------------------------------------------------------------- files */

exm_status sequence_save(const exm_sequence *sequence, const char *path, exm_sequence_file_report *report);
exm_status sequence_load(const char *path, exm_sequence_file_report *report, exm_sequence **out);

#endif
