/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_SEQUENCE_ROWS_H
#define EXM_SEQUENCE_ROWS_H

#include "base/progress.h"
#include "sequence/shape_space.h"

/**
 * Frames as coordinates of a shape space, in single precision. Where coordinates are not unique, each frame's are those
 * closest to the frame before.
 *
 * frames  [count] of [V][3]
 * rows    out, [count] of [d]: the frames themselves in the space of positions
 */
exm_status rows_encode(arena *owner, shape_space *space, size_t count, const float *const *frames,
                       const progress *report, const float *const **rows);

/** Poses that lie behind each other, [count][V][3], as a list of frames. */
exm_status rows_of_array(arena *owner, size_t count, size_t vertex_count, const float *poses,
                         const float *const **frames);

#endif
