/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/learn.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "deform/rigidity/fit.h"
#include "deform/rigidity/spokes.h"
#include "mesh/areas.h"

/* Poses are dealt out to lanes, each with room of its own; lanes are added in order, so that sums do not depend on how
 * many threads there are. A round is what is done between two reports of progress. */
enum { LANES = 4, ROUND = 4 };

typedef struct lane {
  double *positions; /* [V][3] */
  row12 *moments, *sums, *rotations;
  double *gains;
  double *energies; /* [range][V] */
} lane;

typedef struct learner {
  const learn_request *request;
  arena memory;
  spokes edges;
  size_t range;    /* radii to choose from */
  set_sums *balls; /* [range + 1] of radius_min and up: one more, for the areas */
  double *areas;   /* [range][V] A(k, r) */
  double *ones;    /* [V] */
  lane lanes[LANES];
} learner;

static exm_status allocate(learner *l)
{
  size_t const V = l->request->reference->vertex_count;
  l->range = (size_t)(l->request->radius_max - l->request->radius_min) + 1;
  if (V > SIZE_MAX / sizeof(double) / l->range) {
    return status_no_memory("the poses' energies");
  }
  l->balls = ARENA_NEW(&l->memory, set_sums, l->range + 1);
  l->areas = ARENA_NEW(&l->memory, double, l->range *V);
  l->ones = ARENA_NEW(&l->memory, double, V);
  int is_there = l->balls && l->areas && l->ones;
  for (int i = 0; i < LANES; i++) {
    lane *own = &l->lanes[i];
    own->positions = ARENA_NEW(&l->memory, double, 3 * V);
    own->moments = ARENA_NEW(&l->memory, row12, V);
    own->sums = ARENA_NEW(&l->memory, row12, V);
    own->rotations = ARENA_NEW(&l->memory, row12, V);
    own->gains = ARENA_NEW(&l->memory, double, V);
    own->energies = ARENA_NEW(&l->memory, double, l->range *V);
    is_there = is_there && own->positions && own->moments && own->sums && own->rotations && own->gains && own->energies;
  }
  return is_there ? EXM_OK : status_no_memory("the poses' energies");
}

/* Numbers that are summed over balls beside the moments: the first row's fourth. */
static double *beside(row12 *row)
{
  return (double *)row + 3;
}

/* A(k, r): N(k, r) has the vertices within r edges, which is the ball of radius r + 1. */
static void find_areas(learner *l)
{
  const mesh *m = l->request->reference;
  lane *room = &l->lanes[0];
  double total = 0;
  mesh_voronoi_areas(m, room->gains);
  for (size_t v = 0; v < m->vertex_count; v++) {
    room->moments[v] = (row12){0};
    *beside(&room->moments[v]) = room->gains[v];
    total += room->gains[v];
  }
  /* Triangles that are points have none; nothing is divided by it then but an energy of zero. */
  double const smallest = 1e-12 * total / (double)m->vertex_count;
  for (size_t r = 0; r < l->range; r++) {
    set_sums_apply(&l->balls[r + 1], 1, room->moments, room->sums);
    for (size_t v = 0; v < m->vertex_count; v++) {
      l->areas[r * m->vertex_count + v] = fmax(*beside(&room->sums[v]), smallest);
    }
  }
}

static exm_status prepare(learner *l)
{
  const mesh *m = l->request->reference;
  int32_t *radii = ARENA_NEW(&l->memory, int32_t, m->vertex_count);
  if (!radii) {
    return status_no_memory("the poses' energies");
  }
  TRY(spokes_create(&l->memory, m, &l->edges));
  for (size_t r = 0; r <= l->range; r++) {
    progress const part = progress_part(&l->request->report, 0.2 * (double)r / (double)(l->range + 1),
                                        0.2 * (double)(r + 1) / (double)(l->range + 1));
    for (size_t v = 0; v < m->vertex_count; v++) {
      radii[v] = l->request->radius_min + (int32_t)r;
      l->ones[v] = 1;
    }
    TRY(balls_create(&l->memory, &l->edges.around, radii, &part, NULL, &l->balls[r]));
  }
  find_areas(l);
  return EXM_OK;
}

