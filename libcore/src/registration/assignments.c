/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/assignments.h"

#include <math.h>
#include <string.h>

/* A pair may be so much closer or farther than in any exemplar at no cost: poses are new. */
static double const SLACK = 0.15;

typedef struct search {
  assignments *a;
  uint32_t *sequence; /* [size] landmarks in the order of branching, certain ones first */
  uint32_t *order;    /* [size] the point of each landmark so far */
  uint8_t *is_taken;  /* [size] points */
  double *costs;      /* [size + 1] of the beginnings */
  uint32_t *tried;    /* [size] next point to be tried at each depth */
} search;

static double pair_cost(const assignments *a, size_t i, size_t j, uint32_t point_i, uint32_t point_j)
{
  double const low = a->low[i * a->size + j] * (1 - SLACK), high = a->high[i * a->size + j] * (1 + SLACK);
  double const between = a->between[point_i * a->size + point_j];
  double const off = between < low ? low - between : between > high ? between - high : 0;
  return off * off;
}

/** What landmark sequence[depth] adds with a point. */
static double added_cost(const search *s, size_t depth, uint32_t point)
{
  double cost = 0;
  for (size_t i = 0; i < depth; i++) {
    cost += pair_cost(s->a, s->sequence[i], s->sequence[depth], s->order[s->sequence[i]], point);
  }
  return cost;
}

/** Equal costs stay in the order in which they were found. */
static void keep(const search *s, double cost)
{
  assignments *a = s->a;
  size_t at = a->count < a->capacity ? a->count++ : a->capacity - 1;
  for (; at > 0 && a->costs[at - 1] > cost; at--) {
    a->costs[at] = a->costs[at - 1];
    memcpy(a->orders + at * a->size, a->orders + (at - 1) * a->size, a->size * sizeof *a->orders);
  }
  a->costs[at] = cost;
  memcpy(a->orders + at * a->size, s->order, a->size * sizeof *a->orders);
}

static int is_hopeless(const assignments *a, double cost)
{
  return a->count == a->capacity && cost >= a->costs[a->capacity - 1];
}

/** The next permissible point of the landmark at `depth`, or `size`. */
static uint32_t next_point(const search *s, size_t depth, uint32_t from)
{
  const assignments *a = s->a;
  uint32_t const landmark = s->sequence[depth];
  if (a->groups[landmark] < 0) {
    return from == 0 ? landmark : (uint32_t)a->size;
  }
  while (from < a->size && (s->is_taken[from] || a->groups[from] != a->groups[landmark])) {
    from++;
  }
  return from;
}

/** Depth first, without recursion: tried[depth] is where the search goes on. */
static void run(search *s)
{
  assignments *a = s->a;
  size_t depth = 0;
  s->tried[0] = 0;
  for (;;) {
    uint32_t const landmark = s->sequence[depth];
    uint32_t const point = next_point(s, depth, s->tried[depth]);
    if (point >= a->size) {
      if (depth == 0) {
        return;
      }
      depth--;
      s->is_taken[s->order[s->sequence[depth]]] = 0;
      continue;
    }
    s->tried[depth] = a->groups[landmark] < 0 ? 1 : point + 1;
    double const cost = s->costs[depth] + added_cost(s, depth, point);
    if (is_hopeless(a, cost)) {
      continue;
    }
    s->order[landmark] = point;
    if (depth + 1 == a->size) {
      keep(s, cost);
      continue;
    }
    s->is_taken[point] = 1;
    s->costs[++depth] = cost;
    s->tried[depth] = 0;
  }
}

/** Certain landmarks bound the rest from the beginning. */
static void set_sequence(search *s)
{
  size_t next = 0;
  for (int is_certain = 1; is_certain >= 0; is_certain--) {
    for (size_t i = 0; i < s->a->size; i++) {
      if ((s->a->groups[i] < 0) == is_certain) {
        s->sequence[next++] = (uint32_t)i;
      }
    }
  }
}

/** The product of the factorials of the groups' sizes. */
static double count_permissible(const assignments *a)
{
  double count = 1;
  for (size_t i = 0; i < a->size; i++) {
    size_t before = 0;
    for (size_t j = 0; j <= i; j++) {
      before += a->groups[i] >= 0 && a->groups[j] == a->groups[i];
    }
    count *= before > 0 ? (double)before : 1;
  }
  return count;
}

exm_status assignments_find(arena *owner, assignments *a)
{
  arena scratch = {0};
  search s = {.a = a,
              .sequence = ARENA_NEW(&scratch, uint32_t, a->size),
              .order = ARENA_NEW(&scratch, uint32_t, a->size),
              .is_taken = ARENA_NEW(&scratch, uint8_t, a->size),
              .costs = ARENA_NEW(&scratch, double, a->size + 1),
              .tried = ARENA_NEW(&scratch, uint32_t, a->size)};
  a->orders = ARENA_NEW(owner, uint32_t, a->capacity * a->size);
  a->costs = ARENA_NEW(owner, double, a->capacity);
  if (!s.sequence || !s.order || !s.is_taken || !s.costs || !s.tried || !a->orders || !a->costs) {
    arena_release(&scratch);
    return status_no_memory("the search");
  }
  a->count = 0;
  a->permissible = count_permissible(a);
  set_sequence(&s);
  run(&s);
  arena_release(&scratch);
  return EXM_OK;
}
