/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "weights/decomposition.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "linalg/rotation.h"

/* The alternation ends when a round gains less than this share of the error. */
static double const GAIN = 0.01;

exm_status decomposition_create(arena *owner, const mesh *reference, const float *poses, size_t pose_count,
                                size_t bone_limit, size_t influence_limit, decomposition *out)
{
  size_t const V = reference->vertex_count;
  decomposition d = {.reference = reference,
                     .poses = poses,
                     .pose_count = pose_count,
                     .bone_limit = bone_limit,
                     .influence_limit = influence_limit,
                     .transforms = ARENA_NEW(owner, bone_transform, bone_limit * pose_count),
                     .labels = ARENA_NEW(owner, uint32_t, V),
                     .counts = ARENA_NEW(owner, unsigned char, V),
                     .bones = ARENA_NEW(owner, uint32_t, V * influence_limit),
                     .weights = ARENA_NEW(owner, double, V *influence_limit)};
  if (!d.transforms || !d.labels || !d.counts || !d.bones || !d.weights) {
    return status_no_memory("the decomposition");
  }
  for (size_t v = 0; v < V; v++) {
    d.mass += reference->masses[v];
  }
  *out = d;
  return EXM_OK;
}

/** turn x + shift */
static void move(const bone_transform *t, const double x[3], double out[3])
{
  for (size_t k = 0; k < 3; k++) {
    out[k] = t->shift[k] + dense_dot(3, t->turn + 3 * k, x);
  }
}

/** The transform from sums: of weights, of weighted rest and posed points, and their moment [k][j] posed_k rest_j. */
static void transform_from_sums(double total, const double rest[3], const double posed[3], const double moment[9],
                                bone_transform *out)
{
  double centred[9];
  for (size_t k = 0; k < 3; k++) {
    for (size_t j = 0; j < 3; j++) {
      centred[3 * k + j] = moment[3 * k + j] - posed[k] * rest[j] / total;
    }
  }
  rotation_fit3(1, centred, out->turn);
  for (size_t k = 0; k < 3; k++) {
    out->shift[k] = (posed[k] - dense_dot(3, out->turn + 3 * k, rest)) / total;
  }
}

void decomposition_fit(const decomposition *d, const uint32_t *vertices, size_t count, size_t s, bone_transform *out)
{
  double total = 0, rest[3] = {0}, posed[3] = {0}, moment[9] = {0};
  for (size_t i = 0; i < count; i++) {
    size_t const v = vertices[i];
    double const w = d->reference->masses[v], *x = d->reference->positions[v];
    const float *p = d->poses + (s * d->reference->vertex_count + v) * 3;
    total += w;
    for (size_t k = 0; k < 3; k++) {
      rest[k] += w * x[k];
      posed[k] += w * (double)p[k];
      for (size_t j = 0; j < 3; j++) {
        moment[3 * k + j] += w * (double)p[k] * x[j];
      }
    }
  }
  transform_from_sums(total, rest, posed, moment, out);
}

double decomposition_miss(const decomposition *d, size_t bone, size_t v)
{
  double sum = 0, moved[3];
  for (size_t s = 0; s < d->pose_count; s++) {
    const float *p = d->poses + (s * d->reference->vertex_count + v) * 3;
    move(&d->transforms[bone * d->pose_count + s], d->reference->positions[v], moved);
    for (size_t k = 0; k < 3; k++) {
      double const difference = moved[k] - (double)p[k];
      sum += difference * difference;
    }
  }
  return sum;
}

/** What is missing at vertex v in pose s. */
static void residual(const decomposition *d, size_t s, size_t v, double out[3])
{
  const float *p = d->poses + (s * d->reference->vertex_count + v) * 3;
  double moved[3];
  for (size_t k = 0; k < 3; k++) {
    out[k] = (double)p[k];
  }
  for (size_t i = 0; i < d->counts[v]; i++) {
    size_t const at = v * d->influence_limit + i;
    move(&d->transforms[d->bones[at] * d->pose_count + s], d->reference->positions[v], moved);
    dense_axpy(3, -d->weights[at], moved, out);
  }
}

double decomposition_error(const decomposition *d, double *largest)
{
  double sum = 0, most = 0, out[3];
  for (size_t s = 0; s < d->pose_count; s++) {
    for (size_t v = 0; v < d->reference->vertex_count; v++) {
      residual(d, s, v, out);
      double const square = dense_dot(3, out, out);
      sum += d->reference->masses[v] * square;
      most = fmax(most, square);
    }
  }
  if (largest) {
    *largest = sqrt(most);
  }
  return sqrt(sum / (d->mass * (double)d->pose_count));
}

