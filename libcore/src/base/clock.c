/* SPDX-License-Identifier: GPL-3.0-or-later */
#if !defined(_WIN32)
#  define _POSIX_C_SOURCE 200809L
#endif
#include "base/clock.h"

#include <time.h>

double clock_seconds(void)
{
  struct timespec now;
#if defined(_WIN32)
  timespec_get(&now, TIME_UTC);
#else
  clock_gettime(CLOCK_MONOTONIC, &now);
#endif
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
