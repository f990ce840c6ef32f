/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Frames that are known by their turns to each other [Lipman et al. 2005, the first of their two linear systems]:
 *
 *   min over B_0 .. B_{n-1} in R^{3x3} of  sum over links (a, b) of |B_b - B_a R_ab|^2,
 *
 * with one frame of every part given. Turns that agree with each other give frames that they come from; others give a
 * compromise, made rotations at the end. The rows of all the B are independent of each other: one factorisation of a
 * matrix of 3 n rows, three right-hand sides. */
#ifndef EXM_SEQUENCE_SHAPE_SPACES_FRAME_GRAPH_H
#define EXM_SEQUENCE_SHAPE_SPACES_FRAME_GRAPH_H

#include "linalg/cholesky.h"

typedef struct frame_graph {
  size_t node_count, link_count, part_count;
  uint32_t (*links)[2]; /* [links] a, b */
  uint32_t *parts;      /* [n] numbered by their lowest node */
  uint32_t *anchors;    /* [parts] that node */
  double (*rests)[9];   /* [parts] the anchors' frames in the reference: what their turns are told against */
  double (*turns)[9];   /* [links] R_ab, filled in before solving */
  double (*frames)[9];  /* [n] out; of the anchors in as well */
  cholesky *factor;     /* of the last turns; its pattern is what stays */
  double *rows;         /* [3 n][3] scratch */
} frame_graph;

/** links [count][2] are copied. Release the graph whether or not it could be created. */
exm_status frame_graph_create(arena *owner, size_t node_count, size_t link_count, const uint32_t (*links)[2],
                              frame_graph *out);
void frame_graph_release(frame_graph *graph);

/** Take the anchors' frames of now for those of the reference. Until then the world's axes are. */
void frame_graph_rest(frame_graph *graph);

/** The anchors' frames, against the reference's, as scaled logarithms [parts][3], close to those in `like` where it is
 * given; and back. */
void frame_graph_put_anchors(const frame_graph *graph, double scale, const double *like, double *coordinates);
void frame_graph_take_anchors(frame_graph *graph, double scale, const double *coordinates);

/** graph->turns and the anchors' graph->frames -> graph->frames. */
exm_status frame_graph_solve(frame_graph *graph);

#endif
