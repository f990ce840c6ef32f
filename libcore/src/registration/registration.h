/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Registration over the Blended deformer [Blended, section 5]. The deformer, bound to no landmark in particular, gives
 * the dictionary and the pose that meets landmarks; from there non-rigid ICP works in the last stage's basis. */
#ifndef EXM_REGISTRATION_REGISTRATION_H
#define EXM_REGISTRATION_REGISTRATION_H

#include "base/progress.h"
#include "deform/blended/deformer.h"
#include "mesh/geodesics.h"
#include "registration/scan.h"

/** A pose as ICP has it: coefficients of the last stage's basis in a frame. */
typedef struct registered_pose {
  blended_frame frame;
  size_t exemplar; /* rigidity is measured against it */
  double scale;    /* alpha in the frame */
  double *u;       /* [rank][3] */
} registered_pose;

/** What a fit leaves behind. */
typedef struct registered_fit {
  arena memory;
  registered_pose pose;
  float *positions; /* [V][3] */
  size_t point_count, landmark_count;
  uint32_t *vertex_points;                  /* [V] */
  float *vertex_distances;                  /* [V] */
  uint32_t *scan_vertices, *scan_triangles; /* [P] */
  float *scan_barycentric, *scan_distances; /* [P][3], [P] */
  double *landmark_residuals;
} registered_fit;

typedef struct exm_registration {
  mesh *reference;
  blended_deformer *deformer;
  geodesics ways;      /* on the reference */
  double *areas;       /* [V] Voronoi */
  uint8_t *is_rim;     /* [V] at a boundary of the mesh: what lies beyond is no part of it */
  double size;         /* the root of the reference's area */
  size_t sample_count; /* a share of the vertices, spread evenly: any first ones are, too */
  uint32_t *samples;
  uint32_t *sample_of;    /* [V] the sample next to each vertex, on its side of the surface */
  double *sample_rows;    /* [samples][rank] */
  double *handle_targets; /* [components][3][4] of the handles that hold nothing */
  exm_registration_info info;
  registered_fit last;
  const float *shown; /* [V][3] while a fit is at work, for those who look on */
  arena memory;
} registration;

typedef struct registration_request {
  const mesh *reference;
  const float *exemplars;
  size_t exemplar_count;
  exm_blended_bind_settings settings;
  progress report;
} registration_request;

/** From arguments that were checked. May return a warning, with a registration. */
exm_status registration_create(const registration_request *request, registration **out);
void registration_destroy(registration *r);

typedef struct fit_request {
  const scan *target;
  exm_landmarks landmarks; /* checked: those that count are finite and in range */
  exm_registration_fit_settings settings;
  progress report;
} fit_request;

/** See exm_registration_fit. */
exm_status registration_fit(registration *r, const fit_request *request, exm_registration_fit_report *report);

/** Rows of the last stage's basis, [count][rank], for points that are weighted sums of `each` vertices. */
exm_status registration_rows(const registration *r, size_t count, size_t each, const uint32_t *vertices,
                             const double *weights, double *out);

/** The last stage of the dictionary. */
static inline const blended_basis *registration_basis(const registration *r)
{
  return &r->deformer->solver.bases[BLENDED_LAST];
}

#endif
