/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/nearest.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "base/simd.h"

enum { LEAF = 8, STACK = 64 }; /* a balanced tree of 2^32 leaves is 32 deep */

/** The left child is the next node. */
typedef struct nearest_node {
  double split;
  uint32_t right; /* 0: a leaf */
  uint32_t axis;  /* of a leaf its number */
} nearest_node;

/* --------------------------------------------------------------------------------------------------------- building */

typedef struct builder {
  const double (*points)[3];
  uint32_t *order;
  nearest *tree;
  uint32_t node_count;
} builder;

static void swap(uint32_t *a, uint32_t *b)
{
  uint32_t const kept = *a;
  *a = *b;
  *b = kept;
}

/** Hoare's selection: order[at] gets the element that belongs there, with smaller ones before it. */
static void select_nth(const builder *b, size_t axis, size_t first, size_t last, size_t at)
{
  while (last - first > 1) {
    uint32_t *order = b->order;
    double const pivot = b->points[order[first + (last - first) / 2]][axis];
    size_t i = first, j = last - 1;
    while (i <= j) {
      while (b->points[order[i]][axis] < pivot) {
        i++;
      }
      while (b->points[order[j]][axis] > pivot) {
        j--;
      }
      if (i <= j) {
        swap(&order[i++], &order[j]);
        if (j == 0) {
          break;
        }
        j--;
      }
    }
    if (at <= j && j < last) {
      last = j + 1;
    } else if (at >= i) {
      first = i;
    } else {
      return;
    }
  }
}

static size_t widest_axis(const builder *b, size_t first, size_t last)
{
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  size_t widest = 0;
  for (size_t i = first; i < last; i++) {
    const double *p = b->points[b->order[i]];
    for (size_t k = 0; k < 3; k++) {
      low[k] = p[k] < low[k] ? p[k] : low[k];
      high[k] = p[k] > high[k] ? p[k] : high[k];
    }
  }
  for (size_t k = 1; k < 3; k++) {
    widest = high[k] - low[k] > high[widest] - low[widest] ? k : widest;
  }
  return widest;
}

static void fill_leaf(const builder *b, uint32_t leaf, size_t first, size_t last)
{
  double *block = b->tree->blocks + (size_t)leaf * 3 * LEAF;
  uint32_t *indices = b->tree->indices + (size_t)leaf * LEAF;
  for (size_t i = 0; i < LEAF; i++) {
    int const is_there = first + i < last;
    indices[i] = is_there ? b->order[first + i] : NEAREST_NONE;
    for (size_t k = 0; k < 3; k++) {
      block[k * LEAF + i] = is_there ? b->points[indices[i]][k] : INFINITY;
    }
  }
}

/** Depth is the logarithm of the number of leaves. All leaves but the last are full: leaf i holds the places from 8 i.
 */
// NOLINTNEXTLINE(misc-no-recursion)
static uint32_t build(builder *b, size_t first, size_t last)
{
  uint32_t const own = b->node_count++;
  nearest_node *node = &b->tree->nodes[own];
  size_t const leaves = (last - first + LEAF - 1) / LEAF;
  if (leaves <= 1) {
    *node = (nearest_node){.axis = (uint32_t)(first / LEAF)};
    fill_leaf(b, node->axis, first, last);
    return own;
  }
  size_t const middle = first + (leaves + 1) / 2 * (size_t)LEAF, axis = widest_axis(b, first, last);
  select_nth(b, axis, first, last, middle);
  node->axis = (uint32_t)axis;
  node->split = b->points[b->order[middle]][axis];
  build(b, first, middle);
  node->right = build(b, middle, last);
  return own;
}

exm_status nearest_create(arena *owner, const double (*points)[3], size_t count, nearest *out)
{
  size_t const leaves = (count + LEAF - 1) / LEAF;
  nearest tree = {.count = count, .leaf_count = leaves};
  arena scratch = {0};
  builder b = {.points = points, .tree = &tree, .order = ARENA_NEW(&scratch, uint32_t, count)};
  tree.nodes = ARENA_NEW(owner, nearest_node, 2 * leaves);
  tree.blocks = ARENA_NEW(owner, double, leaves * 3 * LEAF);
  tree.indices = ARENA_NEW(owner, uint32_t, leaves * LEAF);
  if (!b.order || !tree.nodes || !tree.blocks || !tree.indices) {
    arena_release(&scratch);
    return status_no_memory("the index of points");
  }
  for (size_t i = 0; i < count; i++) {
    b.order[i] = (uint32_t)i;
  }
  if (count > 0) {
    build(&b, 0, count);
  }
  arena_release(&scratch);
  *out = tree;
  return EXM_OK;
}

/* ---------------------------------------------------------------------------------------------------------- queries */

typedef struct search {
  const double *query, *direction;
  const nearest_filter *filter;
  size_t wanted, found;
  uint32_t *indices; /* [wanted] nearest first */
  double *squared;
  double limit; /* squared distance that a point has to stay within */
} search;

INLINE int agrees(const search *s, uint32_t index)
{
  const nearest_filter *f = s->filter;
  if (!f || !f->normals || !s->direction) {
    return 1;
  }
  const double *a = f->normals[index], *b = s->direction;
  double const cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  int const is_known = (a[0] != 0 || a[1] != 0 || a[2] != 0) && (b[0] != 0 || b[1] != 0 || b[2] != 0);
  return !is_known || (f->is_unsigned ? fabs(cosine) : cosine) >= f->least_cosine;
}