/* Moments of one pose, and beside them what a neighbourhood's energy is before its rotation takes something off. */
static void find_moments(const learner *l, const float *pose, lane *own)
{
  size_t const V = l->edges.around.vertex_count;
  for (size_t i = 0; i < 3 * V; i++) {
    own->positions[i] = (double)pose[i];
  }
  for (size_t v = 0; v < V; v++) {
    double const stretch = spokes_moments(&l->edges, v, v + 1, own->positions, l->ones, own->moments);
    *beside(&own->moments[v]) = stretch + l->edges.rest[v];
  }
}

static void add_energies(const learner *l, size_t r, lane *own)
{
  size_t const V = l->edges.around.vertex_count;
  double const share = 1.0 / (double)l->request->pose_count;
  set_sums_apply(&l->balls[r], 1, own->moments, own->sums);
  fit_rotations(own->sums, 0, V, own->rotations, own->gains);
  for (size_t v = 0; v < V; v++) {
    double const energy = fmax(0, *beside(&own->sums[v]) - 2 * own->gains[v]);
    own->energies[r * V + v] += share * energy / l->areas[r * V + v];
  }
}

/* The poses first, first + LANES, ... below last. */
static void measure_poses(const learner *l, size_t first, size_t last, lane *own)
{
  for (size_t pose = first; pose < last; pose += LANES) {
    find_moments(l, l->request->poses + 3 * l->edges.around.vertex_count * pose, own);
    for (size_t r = 0; r < l->range; r++) {
      add_energies(l, r, own);
    }
  }
}

static exm_status measure(learner *l, int threads)
{
  size_t const V = l->request->reference->vertex_count, M = l->request->pose_count;
  for (size_t begin = 0; begin < M; begin += (size_t)LANES * ROUND) {
    size_t const end = begin + (size_t)LANES * ROUND < M ? begin + (size_t)LANES * ROUND : M;
    TRY(progress_report(&l->request->report, 0.2 + 0.8 * (double)begin / (double)M, "measuring poses"));
#pragma omp parallel for num_threads(threads) schedule(static, 1) if (threads > 1)
    for (size_t i = 0; i < LANES; i++) {
      measure_poses(l, begin + i, end, &l->lanes[i]);
    }
  }
  for (int i = 1; i < LANES; i++) {
    for (size_t e = 0; e < l->range * V; e++) {
      l->lanes[0].energies[e] += l->lanes[i].energies[e];
    }
  }
  return progress_report(&l->request->report, 1, "measuring poses");
}

/* argmin_r E_ARAP(k, r) + omega (r_max - r); stiffer where that makes no difference. */
static void choose(const learner *l, int32_t *radii)
{
  size_t const V = l->edges.around.vertex_count;
  for (size_t v = 0; v < V; v++) {
    double best = INFINITY;
    for (size_t r = 0; r < l->range; r++) {
      double const cost = l->lanes[0].energies[r * V + v] + l->request->omega * (double)(l->range - 1 - r);
      if (cost <= best) {
        best = cost;
        radii[v] = l->request->radius_min + (int32_t)r;
      }
    }
  }
}

static exm_status learn(learner *l)
{
  TRY(allocate(l));
  TRY(prepare(l));
  return measure(l, omp_get_max_threads() < LANES ? omp_get_max_threads() : LANES);
}

exm_status rigidity_learn(const learn_request *request, int32_t *radii, double *energies)
{
  learner l = {.request = request};
  exm_status const status = learn(&l);
  if (status == EXM_OK) {
    choose(&l, radii);
    if (energies) {
      memcpy(energies, l.lanes[0].energies, l.range * request->reference->vertex_count * sizeof *energies);
    }
  }
  arena_release(&l.memory);
  return status;
}
