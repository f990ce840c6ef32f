/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The rotations of local steps: for each matrix M the rotation R that maximises sum_ij R_ij M_ij, which is the closest
 * one in the Frobenius norm. Defined for every input: inverted matrices give a proper rotation; where the closest
 * rotation is not unique (rank deficiency, some reflections) it is the one of smallest turn, so that the zero matrix
 * gives the identity; matrices that are not finite give the identity. The scale of a matrix does not matter. */
#ifndef EXM_LINALG_ROTATION_H
#define EXM_LINALG_ROTATION_H

#include <stddef.h>

/** matrices, rotations  [count][3][3] row-major; they may be the same array. */
void rotation_fit3(size_t count, const double *matrices, double *rotations);

/** matrices, rotations  [count][2][2] row-major; they may be the same array. */
void rotation_fit2(size_t count, const double *matrices, double *rotations);

/** Either, by the dimension: 2 or 3. */
void rotation_fit(size_t dimension, size_t count, const double *matrices, double *rotations);

#endif
