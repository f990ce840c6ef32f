/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/coarse.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  RINGS = 2,    /* regions: no two seeds are within this many edges, no vertex is farther from all of them */
  FEWEST = 600, /* nodes: a level of fewer is not made coarser */
  ANCHORS = 4,  /* fixed nodes for an oriented handle at least, if it has as many vertices */
  ITERATIONS = 200
};

/* About how many of the finer rings a ring of regions is: seeds are between RINGS and 2 RINGS + 1 apart. */
static double const WIDTH = 1.5 * RINGS;

static double const TOLERANCE = 1e-4;

struct coarse_level {
  arena memory;
  size_t count;
  uint32_t *labels; /* [finer vertices] the region of each */
  double (*positions)[3];
  int32_t *radii;
  double *counts;
  spokes s;
  held h;
  set_sums balls;
  sparse pattern;
  rigidity_system system;
  rigidity_solver solver;
  row12 *before; /* [count] rotations of the last solve but one */
  coarse_level *coarser;
};

#define NONE UINT32_MAX

typedef struct builder {
  const coarse_source *fine;
  arena scratch;
  uint32_t *seeds; /* [V] */
  size_t seed_count;
  uint32_t *held_by; /* [V] index of the fixed vertex that a vertex is, or NONE */
  uint32_t *queue, *depth, *marks;
  unsigned char *is_covered;
} builder;

/* ------------------------------------------------------------------------------------------------------------- seeds
 */

/* A seed takes in what is within RINGS edges. */
static void plant(builder *b, uint32_t seed)
{
  const rings *around = &b->fine->s->around;
  size_t count = 0;
  uint32_t const mark = (uint32_t)b->seed_count + 1;
  b->seeds[b->seed_count++] = seed;
  b->queue[count++] = seed;
  b->marks[seed] = mark;
  b->depth[seed] = 0;
  for (size_t head = 0; head < count; head++) {
    uint32_t const v = b->queue[head];
    b->is_covered[v] = 1;
    for (uint32_t e = around->offsets[v]; e < around->offsets[v + 1] && b->depth[v] < RINGS; e++) {
      uint32_t const j = around->neighbors[e];
      if (b->marks[j] != mark) {
        b->marks[j] = mark;
        b->depth[j] = b->depth[v] + 1;
        b->queue[count++] = j;
      }
    }
  }
}

