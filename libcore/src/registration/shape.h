/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The fitted surface as it is at the moment: positions, normals, and the way from any point to it. */
#ifndef EXM_REGISTRATION_SHAPE_H
#define EXM_REGISTRATION_SHAPE_H

#include "registration/registration.h"

typedef struct shape {
  const registration *r;
  float *shown;           /* [V][3] as the caller sees it */
  double (*positions)[3]; /* [V] */
  double (*normals)[3];   /* [V] of length 1, or 0 */
  nearest tree;           /* of the vertices */
  arena memory;           /* of the tree */
} shape;

/** A place on a surface. */
typedef struct foot {
  uint32_t vertex, triangle; /* the nearest vertex, NEAREST_NONE where there is none; the triangle around it */
  double barycentric[3];
  double squared; /* distance */
} foot;

exm_status shape_create(arena *owner, const registration *r, shape *out);
void shape_release(shape *s);

/** Take on a pose. */
exm_status shape_pose(shape *s, const registered_pose *pose);
/** Take on positions, those in s->positions. */
exm_status shape_refresh(shape *s);

/** Feet of points [count][3] with directions (see nearest_find) on the surface: on the triangles around the nearest
 *  agreeing vertex. */
exm_status shape_feet(const shape *s, const double (*points)[3], size_t count, const double (*directions)[3],
                      const nearest_filter *filter, double reach, int thread_count, foot *out);

/** From the caller's space into a frame and back. */
void frame_from_point(const space *s, const blended_frame *frame, const double point[3], double out[3]);
void frame_from_direction(const space *s, const blended_frame *frame, const double direction[3], double out[3]);

#endif