/* ------------------------------------------------------------------------------------------------------- transforms */

/** Vertices by bone: where in weights each influence is. */
typedef struct influences {
  size_t *offsets; /* [bones + 1] */
  size_t *places;  /* into decomposition.weights */
} influences;

static exm_status sort_influences(arena *scratch, const decomposition *d, influences *out)
{
  size_t const V = d->reference->vertex_count;
  out->offsets = ARENA_NEW(scratch, size_t, d->bone_count + 2);
  out->places = ARENA_NEW(scratch, size_t, V * d->influence_limit);
  if (!out->offsets || !out->places) {
    return status_no_memory("the decomposition");
  }
  for (int pass = 0; pass < 2; pass++) {
    for (size_t v = 0; v < V; v++) {
      for (size_t i = 0; i < d->counts[v]; i++) {
        size_t const at = v * d->influence_limit + i;
        if (pass == 0) {
          out->offsets[d->bones[at] + 2]++;
        } else {
          out->places[out->offsets[d->bones[at] + 1]++] = at;
        }
      }
    }
    for (size_t b = 0; b < d->bone_count && pass == 0; b++) {
      out->offsets[b + 2] += out->offsets[b + 1];
    }
  }
  return EXM_OK;
}

/** One bone's best transform in pose s with the others as they are; `missing` [V][3] is the residual, and follows. */
static void move_bone(decomposition *d, const influences *in, size_t bone, size_t s, double *missing)
{
  bone_transform *t = &d->transforms[bone * d->pose_count + s];
  double total = 0, rest[3] = {0}, posed[3] = {0}, moment[9] = {0}, moved[3];
  for (size_t i = in->offsets[bone]; i < in->offsets[bone + 1]; i++) {
    size_t const v = in->places[i] / d->influence_limit;
    double const w = d->weights[in->places[i]], mass = d->reference->masses[v];
    const double *x = d->reference->positions[v];
    move(t, x, moved);
    total += mass * w * w;
    for (size_t k = 0; k < 3; k++) {
      double const pull = mass * w * (missing[3 * v + k] + w * moved[k]);
      missing[3 * v + k] += w * moved[k];
      rest[k] += mass * w * w * x[k];
      posed[k] += pull;
      for (size_t j = 0; j < 3; j++) {
        moment[3 * k + j] += pull * x[j];
      }
    }
  }
  if (total > 1e-12 * d->mass) {
    transform_from_sums(total, rest, posed, moment, t);
  }
  for (size_t i = in->offsets[bone]; i < in->offsets[bone + 1]; i++) {
    size_t const v = in->places[i] / d->influence_limit;
    move(t, d->reference->positions[v], moved);
    dense_axpy(3, -d->weights[in->places[i]], moved, missing + 3 * v);
  }
}

exm_status decomposition_move(decomposition *d)
{
  size_t const V = d->reference->vertex_count;
  arena scratch = {0};
  influences in = {0};
  double *missing = ARENA_NEW(&scratch, double, 3 * V);
  exm_status status = missing ? sort_influences(&scratch, d, &in) : status_no_memory("the decomposition");
  for (size_t s = 0; s < d->pose_count && status == EXM_OK; s++) {
    for (size_t v = 0; v < V; v++) {
      residual(d, s, v, missing + 3 * v);
    }
    for (size_t b = 0; b < d->bone_count; b++) {
      move_bone(d, &in, b, s, missing);
    }
  }
  arena_release(&scratch);
  return status;
}

/* ------------------------------------------------------------------------------------------------------ alternation */

static void label(decomposition *d)
{
  for (size_t v = 0; v < d->reference->vertex_count; v++) {
    size_t best = v * d->influence_limit;
    for (size_t i = 1; i < d->counts[v]; i++) {
      size_t const at = v * d->influence_limit + i;
      best = d->weights[at] > d->weights[best] ? at : best;
    }
    d->labels[v] = d->bones[best];
  }
}

exm_status decomposition_alternate(decomposition *d, int32_t rounds_most, const progress *report, int32_t *rounds)
{
  double before = decomposition_error(d, NULL);
  for (*rounds = 0; *rounds < rounds_most;) {
    TRY(decomposition_weigh(d));
    TRY(decomposition_move(d));
    ++*rounds;
    double const error = decomposition_error(d, NULL);
    TRY(progress_report(report, (double)*rounds / (double)rounds_most, "skinning weights"));
    if (before - error < GAIN * before) {
      break;
    }
    before = error;
  }
  label(d);
  return EXM_OK;
}
