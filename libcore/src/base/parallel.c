/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/parallel.h"

#include <omp.h>

/* Memory bandwidth is shared by all of them. */
enum { MOST_THREADS = 8 };

int parallel_threads(int wanted)
{
  int const processors = omp_get_max_threads(); /* knows of OMP_NUM_THREADS and of what the system allows us */
  return wanted > 0 ? wanted : processors < MOST_THREADS ? processors : MOST_THREADS;
}

#if defined(_WIN32)

void parallel_for(size_t count, int thread_count, parallel_piece work, void *context)
{
  int const threads = (size_t)thread_count < count ? thread_count : (int)count;
#  pragma omp parallel for num_threads(threads) schedule(dynamic) if (threads > 1)
  for (long long piece = 0; piece < (long long)count; piece++) {
    work(context, (size_t)piece);
  }
}

#else

#  include <pthread.h>
#  include <signal.h>
#  include <stdatomic.h>

typedef struct loop {
  parallel_piece work;
  void *context;
  size_t count;
  atomic_size_t next;
  int openings; /* threads that may still join */
  int helpers;  /* threads that have joined and not left */
} loop;

/* One loop at a time has helpers; another thread's loop, begun meanwhile, does without. The threads live as long as the
 * process and hold nothing. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t has_openings = PTHREAD_COND_INITIALIZER, is_left = PTHREAD_COND_INITIALIZER;
static loop *shared;
static int pool_size;

static void take_pieces(loop *l)
{
  size_t piece;
  while ((piece = atomic_fetch_add_explicit(&l->next, 1, memory_order_relaxed)) < l->count) {
    l->work(l->context, piece);
  }
}

static void *help(void *unused)
{
  (void)unused;
  pthread_mutex_lock(&lock);
  for (;;) {
    while (!shared || shared->openings == 0) {
      pthread_cond_wait(&has_openings, &lock);
    }
    loop *l = shared;
    l->openings--;
    l->helpers++;
    pthread_mutex_unlock(&lock);
    take_pieces(l);
    pthread_mutex_lock(&lock);
    if (--l->helpers == 0) {
      pthread_cond_broadcast(&is_left);
    }
  }
  return NULL;
}

/** With the lock held. Signals of the program that we live in are not for these threads. */
static void grow_pool(int wanted)
{
  sigset_t all, before;
  if (pool_size >= wanted) {
    return;
  }
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  while (pool_size < wanted) {
    pthread_t thread;
    if (pthread_create(&thread, NULL, help, NULL) != 0) {
      break;
    }
    pthread_detach(thread);
    pool_size++;
  }
  pthread_sigmask(SIG_SETMASK, &before, NULL);
}

static int offer(loop *l, int helpers)
{
  int is_taken = 0;
  pthread_mutex_lock(&lock);
  if (!shared) {
    grow_pool(helpers);
    l->openings = helpers;
    shared = l;
    is_taken = 1;
    if (helpers == 1) {
      pthread_cond_signal(&has_openings);
    } else {
      pthread_cond_broadcast(&has_openings);
    }
  }
  pthread_mutex_unlock(&lock);
  return is_taken;
}

static void withdraw(loop *l)
{
  pthread_mutex_lock(&lock);
  shared = NULL;
  while (l->helpers > 0) {
    pthread_cond_wait(&is_left, &lock);
  }
  pthread_mutex_unlock(&lock);
}

void parallel_for(size_t count, int thread_count, parallel_piece work, void *context)
{
  loop l = {.work = work, .context = context, .count = count};
  int const threads = (size_t)thread_count < count ? thread_count : (int)count;
  int const is_shared = threads > 1 && offer(&l, threads - 1);
  take_pieces(&l);
  if (is_shared) {
    withdraw(&l);
  }
}

#endif
