/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/deformer.h"

#include <stdlib.h>
#include <string.h>

exm_status deformer_begin(size_t size, const deformer_methods *methods, exm_deformer_kind kind, const mesh *reference,
                          const exm_handles *handles, exm_deformer **out)
{
  size_t const V = reference->vertex_count, H = handles->count;
  exm_deformer *deformer = calloc(1, size);
  *out = NULL;
  if (!deformer) {
    return status_no_memory("the deformer");
  }
  deformer->methods = methods;
  deformer->info = (exm_deformer_info){.struct_size = sizeof deformer->info,
                                       .vertex_count = V,
                                       .handle_count = H,
                                       .dimension = 3,
                                       .kind = (int32_t)kind};
  deformer->handle_kinds = ARENA_NEW(&deformer->memory, int32_t, H);
  deformer->reference = ARENA_NEW(&deformer->memory, float, 3 * V);
  if (!deformer->handle_kinds || !deformer->reference) {
    deformer_destroy(deformer);
    return status_no_memory("the deformer");
  }
  memcpy(deformer->handle_kinds, handles->kinds, H * sizeof(int32_t));
  for (size_t i = 0; i < 3 * V; i++) {
    deformer->reference[i] = (float)reference->positions[i / 3][i % 3];
  }
  *out = deformer;
  return EXM_OK;
}

exm_status deformer_check_held(const mesh *reference, const exm_handles *handles)
{
  size_t const parts = reference->report.component_count;
  arena scratch = {0};
  unsigned char *is_held = ARENA_NEW(&scratch, unsigned char, parts);
  if (!is_held) {
    return status_no_memory("the handles");
  }
  for (size_t h = 0; h < handles->count; h++) {
    for (size_t i = handles->vertex_offsets[h]; i < handles->vertex_offsets[h + 1]; i++) {
      is_held[reference->components[handles->vertices[i]]] |= handles->kinds[h] != EXM_HANDLE_FREE;
    }
  }
  size_t loose = 0, first = SIZE_MAX;
  for (size_t v = reference->vertex_count; v-- > 0;) {
    first = is_held[reference->components[v]] ? first : v;
  }
  for (size_t p = 0; p < parts; p++) {
    loose += !is_held[p];
  }
  arena_release(&scratch);
  if (loose > 0) {
    return status_set_at(EXM_ERROR_UNCONSTRAINED, EXM_ELEMENT_VERTEX, first,
                         "%zu of %zu connected parts have only free handles, or none, that of vertex %zu for one: each "
                         "needs a pinned or oriented handle",
                         loose, parts, first);
  }
  return EXM_OK;
}

void deformer_destroy(exm_deformer *deformer)
{
  if (deformer) {
    if (deformer->methods->release) {
      deformer->methods->release(deformer);
    }
    arena_release(&deformer->memory);
    free(deformer);
  }
}
