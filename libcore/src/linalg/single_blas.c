/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/single_blas.h"

#if defined(__linux__)

#  include <pthread.h>
#  include <stddef.h>

/* Weak: another BLAS does not have them, and is left as it is. */
extern void openblas_set_num_threads(int count) __attribute__((weak));
extern int openblas_get_num_threads(void) __attribute__((weak));

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int calls_under_way, threads_before;

void single_blas_begin(void)
{
  if (!openblas_set_num_threads || !openblas_get_num_threads) {
    return;
  }
  pthread_mutex_lock(&lock);
  if (calls_under_way++ == 0) {
    threads_before = openblas_get_num_threads();
    if (threads_before > 1) {
      openblas_set_num_threads(1);
    }
  }
  pthread_mutex_unlock(&lock);
}

void single_blas_end(void)
{
  if (!openblas_set_num_threads || !openblas_get_num_threads) {
    return;
  }
  pthread_mutex_lock(&lock);
  if (--calls_under_way == 0 && threads_before > 1) {
    openblas_set_num_threads(threads_before);
  }
  pthread_mutex_unlock(&lock);
}

#else

void single_blas_begin(void)
{
}

void single_blas_end(void)
{
}

#endif
