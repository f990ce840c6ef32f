/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Clusters of vertices that move rigidly, by splitting [Le and Deng 2014, 4.1]: the clusters that fit worst get a
 * second bone, begun at a vertex that is both badly fitted and far from the cluster's middle; then vertices go to the
 * bone that fits them, and bones are fitted to their vertices, a few times. */
#include <math.h>
#include <string.h>

#include "weights/decomposition.h"

enum { ROUNDS = 4, SEED_VERTICES = 24, SAMPLE = 6000 };
/* Where motion is small all over (faces), what counts is this share of what a single bone leaves. */
static double const SHARE_OF_MOTION = 0.2;
/* A cluster of less than this share of the surface is given up: it has too few vertices to tell a rotation. */
static double const LEAST_SHARE = 2e-3;

typedef struct clusters {
  decomposition *d;
  double mass;        /* of the vertices at work */
  size_t stride;      /* every so many vertices stand for all, until the end */
  double *misses;     /* [V] of each vertex to its bone */
  double *costs;      /* [limit] sums by cluster */
  double *masses;     /* [limit] */
  uint32_t *vertices; /* [V] scratch: of one cluster */
  unsigned char *is_split;
} clusters;

static void assign(clusters *c)
{
  decomposition *d = c->d;
  memset(c->costs, 0, d->bone_limit * sizeof(double));
  memset(c->masses, 0, d->bone_limit * sizeof(double));
  for (size_t v = 0; v < d->reference->vertex_count; v += c->stride) {
    double least = INFINITY;
    for (size_t b = 0; b < d->bone_count; b++) {
      double const miss = decomposition_miss(d, b, v);
      if (miss < least) {
        least = miss;
        d->labels[v] = (uint32_t)b;
      }
    }
    c->misses[v] = least;
    c->costs[d->labels[v]] += d->reference->masses[v] * least;
    c->masses[d->labels[v]] += d->reference->masses[v];
  }
}

static size_t gather(const clusters *c, size_t bone)
{
  size_t count = 0;
  for (size_t v = 0; v < c->d->reference->vertex_count; v += c->stride) {
    if (c->d->labels[v] == bone) {
      c->vertices[count++] = (uint32_t)v;
    }
  }
  return count;
}

static void fit_all(clusters *c)
{
  decomposition *d = c->d;
  for (size_t b = 0; b < d->bone_count; b++) {
    size_t const count = gather(c, b);
    for (size_t s = 0; s < d->pose_count && count > 0; s++) {
      decomposition_fit(d, c->vertices, count, s, &d->transforms[b * d->pose_count + s]);
    }
  }
}

/** Bones whose clusters are too small go; the last takes the place of one that goes. */
static void drop_small(clusters *c)
{
  decomposition *d = c->d;
  for (size_t b = d->bone_count; b-- > 0 && d->bone_count > 1;) {
    if (c->masses[b] < LEAST_SHARE * c->mass) {
      d->bone_count--;
      memmove(d->transforms + b * d->pose_count, d->transforms + d->bone_count * d->pose_count,
              d->pose_count * sizeof(bone_transform));
      c->masses[b] = c->masses[d->bone_count];
    }
  }
}

/** The vertex that a second bone of a cluster begins at. */
static size_t find_seed(const clusters *c, size_t bone)
{
  const mesh *reference = c->d->reference;
  size_t const count = gather(c, bone);
  double middle[3] = {0}, total = 0, most = -1;
  size_t seed = c->vertices[0];
  for (size_t i = 0; i < count; i++) {
    size_t const v = c->vertices[i];
    total += reference->masses[v];
    for (size_t k = 0; k < 3; k++) {
      middle[k] += reference->masses[v] * reference->positions[v][k];
    }
  }
  for (size_t i = 0; i < count; i++) {
    size_t const v = c->vertices[i];
    double away = 0;
    for (size_t k = 0; k < 3; k++) {
      double const difference = reference->positions[v][k] - middle[k] / total;
      away += difference * difference;
    }
    if (c->misses[v] * away > most) {
      most = c->misses[v] * away;
      seed = v;
    }
  }
  return seed;
}

