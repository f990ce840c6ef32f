/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/held.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* An oriented handle's vertices span a direction where their spread along it is this share of the largest. */
static double const FLAT = 1e-6;
enum { RINGS_MAXIMUM = 8 };

/* A disc is no narrower than this many edges about its centre: there has to be something that it can bend. */
static double const FEWEST_EDGES = 2.5;
/* Nor stiffer in its middle than this, whatever the resolution. */
static double const STIFFEST = 1e4;

typedef struct builder {
  const mesh *m;
  const exm_handles *handles;
  held *h;
  uint32_t *owners;    /* [V] handle that holds a vertex, or HELD_NONE */
  uint32_t *queue;     /* [V] */
  uint32_t *seen;      /* [V] of the last handle that came by, plus one */
  uint32_t *part_list; /* [V] */
  arena scratch;
} builder;

static double distance(const double a[3], const double b[3])
{
  return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void add_fixed(builder *b, uint32_t vertex, uint32_t handle)
{
  held_vertex fixed = {.vertex = vertex, .handle = handle};
  for (int k = 0; k < 3; k++) {
    fixed.arm[k] = b->m->positions[vertex][k] - b->h->centres[handle][k];
  }
  b->h->fixed[b->h->fixed_count++] = fixed;
  b->h->is_out[vertex] = 1;
}

/* ---------------------------------------------------------------------------------------------------------- oriented
 */

/* Do the points span an area? Their second moments have a second eigenvalue: tr^2 - |M|^2 = 2 sum of products of two.
 */
static int spans_area(const mesh *m, const uint32_t *vertices, size_t count)
{
  double mean[3] = {0}, moments[3][3] = {{0}}, trace = 0, square = 0;
  for (size_t i = 0; i < count; i++) {
    for (int k = 0; k < 3; k++) {
      mean[k] += m->positions[vertices[i]][k] / (double)count;
    }
  }
  for (size_t i = 0; i < count; i++) {
    for (int k = 0; k < 9; k++) {
      const double *p = m->positions[vertices[i]];
      moments[k / 3][k % 3] += (p[k / 3] - mean[k / 3]) * (p[k % 3] - mean[k % 3]);
    }
  }
  for (int k = 0; k < 9; k++) {
    trace += k % 4 == 0 ? moments[k / 3][k % 3] : 0;
    square += moments[k / 3][k % 3] * moments[k / 3][k % 3];
  }
  return trace * trace - square > 2 * FLAT * trace * trace;
}

static void fix_oriented(builder *b, uint32_t handle)
{
  const mesh *m = b->m;
  size_t const first = b->handles->vertex_offsets[handle], last = b->handles->vertex_offsets[handle + 1];
  size_t count = last - first, begin = 0;
  memcpy(b->queue, b->handles->vertices + first, count * sizeof *b->queue);
  for (int ring = 0; ring < RINGS_MAXIMUM && !spans_area(m, b->queue, count); ring++) {
    size_t const end = count;
    for (size_t i = begin; i < end; i++) {
      for (uint32_t e = m->neighbor_offsets[b->queue[i]]; e < m->neighbor_offsets[b->queue[i] + 1]; e++) {
        uint32_t const j = m->neighbors[e];
        if (b->owners[j] == HELD_NONE) {
          b->owners[j] = handle;
          b->queue[count++] = j;
        }
      }
    }
    begin = end;
  }
  for (size_t i = 0; i < count; i++) {
    add_fixed(b, b->queue[i], handle);
  }
}

/* ------------------------------------------------------------------------------------------------------------ pinned
 */

/* The handle's vertices on one connected part: alone they are fixed, together they are a patch. */
static void hold_share(builder *b, uint32_t handle, const uint32_t *vertices, size_t count)
{
  held *h = b->h;
  if (count == 1) {
    add_fixed(b, vertices[0], handle);
    return;
  }
  uint32_t const begin = h->patch_count ? h->patches[h->patch_count - 1].end : 0;
  held_patch patch = {.handle = handle, .begin = begin, .end = begin + (uint32_t)count, .ground = HELD_NONE};
  for (size_t i = 0; i < count; i++) {
    h->patch_vertices[begin + i] = vertices[i];
    for (int k = 0; k < 3; k++) {
      patch.arm[k] += (b->m->positions[vertices[i]][k] - h->centres[handle][k]) / (double)count;
    }
  }
  h->patches[h->patch_count++] = patch;
}

static void hold_pinned(builder *b, uint32_t handle)
{
  size_t const first = b->handles->vertex_offsets[handle], last = b->handles->vertex_offsets[handle + 1];
  const uint32_t *components = b->m->components;
  size_t left = last - first;
  memcpy(b->queue, b->handles->vertices + first, left * sizeof *b->queue);
  while (left > 0) {
    uint32_t const component = components[b->queue[0]];
    size_t taken = 0, kept = 0;
    for (size_t i = 0; i < left; i++) {
      if (components[b->queue[i]] == component) {
        b->part_list[taken++] = b->queue[i];
      } else {
        b->queue[kept++] = b->queue[i];
      }
    }
    hold_share(b, handle, b->part_list, taken);
    left = kept;
  }
}

static exm_status find_grounds(builder *b)
{
  held *h = b->h;
  size_t const parts = b->m->report.component_count;
  unsigned char *is_fixed = ARENA_NEW(&b->scratch, unsigned char, parts);
  h->grounds = ARENA_NEW(&h->memory, uint32_t, h->patch_count);
  h->component_grounds = ARENA_NEW(&h->memory, uint32_t, parts);
  if (!is_fixed || !h->grounds || !h->component_grounds) {
    return status_no_memory("the handles");
  }
  for (size_t i = 0; i < h->fixed_count; i++) {
    is_fixed[b->m->components[h->fixed[i].vertex]] = 1;
  }
  for (size_t p = 0; p < parts; p++) {
    h->component_grounds[p] = HELD_NONE;
  }
  for (size_t i = 0; i < h->patch_count; i++) {
    uint32_t const vertex = h->patch_vertices[h->patches[i].begin], part = b->m->components[vertex];
    if (!is_fixed[part] && h->component_grounds[part] == HELD_NONE) {
      h->component_grounds[part] = (uint32_t)h->ground_count;
      h->grounds[h->ground_count++] = vertex;
      h->is_out[vertex] = 1;
    }
    h->patches[i].ground = h->component_grounds[part];
  }
  return EXM_OK;
}

/* ------------------------------------------------------------------------------------------------------------- discs
 */

typedef struct disc {
  double centre[3], radius, inner; /* closer than `inner` counts as if it were there */
} disc;

/* The vertices that are connected to the handle's within a ball about its centre, into the queue; and how far the
 * nearest vertex is that another handle holds. */
static size_t flood(builder *b, uint32_t handle, const disc *d, uint32_t mark, double *nearest)
{
  const mesh *m = b->m;
  size_t count = 0;
  *nearest = DBL_MAX;
  for (size_t i = b->handles->vertex_offsets[handle]; i < b->handles->vertex_offsets[handle + 1]; i++) {
    b->queue[count++] = b->handles->vertices[i];
    b->seen[b->handles->vertices[i]] = mark;
  }
  for (size_t head = 0; head < count; head++) {
    uint32_t const v = b->queue[head];
    for (uint32_t e = m->neighbor_offsets[v]; e < m->neighbor_offsets[v + 1]; e++) {
      uint32_t const j = m->neighbors[e];
      double const far = distance(m->positions[j], d->centre);
      if (b->seen[j] == mark || far >= d->radius) {
        continue;
      }
      b->seen[j] = mark;
      b->queue[count++] = j;
      if (b->owners[j] != HELD_NONE && b->owners[j] != handle) {
        *nearest = fmin(*nearest, far);
      }
    }
  }
  return count;
}

static double mean_edge_around(const builder *b, uint32_t handle)
{
  const mesh *m = b->m;
  double sum = 0, count = 0;
  for (size_t i = b->handles->vertex_offsets[handle]; i < b->handles->vertex_offsets[handle + 1]; i++) {
    uint32_t const v = b->handles->vertices[i];
    for (uint32_t e = m->neighbor_offsets[v]; e < m->neighbor_offsets[v + 1]; e++) {
      sum += distance(m->positions[v], m->positions[m->neighbors[e]]);
      count++;
    }
  }
  return count > 0 ? sum / count : 0;
}

/* Appends to lists that grow in the scratch of nobody else: their size is known only at the end, so discs are flooded
 * twice, first to count (`weights` NULL). Returns how many vertices the disc has. */
static size_t measure_disc(builder *b, uint32_t handle, double wanted, uint32_t *mark, uint32_t *vertices,
                           double *weights)
{
  const mesh *m = b->m;
  double const edge = mean_edge_around(b, handle);
  disc d = {.radius = fmax(wanted, FEWEST_EDGES * edge), .inner = edge / 2};
  memcpy(d.centre, b->h->centres[handle], sizeof d.centre);
  for (size_t i = b->handles->vertex_offsets[handle]; i < b->handles->vertex_offsets[handle + 1]; i++) {
    d.inner = fmax(d.inner, distance(m->positions[b->handles->vertices[i]], d.centre));
  }
  double nearest;
  flood(b, handle, &d, ++*mark, &nearest);
  /* Discs that met would hold two handles together. */
  d.radius = fmin(d.radius, nearest / 2);
  if (d.inner >= d.radius) {
    return 0;
  }
  size_t const count = flood(b, handle, &d, ++*mark, &nearest);
  for (size_t i = 0; i < count && weights; i++) {
    double const far = fmax(distance(m->positions[b->queue[i]], d.centre), d.inner);
    vertices[i] = b->queue[i];
    weights[i] = fmin(STIFFEST, d.radius * d.radius / (far * far) - 1);
  }
  return count;
}

static exm_status find_discs(builder *b, double radius)
{
  held *h = b->h;
  uint32_t mark = 0;
  h->disc_offsets = ARENA_NEW(&h->memory, uint32_t, h->handle_count + 1);
  if (!h->disc_offsets) {
    return status_no_memory("the handles");
  }
  size_t total = 0;
  for (uint32_t handle = 0; handle < h->handle_count; handle++) {
    total += h->kinds[handle] == EXM_HANDLE_PINNED ? measure_disc(b, handle, radius, &mark, NULL, NULL) : 0;
  }
  h->disc_vertices = ARENA_NEW(&h->memory, uint32_t, total);
  h->disc_weights = ARENA_NEW(&h->memory, double, total);
  if (!h->disc_vertices || !h->disc_weights || total >= UINT32_MAX) {
    return status_no_memory("the handles");
  }
  for (uint32_t handle = 0; handle < h->handle_count; handle++) {
    uint32_t const begin = h->disc_offsets[h->disc_count];
    size_t const count =
        h->kinds[handle] != EXM_HANDLE_PINNED
            ? 0
            : measure_disc(b, handle, radius, &mark, h->disc_vertices + begin, h->disc_weights + begin);
    if (count > 0) {
      h->disc_offsets[++h->disc_count] = begin + (uint32_t)count;
    }
  }
  return EXM_OK;
}

/* --------------------------------------------------------------------------------------------------------- the whole
 */

static void find_centres(builder *b)
{
  held *h = b->h;
  for (uint32_t handle = 0; handle < h->handle_count; handle++) {
    size_t const first = b->handles->vertex_offsets[handle], last = b->handles->vertex_offsets[handle + 1];
    h->kinds[handle] = b->handles->kinds[handle];
    for (size_t i = first; i < last; i++) {
      uint32_t const v = b->handles->vertices[i];
      b->owners[v] = h->kinds[handle] == EXM_HANDLE_FREE ? HELD_NONE : handle;
      for (int k = 0; k < 3; k++) {
        h->centres[handle][k] += b->m->positions[v][k] / (double)(last - first);
      }
    }
  }
}

static exm_status build(builder *b, double disc_radius)
{
  held *h = b->h;
  size_t const V = b->m->vertex_count, H = h->handle_count;
  b->owners = ARENA_NEW(&b->scratch, uint32_t, V);
  b->queue = ARENA_NEW(&b->scratch, uint32_t, V);
  b->seen = ARENA_NEW(&b->scratch, uint32_t, V);
  b->part_list = ARENA_NEW(&b->scratch, uint32_t, V);
  h->kinds = ARENA_NEW(&h->memory, int32_t, H);
  h->centres = arena_array(&h->memory, H, sizeof *h->centres);
  h->targets = ARENA_NEW(&h->memory, double, 12 * H);
  h->fixed = ARENA_NEW(&h->memory, held_vertex, V);
  h->patches = ARENA_NEW(&h->memory, held_patch, b->handles->vertex_offsets[H]);
  h->patch_vertices = ARENA_NEW(&h->memory, uint32_t, b->handles->vertex_offsets[H]);
  h->is_out = ARENA_NEW(&h->memory, unsigned char, V);
  if (!b->owners || !b->queue || !b->seen || !b->part_list || !h->kinds || !h->centres || !h->targets || !h->fixed ||
      !h->patches || !h->patch_vertices || !h->is_out) {
    return status_no_memory("the handles");
  }
  memset(b->owners, 0xff, V * sizeof *b->owners); /* HELD_NONE */
  find_centres(b);
  for (uint32_t handle = 0; handle < H; handle++) {
    if (h->kinds[handle] == EXM_HANDLE_ORIENTED) {
      fix_oriented(b, handle);
    } else if (h->kinds[handle] == EXM_HANDLE_PINNED) {
      hold_pinned(b, handle);
    }
  }
  TRY(find_grounds(b));
  return disc_radius > 0 ? find_discs(b, disc_radius) : EXM_OK;
}

exm_status held_create(const mesh *m, const exm_handles *handles, double disc_radius, held *out)
{
  *out = (held){.handle_count = handles->count};
  builder b = {.m = m, .handles = handles, .h = out};
  exm_status const status = build(&b, disc_radius);
  arena_release(&b.scratch);
  return status;
}

void held_destroy(held *h)
{
  arena_release(&h->memory);
}

void held_place(const held *h, size_t handle, const double arm[3], const double *targets, double out[3])
{
  const double *target = targets + 12 * handle;
  for (int k = 0; k < 3; k++) {
    const double *row = target + 4 * (size_t)k;
    out[k] = row[3] +
             (h->kinds[handle] == EXM_HANDLE_ORIENTED ? row[0] * arm[0] + row[1] * arm[1] + row[2] * arm[2] : arm[k]);
  }
}
