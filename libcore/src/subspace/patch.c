/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/patch.h"

#include <string.h>

/** The groups of a triangle's corners without repetition, with the share of each. */
static int corner_groups(const uint32_t triangle[3], const uint32_t *labels, uint32_t groups[3], double shares[3])
{
  int count = 0;
  for (int i = 0; i < 3; i++) {
    uint32_t const g = labels[triangle[i]];
    int at = 0;
    while (at < count && groups[at] != g) {
      at++;
    }
    if (at == count) {
      groups[count] = g;
      shares[count++] = 0;
    }
    shares[at] += 1.0 / 3;
  }
  return count;
}

exm_status incidence_create(arena *owner, const mesh *reference, const uint32_t *labels, size_t group_count,
                            incidence *out)
{
  uint32_t groups[3];
  double shares[3];
  incidence in = {.offsets = ARENA_NEW(owner, size_t, group_count + 2),
                  .triangles = ARENA_NEW(owner, uint32_t, 3 * reference->triangle_count),
                  .shares = ARENA_NEW(owner, double, 3 * reference->triangle_count)};
  if (!in.offsets || !in.triangles || !in.shares) {
    return status_no_memory("the edge groups");
  }
  for (size_t t = 0; t < reference->triangle_count; t++) {
    for (int i = corner_groups(reference->triangles[t], labels, groups, shares); i-- > 0;) {
      in.offsets[groups[i] + 2]++;
    }
  }
  for (size_t g = 0; g < group_count; g++) {
    in.offsets[g + 2] += in.offsets[g + 1];
  }
  for (size_t t = 0; t < reference->triangle_count; t++) {
    for (int i = corner_groups(reference->triangles[t], labels, groups, shares); i-- > 0;) {
      size_t const at = in.offsets[groups[i] + 1]++;
      in.triangles[at] = (uint32_t)t;
      in.shares[at] = shares[i];
    }
  }
  *out = in;
  return EXM_OK;
}

static void find_vertices(const mesh *reference, patch *area)
{
  area->vertex_count = 0;
  for (size_t t = 0; t < area->triangle_count; t++) {
    for (int i = 0; i < 3; i++) {
      uint32_t const v = reference->triangles[area->triangles[t]][i];
      if (area->local[v] == UINT32_MAX) {
        area->local[v] = (uint32_t)area->vertex_count;
        area->vertices[area->vertex_count++] = v;
      }
    }
  }
}

/** The atoms of the handles that have weight on the patch, and their values there. */
static exm_status find_atoms(arena *owner, arena *scratch, const dictionary *d, patch *area)
{
  size_t *first_column = ARENA_NEW(scratch, size_t, d->handle_count);
  if (!first_column) {
    return status_no_memory("the edge groups");
  }
  for (size_t i = 0; i < area->vertex_count; i++) {
    size_t const v = area->vertices[i];
    for (size_t k = d->weight_offsets[v]; k < d->weight_offsets[v + 1]; k++) {
      first_column[d->weight_handles[k]] = 1;
    }
  }
  area->column_count = 0;
  for (size_t h = 0; h < d->handle_count; h++) {
    area->column_count += first_column[h] ? d->atom_offsets[h + 1] - d->atom_offsets[h] : 0;
  }
  area->columns = ARENA_NEW(owner, size_t, area->column_count);
  area->atoms = ARENA_NEW(scratch, double, area->vertex_count * area->column_count);
  if (!area->columns || !area->atoms) {
    return status_no_memory("the edge groups");
  }
  size_t next = 0;
  for (size_t h = 0; h < d->handle_count; h++) {
    if (first_column[h]) {
      first_column[h] = next;
      for (size_t a = d->atom_offsets[h]; a < d->atom_offsets[h + 1]; a++) {
        area->columns[next++] = a;
      }
    }
  }
  for (size_t i = 0; i < area->vertex_count; i++) {
    size_t const v = area->vertices[i];
    for (size_t k = d->weight_offsets[v]; k < d->weight_offsets[v + 1]; k++) {
      size_t const h = d->weight_handles[k];
      dictionary_atoms(d, h, v, d->weight_values[k], area->atoms + i * area->column_count + first_column[h]);
    }
  }
  return EXM_OK;
}

exm_status patch_create(arena *scratch, const mesh *reference, patch *out)
{
  *out = (patch){.vertices = ARENA_NEW(scratch, uint32_t, reference->vertex_count),
                 .local = ARENA_NEW(scratch, uint32_t, reference->vertex_count)};
  if (!out->vertices || !out->local) {
    return status_no_memory("the edge groups");
  }
  memset(out->local, 0xff, reference->vertex_count * sizeof *out->local);
  return EXM_OK;
}

exm_status patch_begin(arena *owner, arena *scratch, const mesh *reference, const dictionary *d, const incidence *in,
                       size_t group, patch *area)
{
  for (size_t i = 0; i < area->vertex_count; i++) {
    area->local[area->vertices[i]] = UINT32_MAX;
  }
  area->triangle_count = in->offsets[group + 1] - in->offsets[group];
  area->triangles = in->triangles + in->offsets[group];
  area->shares = in->shares + in->offsets[group];
  find_vertices(reference, area);
  return d ? find_atoms(owner, scratch, d, area) : EXM_OK;
}
