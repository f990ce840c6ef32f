/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Programs that measure on request: measure.py's Worker is the other end. They say when they are ready, then answer
 * each line of standard input with a line of numbers that begins with "= ". */
#ifndef EXM_BENCH_WORKER_H
#define EXM_BENCH_WORKER_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/** Seconds of processor time: they leave out what other programs take, and workers have one thread. */
static inline double worker_clock(void)
{
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline void worker_answer_one(double value)
{
  printf("= %.17g\n", value);
  fflush(stdout);
}

static inline void worker_ready(void)
{
  printf("= \n");
  fflush(stdout);
}

/** The next command, without its newline; 0 when there is none left. */
static inline int worker_command(char *line, size_t size)
{
  if (!fgets(line, (int)size, stdin)) {
    return 0;
  }
  line[strcspn(line, "\n")] = 0;
  return 1;
}

/** Read `count` items or give up. */
static inline void worker_read(FILE *file, void *out, size_t size, size_t count)
{
  if (fread(out, size, count, file) != count) {
    fprintf(stderr, "the input is cut short\n");
    exit(1);
  }
}

static inline FILE *worker_open(int argc, char **argv)
{
  FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
  if (!file) {
    fprintf(stderr, "usage: %s FILE\n", argv[0]);
    exit(1);
  }
  return file;
}

static inline void *worker_array(size_t count, size_t size)
{
  void *array = calloc(count, size);
  if (!array) {
    fprintf(stderr, "out of memory\n");
    exit(1);
  }
  return array;
}

#endif
