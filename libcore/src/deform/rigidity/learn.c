/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/learn.h"

#include <math.h>
#include <omp.h>
#include <string.h>

#include "deform/rigidity/fit.h"
#include "deform/rigidity/spokes.h"
#include "mesh/areas.h"

enum { PIECE = 512, MOST_THREADS = 8 };

typedef struct learner {
  const learn_request *request;
  arena memory;
  spokes edges;
  size_t range;      /* radii to choose from */
  set_sums *balls;   /* [range + 1] of radius_min and up: one more, for the areas */
  double *areas;     /* [range][V] A(k, r) */
  double *energies;  /* [range][V] */
  double *positions; /* [V][3] */
  double *ones;      /* [V] */
  row12 *moments, *sums, *rotations;
  double *gains;
  int thread_count;
} learner;

static exm_status allocate(learner *l)
{
  size_t const V = l->request->reference->vertex_count;
  l->range = (size_t)(l->request->radius_max - l->request->radius_min) + 1;
  l->balls = ARENA_NEW(&l->memory, set_sums, l->range + 1);
  if (V > SIZE_MAX / sizeof(double) / l->range) {
    return status_no_memory("the poses' energies");
  }
  l->areas = ARENA_NEW(&l->memory, double, l->range *V);
  l->energies = ARENA_NEW(&l->memory, double, l->range *V);
  l->positions = ARENA_NEW(&l->memory, double, 3 * V);
  l->ones = ARENA_NEW(&l->memory, double, V);
  l->moments = ARENA_NEW(&l->memory, row12, V);
  l->sums = ARENA_NEW(&l->memory, row12, V);
  l->rotations = ARENA_NEW(&l->memory, row12, V);
  l->gains = ARENA_NEW(&l->memory, double, V);
  if (!l->balls || !l->areas || !l->energies || !l->positions || !l->ones || !l->moments || !l->sums || !l->rotations ||
      !l->gains) {
    return status_no_memory("the poses' energies");
  }
  return EXM_OK;
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
  double *own = l->gains, total = 0;
  mesh_voronoi_areas(m, own);
  for (size_t v = 0; v < m->vertex_count; v++) {
    l->moments[v] = (row12){0};
    *beside(&l->moments[v]) = own[v];
    total += own[v];
  }
  /* Triangles that are points have none; nothing is divided by it then but an energy of zero. */
  double const smallest = 1e-12 * total / (double)m->vertex_count;
  for (size_t r = 0; r < l->range; r++) {
    set_sums_apply(&l->balls[r + 1], l->thread_count, l->moments, l->sums);
    for (size_t v = 0; v < m->vertex_count; v++) {
      l->areas[r * m->vertex_count + v] = fmax(*beside(&l->sums[v]), smallest);
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

static size_t piece_end(const learner *l, size_t begin)
{
  size_t const V = l->edges.around.vertex_count;
  return begin + PIECE < V ? begin + PIECE : V;
}

/* Moments of one pose, and beside them what a neighbourhood's energy is before its rotation takes something off. */
static void find_moments(learner *l, const float *pose)
{
  size_t const V = l->edges.around.vertex_count;
  for (size_t i = 0; i < 3 * V; i++) {
    l->positions[i] = (double)pose[i];
  }
#pragma omp parallel for num_threads(l->thread_count) schedule(static) if (l->thread_count > 1)
  for (size_t begin = 0; begin < V; begin += PIECE) {
    for (size_t v = begin; v < piece_end(l, begin); v++) {
      double const stretch = spokes_moments(&l->edges, v, v + 1, l->positions, l->ones, l->moments);
      *beside(&l->moments[v]) = stretch + l->edges.rest[v];
    }
  }
}

static void add_energies(learner *l, size_t r)
{
  size_t const V = l->edges.around.vertex_count;
  double const share = 1.0 / (double)l->request->pose_count;
  set_sums_apply(&l->balls[r], l->thread_count, l->moments, l->sums);
#pragma omp parallel for num_threads(l->thread_count) schedule(static) if (l->thread_count > 1)
  for (size_t begin = 0; begin < V; begin += PIECE) {
    fit_rotations(l->sums, begin, piece_end(l, begin), l->rotations, l->gains);
    for (size_t v = begin; v < piece_end(l, begin); v++) {
      double const energy = fmax(0, *beside(&l->sums[v]) - 2 * l->gains[v]);
      l->energies[r * V + v] += share * energy / l->areas[r * V + v];
    }
  }
}

/* argmin_r E_ARAP(k, r) + omega (r_max - r); stiffer where that makes no difference. */
static void choose(const learner *l, int32_t *radii)
{
  size_t const V = l->edges.around.vertex_count;
  for (size_t v = 0; v < V; v++) {
    double best = INFINITY;
    for (size_t r = 0; r < l->range; r++) {
      double const cost = l->energies[r * V + v] + l->request->omega * (double)(l->range - 1 - r);
      if (cost <= best) {
        best = cost;
        radii[v] = l->request->radius_min + (int32_t)r;
      }
    }
  }
}

static exm_status learn(learner *l)
{
  size_t const V = l->request->reference->vertex_count, M = l->request->pose_count;
  TRY(allocate(l));
  TRY(prepare(l));
  for (size_t pose = 0; pose < M; pose++) {
    TRY(progress_report(&l->request->report, 0.2 + 0.8 * (double)pose / (double)M, "measuring poses"));
    find_moments(l, l->request->poses + 3 * V * pose);
    for (size_t r = 0; r < l->range; r++) {
      add_energies(l, r);
    }
  }
  return progress_report(&l->request->report, 1, "measuring poses");
}

exm_status rigidity_learn(const learn_request *request, int32_t *radii, double *energies)
{
  learner l = {.request = request,
               .thread_count = omp_get_max_threads() < MOST_THREADS ? omp_get_max_threads() : MOST_THREADS};
  exm_status const status = learn(&l);
  if (status == EXM_OK) {
    choose(&l, radii);
    if (energies) {
      memcpy(energies, l.energies, l.range * request->reference->vertex_count * sizeof *energies);
    }
  }
  arena_release(&l.memory);
  return status;
}
