/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Memory that is released together. An object allocates everything it keeps from one arena and a call allocates its
 * scratch from another, so that a failure half-way leaves nothing behind and has one thing to release. */
#ifndef EXM_BASE_MEMORY_H
#define EXM_BASE_MEMORY_H

#include <stddef.h>

typedef struct arena_block arena_block;
typedef struct arena {
  arena_block *newest;
} arena;

/** count x size bytes of zeros aligned to 64, or NULL where they do not fit; count 0 gives a valid pointer. */
void *arena_array(arena *owner, size_t count, size_t size);

/** Release everything; the arena is empty and can be used again. */
void arena_release(arena *owner);

#define ARENA_NEW(owner, type, count) ((type *)arena_array((owner), (count), sizeof(type)))

#endif
