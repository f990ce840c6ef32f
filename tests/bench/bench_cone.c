/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Our cone program, from cold starts. The file, from area_cone.py:
 *
 *   int64 programs, unknowns, blocks; then for each program Q, p, l, k in double
 *
 * "go" answers seconds a program, "values" the optima. */
#include <stdint.h>

#include "numeric/cone.h"
#include "worker.h"

typedef struct problem {
  size_t program_count, count, block_count;
  size_t *offsets;
  double *numbers; /* of all programs */
  cone_workspace work;
  double *B;
} problem;

static problem read_problem(FILE *file, arena *memory)
{
  int64_t sizes[3];
  worker_read(file, sizes, sizeof *sizes, 3);
  problem out = {.program_count = (size_t)sizes[0], .count = (size_t)sizes[1], .block_count = (size_t)sizes[2]};
  size_t const size = out.program_count * (out.count * out.count + 2 * out.count + 1);
  out.numbers = worker_array(size, sizeof(double));
  worker_read(file, out.numbers, sizeof(double), size);
  out.offsets = worker_array(out.block_count + 1, sizeof(size_t));
  for (size_t b = 0; b <= out.block_count; b++) {
    out.offsets[b] = b * (out.count / out.block_count);
  }
  out.B = worker_array(out.count, sizeof(double));
  if (cone_workspace_create(memory, out.count, &out.work) != EXM_OK) {
    exit(1);
  }
  return out;
}

static cone_result solve(problem *p, size_t index)
{
  size_t const n = p->count;
  const double *at = p->numbers + index * (n * n + 2 * n + 1);
  cone_program const program = {.count = n,
                                .block_count = p->block_count,
                                .offsets = p->offsets,
                                .Q = at,
                                .p = at + n * n,
                                .l = at + n * n + n,
                                .k = at[n * n + 2 * n]};
  cone_result result;
  /* As a stateless solve begins: one exemplar everywhere. */
  memset(p->B, 0, n * sizeof(double));
  for (size_t b = 0; b < p->block_count; b++) {
    p->B[p->offsets[b]] = 1;
  }
  cone_solve(&program, &p->work, 1e-9, p->B, &result);
  return result;
}

int main(int argc, char **argv)
{
  arena memory = {0};
  FILE *file = worker_open(argc, argv);
  problem p = read_problem(file, &memory);
  char command[64];
  fclose(file);
  worker_ready();
  while (worker_command(command, sizeof command)) {
    if (strcmp(command, "values") == 0) {
      printf("=");
      for (size_t i = 0; i < p.program_count; i++) {
        printf(" %.17g", solve(&p, i).value);
      }
      printf("\n");
      fflush(stdout);
      continue;
    }
    double const start = worker_clock();
    for (size_t i = 0; i < p.program_count; i++) {
      solve(&p, i);
    }
    worker_answer_one((worker_clock() - start) / (double)p.program_count);
  }
  arena_release(&memory);
  free(p.offsets);
  free(p.numbers);
  free(p.B);
  return 0;
}
