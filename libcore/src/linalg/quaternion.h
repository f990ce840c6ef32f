/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Unit quaternions (w, x, y, z) and the curves of rotations that are made of them. */
#ifndef EXM_LINALG_QUATERNION_H
#define EXM_LINALG_QUATERNION_H

/** Of a rotation, row-major [3][3]. */
void quaternion_from_rotation(const double rotation[9], double q[4]);
void quaternion_to_rotation(const double q[4], double rotation[9]);

/** out = a b */
void quaternion_multiply(const double a[4], const double b[4], double out[4]);

/** The shortest turn from a to b, as axis times angle in the frame of a: b = a exp(out). */
void quaternion_turn(const double a[4], const double b[4], double out[3]);

/** out = a exp(turn) */
void quaternion_turned(const double a[4], const double turn[3], double out[4]);

/**
 * A cubic curve of rotations from a to b, u of 0..1, that leaves a with velocity va and arrives at b with vb, both per
 * unit of u and in the frame of their end: Bezier's, by de Casteljau's construction with shortest arcs.
 */
void quaternion_curve(const double a[4], const double va[3], const double vb[3], const double b[4], double u,
                      double out[4]);

#endif
