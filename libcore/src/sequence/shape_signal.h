/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The shape signal h [SEQ, 3.1 and 4.3]. */
#ifndef EXM_SEQUENCE_SHAPE_SIGNAL_H
#define EXM_SEQUENCE_SHAPE_SIGNAL_H

#include "sequence/rows.h"
#include "sequence/sequence.h"

typedef struct shape_request {
  shape_space *space;
  size_t frame_count;
  const float *const *frames;
  const float *examples; /* [example_count][V][3] that span the signal; NULL: principal components of the frames */
  size_t example_count;
  size_t component_count; /* of the frames; 0: by `limit` */
  double limit;           /* of the sum of squares that may be left */
} shape_request;

exm_status shape_signal_fit(arena *owner, const shape_request *request, const progress *report, pca *out);

/**
 * An affine map of coordinates, x -> A x + b, from a signal to one that has matched examples in the place of its own
 * [SEQ, 4.3].
 */
typedef struct shape_map {
  size_t from, to;  /* components */
  double *linear;   /* [to][from] */
  double *constant; /* [to] */
} shape_map;

/**
 * The signal that the target's examples span, and the map to it. A shape is written as q_0 + sum_j x_j (q_j - q_0) as
 * well as the source's examples can, and shown as r_0 + sum_j x_j (r_j - r_0).
 *
 * source_examples, target_examples  [count][V][3], [count][V'][3]
 */
exm_status shape_signal_transfer(arena *owner, const pca *source, shape_space *source_space,
                                 const float *source_examples, shape_space *target_space, const float *target_examples,
                                 size_t count, pca *target, shape_map *map);

#endif