/** A bone fitted to the vertices of the cluster around a seed. */
static void begin_bone(clusters *c, size_t bone, size_t seed)
{
  decomposition *d = c->d;
  const mesh *reference = d->reference;
  uint32_t *near = c->vertices;
  size_t count = 0;
  near[count++] = (uint32_t)seed;
  for (size_t i = 0; i < count && count < SEED_VERTICES; i++) {
    for (uint32_t e = reference->neighbor_offsets[near[i]];
         e < reference->neighbor_offsets[near[i] + 1] && count < SEED_VERTICES; e++) {
      uint32_t const u = reference->neighbors[e];
      size_t known = 0;
      while (known < count && near[known] != u) {
        known++;
      }
      if (known == count && (c->stride > 1 || d->labels[u] == d->labels[seed])) {
        near[count++] = u;
      }
    }
  }
  for (size_t s = 0; s < d->pose_count; s++) {
    decomposition_fit(d, near, count, s, &d->transforms[bone * d->pose_count + s]);
  }
}

/** Split the clusters that cost most, up to a third more bones. */
static void split(clusters *c, size_t most)
{
  decomposition *d = c->d;
  size_t const before = d->bone_count;
  size_t const wanted = before + (before + 2) / 3 < most ? before + (before + 2) / 3 : most;
  memset(c->is_split, 0, d->bone_limit);
  while (d->bone_count < wanted) {
    size_t worst = before;
    for (size_t b = 0; b < before; b++) {
      if (!c->is_split[b] && c->masses[b] > 2 * LEAST_SHARE * c->mass && c->costs[b] > 0 &&
          (worst == before || c->costs[b] > c->costs[worst])) {
        worst = b;
      }
    }
    if (worst == before) {
      break;
    }
    c->is_split[worst] = 1;
    begin_bone(c, d->bone_count, find_seed(c, worst));
    d->bone_count++;
  }
}

static double cluster_error(const clusters *c)
{
  double sum = 0;
  for (size_t b = 0; b < c->d->bone_count; b++) {
    sum += c->costs[b];
  }
  return sqrt(sum / (c->mass * (double)c->d->pose_count));
}

static void refine(clusters *c)
{
  for (int round = 0; round < ROUNDS; round++) {
    assign(c);
    drop_small(c);
    assign(c);
    fit_all(c);
  }
  assign(c);
}

/** Every vertex with its one bone, as weights. */
static void set_weights(decomposition *d)
{
  for (size_t v = 0; v < d->reference->vertex_count; v++) {
    d->counts[v] = 1;
    d->bones[v * d->influence_limit] = d->labels[v];
    d->weights[v * d->influence_limit] = 1;
  }
}

static exm_status grow(clusters *c, size_t bones, double error, const progress *report)
{
  decomposition *d = c->d;
  for (size_t v = 0; v < d->reference->vertex_count; v += c->stride) {
    c->mass += d->reference->masses[v];
  }
  size_t const most = bones > 0 ? bones : d->bone_limit;
  d->bone_count = 1;
  fit_all(c);
  assign(c);
  double const enough = fmin(error, SHARE_OF_MOTION * cluster_error(c));
  size_t stuck = 0;
  while (d->bone_count < most && stuck < 3 && (bones > 0 || cluster_error(c) > enough)) {
    size_t const before = d->bone_count;
    split(c, most);
    if (d->bone_count == before) {
      break;
    }
    refine(c);
    stuck = d->bone_count > before ? 0 : stuck + 1;
    TRY(progress_report(report, (double)d->bone_count / (double)most, "bones"));
  }
  return EXM_OK;
}

exm_status decomposition_cluster(decomposition *d, size_t bones, double error, const progress *report)
{
  size_t const V = d->reference->vertex_count;
  arena scratch = {0};
  clusters c = {.d = d,
                .stride = V / SAMPLE > 1 ? V / SAMPLE : 1,
                .misses = ARENA_NEW(&scratch, double, V),
                .costs = ARENA_NEW(&scratch, double, d->bone_limit),
                .masses = ARENA_NEW(&scratch, double, d->bone_limit),
                .vertices = ARENA_NEW(&scratch, uint32_t, V > SEED_VERTICES ? V : SEED_VERTICES),
                .is_split = ARENA_NEW(&scratch, unsigned char, d->bone_limit)};
  exm_status status = c.misses && c.costs && c.masses && c.vertices && c.is_split
                          ? grow(&c, bones, error, report)
                          : status_no_memory("the decomposition");
  if (status == EXM_OK && c.stride > 1) {
    c.stride = 1;
    assign(&c);
    fit_all(&c);
    assign(&c);
  }
  if (status == EXM_OK) {
    set_weights(d);
  }
  arena_release(&scratch);
  return status;
}
