/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The gradient of a triangle's deformation as nine numbers that may be averaged: three of a rotation, as axis times
 * angle, and six of a stretch, as its difference to none. */
#ifndef EXM_SEQUENCE_SHAPE_SPACES_POLAR_H
#define EXM_SEQUENCE_SHAPE_SPACES_POLAR_H

/** gradient = rotation stretch; the rotation is given, stretch [6] out: xx yy zz xy xz yz of it, less 1 on the
 * diagonal. */
void polar_stretch(const double gradient[9], const double rotation[9], double stretch[6]);

/** rotation (1 + stretch) */
void polar_compose(const double rotation[9], const double stretch[6], double gradient[9]);

/** out = a b, out = a' b */
void matrix_times(const double a[9], const double b[9], double out[9]);
void matrix_transpose(const double a[9], double out[9]);
void matrix_transposed_times(const double a[9], const double b[9], double out[9]);

#endif