/** Insertion; ties go to the lower index, so that the answer does not depend on the tree. */
INLINE void offer(search *s, uint32_t index, double squared)
{
  if (!agrees(s, index)) {
    return;
  }
  size_t at = s->found < s->wanted ? s->found++ : s->wanted - 1;
  if (at == s->wanted - 1 && s->indices[at] != NEAREST_NONE &&
      (squared > s->squared[at] || (squared == s->squared[at] && index > s->indices[at]))) {
    return;
  }
  while (at > 0 && (squared < s->squared[at - 1] || (squared == s->squared[at - 1] && index < s->indices[at - 1]))) {
    s->squared[at] = s->squared[at - 1];
    s->indices[at] = s->indices[at - 1];
    at--;
  }
  s->squared[at] = squared;
  s->indices[at] = index;
  if (s->found == s->wanted) {
    s->limit = s->squared[s->wanted - 1];
  }
}

INLINE void scan_leaf(const nearest *tree, uint32_t leaf, search *s)
{
  const double *block = tree->blocks + (size_t)leaf * 3 * (size_t)LEAF;
  const uint32_t *indices = tree->indices + (size_t)leaf * LEAF;
  double distances[LEAF];
  for (size_t i = 0; i < LEAF; i++) {
    double const x = block[i] - s->query[0], y = block[LEAF + i] - s->query[1],
                 z = block[2 * (size_t)LEAF + i] - s->query[2];
    distances[i] = x * x + y * y + z * z;
  }
  for (size_t i = 0; i < LEAF; i++) {
    if (distances[i] <= s->limit && indices[i] != NEAREST_NONE) {
      offer(s, indices[i], distances[i]);
    }
  }
}

/** A cell to be looked at: its distance by axis, and squared in all. */
typedef struct cell {
  double squared, offsets[3];
  uint32_t node;
} cell;

INLINE void find(const nearest *tree, search *s)
{
  cell stack[STACK];
  size_t depth = 0;
  if (tree->count > 0) {
    stack[depth++] = (cell){0};
  }
  while (depth > 0) {
    cell at = stack[--depth];
    if (at.squared > s->limit) {
      continue;
    }
    const nearest_node *node = &tree->nodes[at.node];
    while (node->right) {
      double const offset = s->query[node->axis] - node->split, old = at.offsets[node->axis];
      uint32_t const left = (uint32_t)(node - tree->nodes) + 1;
      cell *far = &stack[depth++];
      *far = at;
      far->node = offset < 0 ? node->right : left;
      far->squared = at.squared - old * old + offset * offset;
      far->offsets[node->axis] = offset;
      node = &tree->nodes[offset < 0 ? left : node->right];
    }
    scan_leaf(tree, node->axis, s);
  }
}

/* A piece of so many queries takes some tens of microseconds. */
enum { PIECE = 128 };

/** What is asked, and where the answers go. */
typedef struct inquiry {
  const nearest *tree;
  const double (*queries)[3], (*directions)[3];
  size_t count, wanted; /* wanted 0: one, within the reach */
  const nearest_filter *filter;
  double reach;
  uint32_t *indices;
  double *squared;
} inquiry;

SIMD_CLONES static void find_one_each(const inquiry *q, size_t first, size_t last)
{
  for (size_t i = first; i < last; i++) {
    double distance = INFINITY;
    search s = {.query = q->queries[i],
                .direction = q->directions ? q->directions[i] : NULL,
                .filter = q->filter,
                .wanted = 1,
                .indices = &q->indices[i],
                .squared = &distance,
                .limit = q->reach * q->reach};
    q->indices[i] = NEAREST_NONE;
    find(q->tree, &s);
    if (q->squared) {
      q->squared[i] = distance;
    }
  }
}

SIMD_CLONES static void find_several_each(const inquiry *q, size_t first, size_t last)
{
  for (size_t i = first; i < last; i++) {
    search s = {.query = q->queries[i],
                .wanted = q->wanted,
                .indices = q->indices + i * q->wanted,
                .squared = q->squared + i * q->wanted,
                .limit = INFINITY};
    for (size_t k = 0; k < q->wanted; k++) {
      s.indices[k] = NEAREST_NONE;
      s.squared[k] = INFINITY;
    }
    find(q->tree, &s);
  }
}

static void find_piece(void *context, size_t piece)
{
  const inquiry *q = context;
  size_t const first = piece * PIECE, last = first + PIECE < q->count ? first + PIECE : q->count;
  if (q->wanted > 0) {
    find_several_each(q, first, last);
  } else {
    find_one_each(q, first, last);
  }
}

void nearest_find(const nearest *tree, const double (*queries)[3], size_t count, const double (*directions)[3],
                  const nearest_filter *filter, double reach, int thread_count, uint32_t *indices, double *squared)
{
  inquiry q = {
      .tree = tree, .queries = queries, .directions = directions, .count = count, .filter = filter, .reach = reach};
  q.indices = indices;
  q.squared = squared;
  parallel_for((count + PIECE - 1) / PIECE, parallel_threads(thread_count), find_piece, &q);
}

void nearest_find_several(const nearest *tree, const double (*queries)[3], size_t count, size_t wanted,
                          int thread_count, uint32_t *indices, double *squared)
{
  inquiry q = {.tree = tree, .queries = queries, .count = count, .wanted = wanted};
  q.indices = indices;
  q.squared = squared;
  parallel_for((count + PIECE - 1) / PIECE, parallel_threads(thread_count), find_piece, &q);
}
