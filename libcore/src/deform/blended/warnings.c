/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/blended/warnings.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Root mean square distance, in diagonals, below which two exemplars are one: float32's rounding, and some. */
static double const SAME = 1e-6;
/* Second moments below this share of the largest span nothing. */
static double const FLAT = 1e-8;
/* Turned inside out: its volume is of the other sign, and at least this share of the others'. */
static double const MIRRORED = 0.3;
/* Targets of the same point that differ by more, in diagonals, contradict each other. */
static double const APART = 1e-6;

/** Root mean square distance of two exemplars, which lie on the reference both. */
static double distance(const blended_deformer *deformer, const mesh *reference, size_t a, size_t b)
{
  const dictionary *atoms = &deformer->atoms;
  size_t const d = atoms->dimension, width = atoms->exemplar_count * d;
  double sum = 0, mass = 0;
  for (size_t v = 0; v < atoms->vertex_count; v++) {
    for (size_t k = 0; k < d; k++) {
      double const difference = atoms->exemplars[v * width + a * d + k] - atoms->exemplars[v * width + b * d + k];
      sum += reference->masses[v] * difference * difference;
    }
    mass += reference->masses[v];
  }
  return sqrt(sum / mass);
}

static double determinant(const double *a, const double *b, const double *c)
{
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/** Six times the volume that the triangles enclose, about the middle; in the plane twice their area, with its sign. */
static double signed_size(const blended_deformer *deformer, const mesh *reference, size_t s)
{
  const dictionary *atoms = &deformer->atoms;
  size_t const d = atoms->dimension, width = atoms->exemplar_count * d;
  const double *centre = atoms->centres + s * d;
  double sum = 0;
  for (size_t t = 0; t < reference->triangle_count; t++) {
    double p[3][3] = {{0}};
    for (size_t i = 0; i < 3; i++) {
      const double *from = atoms->exemplars + reference->triangles[t][i] * width + s * d;
      for (size_t k = 0; k < d; k++) {
        p[i][k] = from[k] - centre[k];
      }
      p[i][2] = d == 2 ? 1 : p[i][2];
    }
    sum += determinant(p[0], p[1], p[2]);
  }
  return sum;
}

exm_status blended_warn_exemplars(const blended_deformer *deformer, const mesh *reference)
{
  size_t const S = deformer->base.info.exemplar_count;
  exm_status status = EXM_OK;
  arena scratch = {0};
  double *sizes = ARENA_NEW(&scratch, double, S);
  if (!sizes) {
    return status_no_memory("the exemplars");
  }
  double sum = 0;
  for (size_t s = 0; s < S; s++) {
    sizes[s] = signed_size(deformer, reference, s);
    sum += sizes[s];
  }
  /* Against most of the others: surfaces that enclose next to nothing are on no side. */
  for (size_t s = 0; s < S && status == EXM_OK; s++) {
    double const others = (sum - sizes[s]) / (double)(S > 1 ? S - 1 : 1);
    if (S > 1 && sizes[s] * others < 0 && fabs(sizes[s]) > MIRRORED * fabs(others)) {
      status = status_set_at(EXM_WARNING_EXEMPLARS, EXM_ELEMENT_EXEMPLAR, s,
                             "exemplar %zu is a mirror image, which no rotation reaches: poses will not follow it", s);
    }
  }
  for (size_t s = 1; s < S && status == EXM_OK; s++) {
    for (size_t other = 0; other < s && status == EXM_OK; other++) {
      if (distance(deformer, reference, other, s) <= SAME) {
        status = status_set_at(EXM_WARNING_EXEMPLARS, EXM_ELEMENT_EXEMPLAR, s,
                               "exemplars %zu and %zu are the same shape: the second adds nothing", other, s);
      }
    }
  }
  arena_release(&scratch);
  return status;
}

exm_status blended_warn_spread(const blended *b, const double *targets, size_t stride)
{
  const blended_constraints *c = &b->held;
  size_t const d = b->dimension;
  double mean[3] = {0}, moments[9] = {0}, values[3], sums = 0;
  for (size_t i = 0; i < c->row_count; i++) {
    double const w = c->weights[i] * c->sums[i];
    sums += w * c->sums[i];
    for (size_t k = 0; k < d && w > 0; k++) {
      mean[k] += w * targets[i * stride + k];
    }
  }
  for (size_t i = 0; i < c->row_count; i++) {
    double own[3] = {0};
    for (size_t k = 0; k < d && c->weights[i] > 0; k++) {
      own[k] = targets[i * stride + k] - c->sums[i] * mean[k] / (sums > 0 ? sums : 1);
    }
    for (size_t j = 0; j < d; j++) {
      dense_axpy(d, c->weights[i] * own[j], own, moments + j * d);
    }
  }
  TRY(dense_eigen(d, moments, values));
  if (!(values[d - 1] > FLAT * FLAT)) {
    return status_set(EXM_WARNING_UNDERDETERMINED,
                      "all constraints lie in one point: they leave turn and scale open, which are kept");
  }
  if (d == 3 && !(values[1] > FLAT * values[2])) {
    return status_set(EXM_WARNING_UNDERDETERMINED,
                      "all constraints lie on a line: they leave the turn about it open, which is kept");
  }
  return EXM_OK;
}

exm_status blended_warn_contradiction(const blended *b)
{
  const blended_constraints *c = &b->held;
  size_t const d = b->dimension;
  for (size_t p = 0; p < c->pair_count; p++) {
    const parallel_rows *pair = &c->pairs[p];
    double square = 0;
    for (size_t k = 0; k < d; k++) {
      double const difference = c->targets[pair->second * d + k] - pair->factor * c->targets[pair->first * d + k];
      square += difference * difference;
    }
    if (c->weights[pair->first] > 0 && c->weights[pair->second] > 0 && square > APART * APART) {
      return status_set(EXM_WARNING_CONTRADICTORY,
                        "constraints %zu and %zu are about the same, but their targets are %g apart: they are met in "
                        "the middle",
                        pair->first, pair->second, sqrt(square));
    }
  }
  return EXM_OK;
}
