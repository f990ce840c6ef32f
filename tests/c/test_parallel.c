/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every piece exactly once, whatever the number of threads and of loops at the same time. */
#include <pthread.h>
#include <stdatomic.h>

#include "base/parallel.h"
#include "harness.h"

enum { PIECES = 1000 };

typedef struct counts {
  atomic_int times[PIECES];
  atomic_int started;
} counts;

static void count_piece(void *context, size_t piece)
{
  counts *c = context;
  atomic_fetch_add(&c->started, 1);
  atomic_fetch_add(&c->times[piece], 1);
}

static int each_once(counts *c, size_t pieces)
{
  int wrong = 0;
  for (size_t i = 0; i < PIECES; i++) {
    wrong += c->times[i] != (i < pieces);
  }
  return wrong == 0 && c->started == (int)pieces;
}

TEST(every_piece_is_done_once)
{
  static size_t const sizes[] = {0, 1, 2, 3, 17, PIECES};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
    for (int threads = 1; threads <= 9; threads++) {
      counts c = {0};
      test_about("%zu pieces, %d threads", sizes[i], threads);
      parallel_for(sizes[i], threads, count_piece, &c);
      CHECK(each_once(&c, sizes[i]));
    }
  }
}

typedef struct nest {
  counts inner[4];
} nest;

static void loop_within(void *context, size_t piece)
{
  parallel_for(PIECES, 3, count_piece, &((nest *)context)->inner[piece]);
}

/** A loop begun by a piece of another has no helpers, and waits for none. */
TEST(loops_may_nest)
{
  static nest n;
  parallel_for(4, 3, loop_within, &n);
  for (size_t i = 0; i < 4; i++) {
    CHECK(each_once(&n.inner[i], PIECES));
  }
}

static void *many_loops(void *failures)
{
  for (int round = 0; round < 200; round++) {
    counts c = {0};
    parallel_for(PIECES, 4, count_piece, &c);
    *(int *)failures += !each_once(&c, PIECES);
  }
  return NULL;
}

TEST(callers_do_not_disturb_each_other)
{
  pthread_t threads[3];
  int failures[3] = {0};
  for (int i = 0; i < 3; i++) {
    REQUIRE(pthread_create(&threads[i], NULL, many_loops, &failures[i]) == 0);
  }
  for (int i = 0; i < 3; i++) {
    pthread_join(threads[i], NULL);
    CHECK(failures[i] == 0);
  }
}

TEST(number_of_threads_is_the_callers_or_ours)
{
  CHECK(parallel_threads(5) == 5);
  CHECK(parallel_threads(0) >= 1 && parallel_threads(0) <= 8);
}
