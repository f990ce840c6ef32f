/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/set_sums.h"

#include <string.h>

exm_status set_sums_transpose(arena *owner, set_sums *s)
{
  size_t const entries = s->rows.starts[2 * s->count];
  signed_lists made = {.starts = ARENA_NEW(owner, uint32_t, 2 * s->count + 2),
                       .entries = ARENA_NEW(owner, uint32_t, entries)};
  if (!made.starts || !made.entries) {
    return status_no_memory("sums over neighbourhoods");
  }
  /* One place further than they belong, so that filling moves them to where they do. */
  for (size_t list = 0; list < 2 * s->count; list++) {
    for (uint32_t e = s->rows.starts[list]; e < s->rows.starts[list + 1]; e++) {
      made.starts[2 * (size_t)s->rows.entries[e] + list % 2 + 2]++;
    }
  }
  for (size_t list = 2; list < 2 * s->count + 2; list++) {
    made.starts[list] += made.starts[list - 1];
  }
  for (size_t list = 0; list < 2 * s->count; list++) {
    for (uint32_t e = s->rows.starts[list]; e < s->rows.starts[list + 1]; e++) {
      made.entries[made.starts[2 * (size_t)s->rows.entries[e] + list % 2 + 1]++] = (uint32_t)(list / 2);
    }
  }
  s->columns = made;
  return EXM_OK;
}

/* Adds list k's sum. */
INLINE void add_list(const signed_lists *lists, size_t k, const row12 *x, row12 *to)
{
  row12 sum = *to;
  for (uint32_t e = lists->starts[2 * k]; e < lists->starts[2 * k + 1]; e++) {
    const row12 *from = &x[lists->entries[e]];
    four_add(&sum.part[0], &from->part[0]);
    four_add(&sum.part[1], &from->part[1]);
    four_add(&sum.part[2], &from->part[2]);
  }
  for (uint32_t e = lists->starts[2 * k + 1]; e < lists->starts[2 * k + 2]; e++) {
    const row12 *from = &x[lists->entries[e]];
    four_take(&sum.part[0], &from->part[0]);
    four_take(&sum.part[1], &from->part[1]);
    four_take(&sum.part[2], &from->part[2]);
  }
  *to = sum;
}

SIMD_CLONES static void apply_run(const set_sums *s, size_t run, const row12 *x, row12 *y)
{
  row12 const zero = {0};
  for (uint32_t t = s->run_starts[run]; t < s->run_starts[run + 1]; t++) {
    uint32_t const k = s->order[t], base = s->bases[k];
    row12 sum = base == SET_SUMS_NONE ? zero : y[base];
    add_list(&s->rows, k, x, &sum);
    y[k] = sum;
  }
}

/* Sums over the subtrees of sets that build on set k: each set hands its own to its base, the last one first. */
SIMD_CLONES static void gather_run(const set_sums *s, size_t run, const row12 *y, row12 *sums)
{
  for (uint32_t t = s->run_starts[run]; t < s->run_starts[run + 1]; t++) {
    sums[s->order[t]] = y[s->order[t]];
  }
  for (uint32_t t = s->run_starts[run + 1]; t-- > s->run_starts[run];) {
    uint32_t const k = s->order[t], base = s->bases[k];
    for (int part = 0; part < 3 && base != SET_SUMS_NONE; part++) {
      four_add(&sums[base].part[part], &sums[k].part[part]);
    }
  }
}

SIMD_CLONES static void apply_columns(const set_sums *s, size_t begin, size_t end, const row12 *sums, row12 *x)
{
  for (size_t i = begin; i < end; i++) {
    row12 sum = {0};
    add_list(&s->columns, i, sums, &sum);
    x[i] = sum;
  }
}

void set_sums_apply(const set_sums *s, int thread_count, const row12 *x, row12 *y)
{
  if (s->is_identity) {
    memcpy(y, x, s->count * sizeof *y);
    return;
  }
#pragma omp parallel for num_threads(thread_count) schedule(dynamic, 4) if (thread_count > 1)
  for (size_t run = 0; run < s->run_count; run++) {
    apply_run(s, run, x, y);
  }
}

void set_sums_apply_transposed(const set_sums *s, int thread_count, const row12 *y, row12 *scratch, row12 *x)
{
  size_t const piece = 512, pieces = (s->count + piece - 1) / piece;
  if (s->is_identity) {
    memcpy(x, y, s->count * sizeof *x);
    return;
  }
#pragma omp parallel num_threads(thread_count) if (thread_count > 1)
  {
#pragma omp for schedule(dynamic, 4)
    for (size_t run = 0; run < s->run_count; run++) {
      gather_run(s, run, y, scratch);
    }
#pragma omp for schedule(dynamic, 4)
    for (size_t i = 0; i < pieces; i++) {
      apply_columns(s, i * piece, i + 1 < pieces ? (i + 1) * piece : s->count, scratch, x);
    }
  }
}
