/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A loop over independent pieces, shared with whichever threads have time.
 *
 * The caller takes pieces until none is left; threads of a pool help it, if they are awake by then. So nobody waits for
 * a thread that the system has not scheduled, as at an OpenMP barrier: within Blender, which has threads of its own,
 * and on busy farms such waits cost more than the second thread brings. What a piece writes must not depend on the
 * others: results are then the same for any number of threads. */
#ifndef EXM_BASE_PARALLEL_H
#define EXM_BASE_PARALLEL_H

#include <stddef.h>

typedef void (*parallel_piece)(void *context, size_t piece);

/** Call `work` for the pieces 0 .. count, in any order, in up to thread_count threads, this one among them. Pieces
 * should take some ten microseconds or more. Never fails: without threads, this one does it all. */
void parallel_for(size_t count, int thread_count, parallel_piece work, void *context);

/** How many threads are worth having: `wanted`, or where that is 0 the processors, up to a handful. */
int parallel_threads(int wanted);

#endif
