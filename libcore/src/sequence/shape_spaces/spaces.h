/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The shape spaces there are, one a file. */
#ifndef EXM_SEQUENCE_SHAPE_SPACES_SPACES_H
#define EXM_SEQUENCE_SHAPE_SPACES_SPACES_H

#include "sequence/shape_space.h"

extern const shape_space_methods shape_space_gradients;
extern const shape_space_methods shape_space_linear_rotation_invariant;
extern const shape_space_methods shape_space_lengths_angles;
extern const shape_space_methods shape_space_patches;

#endif
