/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/space.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* float32 positions of a tilted plane leave it by about 1e-7 of the diagonal. */
static double const FLATNESS = 1e-5;

static double height_over(const double normal[3], const double origin[3], const double point[3])
{
  double height = 0;
  for (int k = 0; k < 3; k++) {
    height += normal[k] * (point[k] - origin[k]);
  }
  return height;
}

/** Axes of inertia of the reference, the flattest last. */
static exm_status principal_axes(const mesh *reference, const double origin[3], double axes[3][3])
{
  double covariance[9] = {0}, values[3];
  for (size_t v = 0; v < reference->vertex_count; v++) {
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) {
        covariance[3 * i + j] += (reference->positions[v][i] - origin[i]) * (reference->positions[v][j] - origin[j]);
      }
    }
  }
  TRY(dense_eigen(3, covariance, values));
  for (size_t i = 0; i < 3; i++) {
    memcpy(axes[i], covariance + (2 - i) * 3, 3 * sizeof(double));
  }
  return EXM_OK;
}

static void centre(const mesh *reference, double origin[3])
{
  memset(origin, 0, 3 * sizeof(double));
  for (size_t v = 0; v < reference->vertex_count; v++) {
    for (int k = 0; k < 3; k++) {
      origin[k] += reference->positions[v][k] / (double)reference->vertex_count;
    }
  }
}

/** The pose and vertex furthest from the plane; the reference counts as pose `count`. */
static double furthest(const space *s, const mesh *reference, const float *poses, size_t count, size_t *pose,
                       size_t *vertex)
{
  double worst = 0;
  for (size_t i = 0; i <= count; i++) {
    for (size_t v = 0; v < reference->vertex_count; v++) {
      const float *from = poses + (i * reference->vertex_count + v) * 3;
      double const point[3] = {i < count ? (double)from[0] : reference->positions[v][0],
                               i < count ? (double)from[1] : reference->positions[v][1],
                               i < count ? (double)from[2] : reference->positions[v][2]};
      double const height = fabs(height_over(s->axes[2], s->origin, point)) / s->unit;
      if (height > worst) {
        worst = height;
        *pose = i;
        *vertex = v;
      }
    }
  }
  return worst;
}

exm_status space_create(const mesh *reference, const float *poses, size_t count, int32_t dimension, space *out)
{
  space s = {.dimension = 3, .axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .unit = reference->report.diagonal};
  centre(reference, s.origin);
  if (dimension != 3) {
    space flat = s;
    size_t pose = 0, vertex = 0;
    flat.dimension = 2;
    TRY(principal_axes(reference, s.origin, flat.axes));
    double const worst = furthest(&flat, reference, poses, count, &pose, &vertex);
    if (worst <= FLATNESS) {
      s = flat;
    } else if (dimension == 2) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, vertex,
                           "settings.dimension is 2, but vertex %zu of %s %zu lies %g outside the mesh's plane", vertex,
                           pose < count ? "exemplar" : "the reference, counted as exemplar", pose, worst * s.unit);
    }
  }
  *out = s;
  return EXM_OK;
}

void space_from_point(const space *s, const double point[3], double *out)
{
  for (size_t i = 0; i < s->dimension; i++) {
    out[i] = height_over(s->axes[i], s->origin, point) / s->unit;
  }
}

void space_to_point(const space *s, const double *coordinates, double out[3])
{
  for (int k = 0; k < 3; k++) {
    out[k] = s->origin[k];
    for (size_t i = 0; i < s->dimension; i++) {
      out[k] += s->unit * coordinates[i] * s->axes[i][k];
    }
  }
}

double space_height(const space *s, const double point[3])
{
  return s->dimension == 2 ? height_over(s->axes[2], s->origin, point) / s->unit : 0;
}

void space_from_linear(const space *s, const double linear[3][3], double *out)
{
  size_t const d = s->dimension;
  for (size_t i = 0; i < d; i++) {
    for (size_t j = 0; j < d; j++) {
      double sum = 0;
      for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) {
          sum += s->axes[i][a] * linear[a][b] * s->axes[j][b];
        }
      }
      out[i * d + j] = sum;
    }
  }
}

void space_to_linear(const space *s, const double *coordinates, double out[3][3])
{
  size_t const d = s->dimension;
  for (int a = 0; a < 3; a++) {
    for (int b = 0; b < 3; b++) {
      double sum = d == 2 ? s->axes[2][a] * s->axes[2][b] : 0;
      for (size_t i = 0; i < d; i++) {
        for (size_t j = 0; j < d; j++) {
          sum += s->axes[i][a] * coordinates[i * d + j] * s->axes[j][b];
        }
      }
      out[a][b] = sum;
    }
  }
}
