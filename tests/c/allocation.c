/* SPDX-License-Identifier: GPL-3.0-or-later */
#define _GNU_SOURCE
#include "allocation.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>

#include "harness.h"

static atomic_long live;
static _Thread_local long countdown; /* 0: not armed; 1: the next allocation fails */
static _Thread_local bool fired;

#if defined(__GLIBC__) && !defined(EXM_SANITIZED)

#  define INTERPOSED __attribute__((visibility("default"), used))

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *block);

/* The OpenMP runtime ends the process when it is out of memory, and the dynamic loader may; neither can be made to
 * return a status, so they are spared. */
static bool is_spared(const void *caller)
{
  Dl_info info;
  return dladdr(caller, &info) && info.dli_fname &&
         (strstr(info.dli_fname, "libgomp") || strstr(info.dli_fname, "ld-linux"));
}

static bool fails_now(const void *caller)
{
  if (countdown == 0 || --countdown > 0) {
    return false;
  }
  if (is_spared(caller)) {
    countdown = 1;
    return false;
  }
  fired = true;
  errno = ENOMEM;
  return true;
}

static void *counted(void *block)
{
  if (block) {
    atomic_fetch_add(&live, 1);
  }
  return block;
}

INTERPOSED void *malloc(size_t size)
{
  return fails_now(__builtin_return_address(0)) ? NULL : counted(__libc_malloc(size));
}

INTERPOSED void *calloc(size_t count, size_t size)
{
  return fails_now(__builtin_return_address(0)) ? NULL : counted(__libc_calloc(count, size));
}

INTERPOSED void *realloc(void *block, size_t size)
{
  if (fails_now(__builtin_return_address(0))) {
    return NULL;
  }
  void *moved = __libc_realloc(block, size);
  if (block && size == 0) {
    atomic_fetch_sub(&live, 1);
  }
  return block ? moved : counted(moved);
}

INTERPOSED void *aligned_alloc(size_t alignment, size_t size)
{
  return fails_now(__builtin_return_address(0)) ? NULL : counted(__libc_memalign(alignment, size));
}

INTERPOSED void *memalign(size_t alignment, size_t size)
{
  return fails_now(__builtin_return_address(0)) ? NULL : counted(__libc_memalign(alignment, size));
}

INTERPOSED int posix_memalign(void **block, size_t alignment, size_t size)
{
  void *made = fails_now(__builtin_return_address(0)) ? NULL : counted(__libc_memalign(alignment, size));
  if (made) {
    *block = made;
  }
  return made ? 0 : ENOMEM;
}

INTERPOSED void free(void *block)
{
  if (block) {
    atomic_fetch_sub(&live, 1);
  }
  __libc_free(block);
}

#endif

int allocation_can_fail(void)
{
  long const before = allocation_balance();
  void *volatile probe = malloc(1); /* volatile: a compiler may remove an unused pair of malloc and free */
  long const during = allocation_balance();
  free(probe);
  return during == before + 1;
}

long allocation_balance(void)
{
  return atomic_load(&live);
}

static exm_status run_failing(size_t nth, exm_status (*run)(void *context), void *context, long *leaked)
{
  long const before = allocation_balance();
  fired = false;
  countdown = (long)nth;
  exm_status const status = run(context);
  countdown = 0;
  *leaked = allocation_balance() - before;
  return status;
}

size_t for_each_failed_allocation(exm_status (*run)(void *context), void *context)
{
  long leaked;
  exm_status status = run_failing(0, run, context, &leaked); /* also lets thread pools and the like come into being */
  if (status < 0) {
    test_fail(__FILE__, __LINE__, "fails with %d although no allocation does: %s", status, exm_last_error());
    return 0;
  }
  size_t failed = 0;
  for (size_t nth = 1;; nth += 1 + (nth >= 1000 ? nth / 100 : 0)) {
    status = run_failing(nth, run, context, &leaked);
    if (!fired) {
      return failed;
    }
    ++failed;
    if (status < 0 && (status != EXM_ERROR_OUT_OF_MEMORY || !exm_last_error()[0])) {
      test_fail(__FILE__, __LINE__, "allocation %zu failed: status %d, \"%s\"", nth, status, exm_last_error());
    }
    if (leaked != 0) { /* something that is made once and kept, if it does not happen again */
      run_failing(nth, run, context, &leaked);
    }
    if (leaked != 0) {
      test_fail(__FILE__, __LINE__, "allocation %zu failed: %ld blocks leaked", nth, leaked);
    }
  }
}