static double square_distance(const double a[3], const double b[3])
{
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

/* Fixed vertices first..last belong to one handle: seeds at a few of them, each far from those before it, so that the
 * handle's turn is felt. nearest [last - first] is scratch. */
static void plant_anchors(builder *b, size_t first, size_t last, double *nearest)
{
  const held_vertex *fixed = b->fine->h->fixed;
  for (size_t i = first; i < last; i++) {
    nearest[i - first] = DBL_MAX;
  }
  for (size_t anchor = 0; anchor < ANCHORS && anchor < last - first; anchor++) {
    size_t best = first;
    for (size_t i = first; i < last; i++) {
      best = nearest[i - first] > nearest[best - first] ? i : best;
    }
    const double *at = b->fine->positions[fixed[best].vertex];
    plant(b, fixed[best].vertex);
    for (size_t i = first; i < last; i++) {
      nearest[i - first] = fmin(nearest[i - first], square_distance(at, b->fine->positions[fixed[i].vertex]));
    }
    nearest[best - first] = -1;
  }
}

static exm_status find_seeds(builder *b)
{
  const held *h = b->fine->h;
  size_t const V = b->fine->s->around.vertex_count;
  double *nearest = ARENA_NEW(&b->scratch, double, h->fixed_count);
  if (!nearest) {
    return status_no_memory("a coarse start");
  }
  for (size_t first = 0, last; first < h->fixed_count; first = last) {
    for (last = first; last < h->fixed_count && h->fixed[last].handle == h->fixed[first].handle; last++) {
    }
    plant_anchors(b, first, last, nearest);
  }
  for (size_t q = 0; q < h->patch_count; q++) {
    plant(b, h->patch_vertices[h->patches[q].begin]);
  }
  for (uint32_t v = 0; v < V; v++) {
    if (!b->is_covered[v]) {
      plant(b, v);
    }
  }
  return EXM_OK;
}

/* Each vertex to the seed with the fewest edges between. */
static void find_labels(builder *b, uint32_t *labels)
{
  const rings *around = &b->fine->s->around;
  memset(labels, 0xff, around->vertex_count * sizeof *labels);
  for (size_t i = 0; i < b->seed_count; i++) {
    labels[b->seeds[i]] = (uint32_t)i;
    b->queue[i] = b->seeds[i];
  }
  size_t count = b->seed_count;
  for (size_t head = 0; head < count; head++) {
    uint32_t const v = b->queue[head];
    for (uint32_t e = around->offsets[v]; e < around->offsets[v + 1]; e++) {
      uint32_t const j = around->neighbors[e];
      if (labels[j] == NONE) {
        labels[j] = labels[v];
        b->queue[count++] = j;
      }
    }
  }
}

/* ------------------------------------------------------------------------------------------------------------- nodes
 */

/* What is fixed of the finer level and is a seed; patches' seeds follow their handle without turning. */
static exm_status hold_nodes(builder *b, coarse_level *level)
{
  const held *fine = b->fine->h;
  held *h = &level->h;
  h->handle_count = fine->handle_count;
  h->kinds = ARENA_NEW(&h->memory, int32_t, fine->handle_count);
  h->fixed = ARENA_NEW(&h->memory, held_vertex, level->count);
  h->is_out = ARENA_NEW(&h->memory, unsigned char, level->count);
  h->centres = arena_array(&h->memory, fine->handle_count, sizeof *h->centres);
  if (!h->kinds || !h->fixed || !h->is_out || !h->centres) {
    return status_no_memory("a coarse start");
  }
  memcpy(h->kinds, fine->kinds, fine->handle_count * sizeof *h->kinds);
  memcpy(h->centres, fine->centres, fine->handle_count * sizeof *h->centres);
  for (uint32_t node = 0; node < level->count; node++) {
    uint32_t const by = b->held_by[b->seeds[node]];
    if (by == NONE) {
      continue;
    }
    held_vertex fixed = {.vertex = node};
    if (by < fine->fixed_count) {
      fixed = fine->fixed[by];
      fixed.vertex = node;
    } else {
      fixed.handle = fine->patches[by - fine->fixed_count].handle;
      for (int k = 0; k < 3; k++) {
        fixed.arm[k] = b->fine->positions[b->seeds[node]][k] - fine->centres[fixed.handle][k];
      }
    }
    h->fixed[h->fixed_count++] = fixed;
    h->is_out[node] = 1;
  }
  return EXM_OK;
}

/* Free nodes are in the middle of their regions; radii are means over them. */
static exm_status place_nodes(builder *b, coarse_level *level)
{
  size_t const V = b->fine->s->around.vertex_count;
  double *sizes = ARENA_NEW(&b->scratch, double, level->count);
  double *radii = ARENA_NEW(&b->scratch, double, level->count);
  level->positions = arena_array(&level->memory, level->count, sizeof *level->positions);
  level->radii = ARENA_NEW(&level->memory, int32_t, level->count);
  if (!sizes || !radii || !level->positions || !level->radii) {
    return status_no_memory("a coarse start");
  }
  for (size_t v = 0; v < V; v++) {
    size_t const node = level->labels[v];
    sizes[node]++;
    radii[node] += b->fine->radii[v];
    for (int k = 0; k < 3; k++) {
      level->positions[node][k] += b->fine->positions[v][k];
    }
  }
  for (size_t node = 0; node < level->count; node++) {
    level->radii[node] = 1 + (int32_t)lround((radii[node] / sizes[node] - 1) / WIDTH);
    for (int k = 0; k < 3; k++) {
      level->positions[node][k] =
          level->h.is_out[node] ? b->fine->positions[b->seeds[node]][k] : level->positions[node][k] / sizes[node];
    }
  }
  return EXM_OK;
}

/* ------------------------------------------------------------------------------------------------------------- edges
 */

typedef struct link {
  uint32_t from, to;
  double weight;
} link;

static int compare_links(const void *a, const void *b)
{
  const link *x = a, *y = b;
  if (x->from != y->from) {
    return x->from < y->from ? -1 : 1;
  }
  return (x->to > y->to) - (x->to < y->to);
}

/* The sums of weights between regions, sorted. The order of summation is that of the finer edges, for the sort is of
 * regions region by region. */
static exm_status find_links(builder *b, const coarse_level *level, link **out, size_t *out_count)
{
  const spokes *s = b->fine->s;
  size_t const V = s->around.vertex_count;
  size_t count = 0, kept = 0;
  link *links = ARENA_NEW(&b->scratch, link, s->around.offsets[V]);
  if (!links) {
    return status_no_memory("a coarse start");
  }
  for (size_t v = 0; v < V; v++) {
    for (uint32_t e = s->around.offsets[v]; e < s->around.offsets[v + 1]; e++) {
      uint32_t const from = level->labels[v], to = level->labels[s->around.neighbors[e]];
      if (from != to) {
        links[count++] = (link){.from = from, .to = to, .weight = s->weights[e]};
      }
    }
  }
  qsort(links, count, sizeof *links, compare_links);
  for (size_t i = 0; i < count; i++) {
    if (kept > 0 && compare_links(&links[kept - 1], &links[i]) == 0) {
      links[kept - 1].weight += links[i].weight;
    } else {
      links[kept++] = links[i];
    }
  }
  *out = links;
  *out_count = kept;
  return EXM_OK;
}

static exm_status join_nodes(builder *b, coarse_level *level)
{
  link *links;
  size_t count;
  TRY(find_links(b, level, &links, &count));
  uint32_t *offsets = ARENA_NEW(&level->memory, uint32_t, level->count + 1);
  uint32_t *neighbors = ARENA_NEW(&level->memory, uint32_t, count);
  spokes *s = &level->s;
  s->weights = ARENA_NEW(&level->memory, double, count);
  s->arms = ARENA_NEW(&level->memory, four, count);
  s->rest = ARENA_NEW(&level->memory, double, level->count);
  if (!offsets || !neighbors || !s->weights || !s->arms || !s->rest) {
    return status_no_memory("a coarse start");
  }
  for (size_t i = 0; i < count; i++) {
    double arm[4] = {0};
    offsets[links[i].from + 1]++;
    neighbors[i] = links[i].to;
    s->weights[i] = links[i].weight;
    for (int k = 0; k < 3; k++) {
      double const length = level->positions[links[i].from][k] - level->positions[links[i].to][k];
      arm[k] = links[i].weight * length;
      s->rest[links[i].from] += arm[k] * length;
    }
    memcpy(&s->arms[i], arm, sizeof arm);
  }
  for (size_t node = 0; node < level->count; node++) {
    offsets[node + 1] += offsets[node];
  }
  s->around = (rings){.vertex_count = level->count, .offsets = offsets, .neighbors = neighbors};
  return EXM_OK;
}

/* --------------------------------------------------------------------------------------------------------- the whole
 */

static exm_status build(builder *b, coarse_level *level)
{
  size_t const V = b->fine->s->around.vertex_count;
  level->count = b->seed_count;
  level->labels = ARENA_NEW(&level->memory, uint32_t, V);
  level->counts = ARENA_NEW(&level->memory, double, level->count);
  level->before = ARENA_NEW(&level->memory, row12, level->count);
  if (!level->labels || !level->counts || !level->before) {
    return status_no_memory("a coarse start");
  }
  find_labels(b, level->labels);
  TRY(hold_nodes(b, level));
  TRY(place_nodes(b, level));
  TRY(join_nodes(b, level));
  TRY(balls_create(&level->memory, &level->s.around, level->radii, NULL, level->counts, &level->balls));
  TRY(system_pattern(&level->memory, &level->s.around, &level->pattern));
  TRY(system_create(&level->s, &level->h, &level->pattern, level->counts, NULL, &level->system));
  TRY(solver_create(&level->memory, level->count, &level->solver));
  level->solver.now.disc_rotations = level->system.disc_rotations[0];
  level->solver.next.disc_rotations = level->system.disc_rotations[1];
  coarse_source const own = {
      .s = &level->s, .positions = (const double(*)[3])level->positions, .radii = level->radii, .h = &level->h};
  return coarse_create(&own, &level->coarser);
}

static exm_status prepare(builder *b)
{
  size_t const V = b->fine->s->around.vertex_count;
  b->seeds = ARENA_NEW(&b->scratch, uint32_t, V);
  b->held_by = ARENA_NEW(&b->scratch, uint32_t, V);
  b->queue = ARENA_NEW(&b->scratch, uint32_t, V);
  b->depth = ARENA_NEW(&b->scratch, uint32_t, V);
  b->marks = ARENA_NEW(&b->scratch, uint32_t, V);
  b->is_covered = ARENA_NEW(&b->scratch, unsigned char, V);
  if (!b->seeds || !b->held_by || !b->queue || !b->depth || !b->marks || !b->is_covered) {
    return status_no_memory("a coarse start");
  }
  const held *h = b->fine->h;
  memset(b->held_by, 0xff, V * sizeof *b->held_by);
  for (size_t f = 0; f < h->fixed_count; f++) {
    b->held_by[h->fixed[f].vertex] = (uint32_t)f;
  }
  for (size_t q = 0; q < h->patch_count; q++) {
    b->held_by[h->patch_vertices[h->patches[q].begin]] = (uint32_t)(h->fixed_count + q);
  }
  return find_seeds(b);
}

exm_status coarse_create(const coarse_source *fine, coarse_level **out)
{
  size_t const V = fine->s->around.vertex_count;
  *out = NULL;
  if (V < FEWEST) {
    return EXM_OK;
  }
  builder b = {.fine = fine};
  exm_status status = prepare(&b);
  if (status == EXM_OK && b.seed_count < V / 3) {
    coarse_level *level = calloc(1, sizeof *level);
    status = level ? build(&b, level) : status_no_memory("a coarse start");
    if (status < 0) {
      coarse_destroy(level);
      level = NULL;
    }
    *out = level;
  }
  arena_release(&b.scratch);
  return status;
}

void coarse_destroy(coarse_level *level)
{
  if (!level) {
    return;
  }
  coarse_destroy(level->coarser);
  system_destroy(&level->system);
  held_destroy(&level->h);
  arena_release(&level->memory);
  free(level);
}

/* From the rotations in solver.next. */
static exm_status run(coarse_level *level, const double *targets)
{
  rigidity_problem const problem = {.s = &level->s, .balls = &level->balls, .h = &level->h, .system = &level->system};
  rigidity_options const options = {.tolerance = TOLERANCE, .iterations = ITERATIONS, .has_acceleration = 1};
  exm_solve_report report = {0};
  return solver_run(&level->solver, &problem, targets, &options, &report);
}

exm_status coarse_start(coarse_level *level, const double *targets, size_t count, row12 *rotations)
{
  rigidity_problem const problem = {.s = &level->s, .h = &level->h};
  if (level->coarser) {
    TRY(coarse_start(level->coarser, targets, level->count, level->solver.next.rotations));
  } else {
    solver_identity(&problem, level->solver.next.rotations, NULL);
  }
  TRY(run(level, targets));
  for (size_t v = 0; v < count; v++) {
    rotations[v] = level->solver.now.rotations[level->labels[v]];
  }
  return EXM_OK;
}

/* R <- R_now R_before' R, all of them transposed: row-major products in the other order. */
static void turn_along(const row12 *before, const row12 *now, row12 *rotation)
{
  double a[12], b[12], r[12], change[3][3] = {{0}}, out[12] = {0};
  memcpy(a, before, sizeof a);
  memcpy(b, now, sizeof b);
  memcpy(r, rotation, sizeof r);
  for (size_t i = 0; i < 27; i++) {
    size_t const row = i / 9, column = i / 3 % 3, k = i % 3;
    change[row][column] += a[4 * k + row] * b[4 * k + column];
  }
  for (size_t i = 0; i < 27; i++) {
    size_t const row = i / 9, column = i / 3 % 3, k = i % 3;
    out[4 * row + column] += r[4 * row + k] * change[k][column];
  }
  memcpy(rotation, out, sizeof out);
}

exm_status coarse_advance(coarse_level *level, const double *targets, size_t count, row12 *rotations)
{
  size_t const bytes = level->count * sizeof *level->before;
  memcpy(level->before, level->solver.now.rotations, bytes);
  memcpy(level->solver.next.rotations, level->before, bytes);
  if (level->coarser) {
    TRY(coarse_advance(level->coarser, targets, level->count, level->solver.next.rotations));
  }
  TRY(run(level, targets));
  for (size_t v = 0; v < count; v++) {
    uint32_t const node = level->labels[v];
    turn_along(&level->before[node], &level->solver.now.rotations[node], &rotations[v]);
  }
  return EXM_OK;
}
