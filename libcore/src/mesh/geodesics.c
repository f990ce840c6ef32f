/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/geodesics.h"

#include <math.h>

#define OUTSIDE UINT32_MAX

/* ------------------------------------------------------------------------------------------------------------- heap */

static void place(geodesics *g, size_t at, uint32_t vertex)
{
  g->heap[at] = vertex;
  g->places[vertex] = (uint32_t)at;
}

static void rise(geodesics *g, uint32_t vertex)
{
  size_t at = g->places[vertex];
  while (at > 0 && g->distances[vertex] < g->distances[g->heap[(at - 1) / 2]]) {
    place(g, at, g->heap[(at - 1) / 2]);
    at = (at - 1) / 2;
  }
  place(g, at, vertex);
}

static uint32_t pop(geodesics *g)
{
  uint32_t const first = g->heap[0], last = g->heap[--g->heap_count];
  size_t at = 0;
  g->places[first] = OUTSIDE;
  while (g->heap_count > 0) {
    size_t child = 2 * at + 1;
    if (child + 1 < g->heap_count && g->distances[g->heap[child + 1]] < g->distances[g->heap[child]]) {
      child++;
    }
    if (child >= g->heap_count || g->distances[g->heap[child]] >= g->distances[last]) {
      place(g, at, last);
      break;
    }
    place(g, at, g->heap[child]);
    at = child;
  }
  return first;
}

static void offer(geodesics *g, uint32_t vertex, double distance, double radius)
{
  if (distance > radius || distance >= g->distances[vertex]) {
    return;
  }
  if (isinf(g->distances[vertex])) {
    g->vertices[g->count++] = vertex;
  }
  g->distances[vertex] = distance;
  if (g->places[vertex] == OUTSIDE) {
    place(g, g->heap_count++, vertex);
  }
  rise(g, vertex);
}

/* ------------------------------------------------------------------------------------------------------------ front */

static double distance_between(const double a[3], const double b[3])
{
  double const x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

/** Distance of c from the source that is da from a and db from b, all in one plane, the source on the far side of ab;
 *  infinite where the straight way does not cross ab. */
static double across(const double a[3], const double b[3], const double c[3], double da, double db)
{
  double const ab = distance_between(a, b);
  if (!(ab > 0)) {
    return INFINITY;
  }
  double along = 0, ac2 = 0;
  for (int k = 0; k < 3; k++) {
    along += (b[k] - a[k]) / ab * (c[k] - a[k]);
    ac2 += (c[k] - a[k]) * (c[k] - a[k]);
  }
  double const height = sqrt(fmax(ac2 - along * along, 0));
  double const source = (ab * ab + da * da - db * db) / (2 * ab);
  double const depth = sqrt(fmax(da * da - source * source, 0));
  if (!(height + depth > 0)) {
    return INFINITY;
  }
  double const crossing = source + (along - source) * depth / (height + depth);
  return crossing >= 0 && crossing <= ab ? hypot(along - source, height + depth) : INFINITY;
}

static void cross_triangle(geodesics *g, const uint32_t corners[3], uint32_t from, double radius)
{
  uint32_t others[2] = {0};
  size_t found = 0;
  for (int i = 0; i < 3; i++) {
    if (corners[i] != from && found < 2) {
      others[found++] = corners[i];
    }
  }
  const double(*p)[3] = g->positions;
  for (size_t i = 0; i < found; i++) {
    uint32_t const to = others[i], with = others[1 - i];
    double const d = g->distances[from];
    offer(g, to, d + distance_between(p[from], p[to]), radius);
    if (!isinf(g->distances[with])) {
      offer(g, to, across(p[from], p[with], p[to], d, g->distances[with]), radius);
    }
  }
}

static void spread(geodesics *g, uint32_t from, double radius)
{
  for (uint32_t i = g->offsets[from]; i < g->offsets[from + 1]; i++) {
    if (g->is_cloud) {
      uint32_t const to = g->faces[i];
      offer(g, to, g->distances[from] + distance_between(g->positions[from], g->positions[to]), radius);
    } else {
      cross_triangle(g, g->triangles[g->faces[i]], from, radius);
    }
  }
}

void geodesics_disc(geodesics *g, uint32_t source, double radius)
{
  while (g->count > 0) {
    uint32_t const vertex = g->vertices[--g->count];
    g->distances[vertex] = INFINITY;
    g->places[vertex] = OUTSIDE;
  }
  g->heap_count = 0;
  offer(g, source, 0, radius);
  while (g->heap_count > 0) {
    /* A triangle with an obtuse corner may bring a vertex closer after its turn; it then comes once more. */
    spread(g, pop(g), radius);
  }
}

/* --------------------------------------------------------------------------------------------------------- creation */

static exm_status allocate(arena *owner, geodesics *g, size_t entry_count)
{
  size_t const V = g->vertex_count;
  g->offsets = ARENA_NEW(owner, uint32_t, V + 1);
  g->faces = ARENA_NEW(owner, uint32_t, entry_count);
  g->vertices = ARENA_NEW(owner, uint32_t, V);
  g->distances = ARENA_NEW(owner, double, V);
  g->places = ARENA_NEW(owner, uint32_t, V);
  g->heap = ARENA_NEW(owner, uint32_t, V);
  if (!g->offsets || !g->faces || !g->vertices || !g->distances || !g->places || !g->heap) {
    return status_no_memory("geodesic discs");
  }
  for (size_t v = 0; v < V; v++) {
    g->distances[v] = INFINITY;
    g->places[v] = OUTSIDE;
  }
  return EXM_OK;
}

/** Triangles around each vertex. */
static void gather(geodesics *g, size_t triangle_count)
{
  uint32_t *next = g->heap; /* free as yet */
  for (size_t i = 0; i < 3 * triangle_count; i++) {
    g->offsets[g->triangles[i / 3][i % 3] + 1]++;
  }
  for (size_t v = 0; v < g->vertex_count; v++) {
    g->offsets[v + 1] += g->offsets[v];
    next[v] = g->offsets[v];
  }
  for (size_t i = 0; i < 3 * triangle_count; i++) {
    g->faces[next[g->triangles[i / 3][i % 3]]++] = (uint32_t)(i / 3);
  }
}

exm_status geodesics_create(arena *owner, const double (*positions)[3], size_t vertex_count,
                            const uint32_t (*triangles)[3], size_t triangle_count, geodesics *out)
{
  geodesics g = {.vertex_count = vertex_count, .positions = positions, .triangles = triangles};
  TRY(allocate(owner, &g, 3 * triangle_count));
  gather(&g, triangle_count);
  *out = g;
  return EXM_OK;
}

exm_status geodesics_create_cloud(arena *owner, const double (*positions)[3], size_t vertex_count,
                                  const uint32_t *neighbors, size_t each, geodesics *out)
{
  geodesics g = {.vertex_count = vertex_count, .positions = positions, .is_cloud = 1};
  TRY(allocate(owner, &g, vertex_count * each));
  uint32_t count = 0;
  for (size_t v = 0; v < vertex_count; v++) {
    for (size_t i = 0; i < each; i++) {
      uint32_t const neighbor = neighbors[v * each + i];
      if (neighbor != OUTSIDE && neighbor != v) {
        g.faces[count++] = neighbor;
      }
    }
    g.offsets[v + 1] = count;
  }
  *out = g;
  return EXM_OK;
}
