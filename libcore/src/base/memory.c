/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* One SIMD register of the widest kind, and a cache line. */
#define ALIGNMENT ((size_t)64)

struct arena_block {
  arena_block *older;
};

void *arena_array(arena *owner, size_t count, size_t size)
{
  size_t const header = ALIGNMENT;
  if (size != 0 && count > (SIZE_MAX - 2 * ALIGNMENT) / size) {
    return NULL;
  }
  size_t const bytes = (header + count * size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
  arena_block *block = aligned_alloc(ALIGNMENT, bytes);
  if (!block) {
    return NULL;
  }
  memset(block, 0, bytes);
  block->older = owner->newest;
  owner->newest = block;
  return (char *)block + header;
}

void arena_release(arena *owner)
{
  while (owner->newest) {
    arena_block *block = owner->newest;
    owner->newest = block->older;
    free(block);
  }
}
