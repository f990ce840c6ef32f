/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rotations of space as vectors: the axis times the angle. */
#ifndef EXM_LINALG_ROTATION_LOG_H
#define EXM_LINALG_ROTATION_LOG_H

/** The rotation [3][3] about `vector` by its length. */
void rotation_exp(const double vector[3], double rotation[9]);

/** A vector whose rotation is the given one: of the many, whose lengths differ by full turns, the one closest to
 * `like`. Continuous in the rotation but where it is none (a full number of turns) and `like` is some turns away. */
void rotation_log(const double rotation[9], const double like[3], double vector[3]);

#endif
