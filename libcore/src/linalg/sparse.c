/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "linalg/sparse.h"

#include <stdlib.h>
#include <string.h>

static exm_status allocate(arena *owner, size_t size, size_t entries, sparse *out)
{
  sparse made = {.size = size};
  if (size >= INT32_MAX || entries >= INT32_MAX) {
    return status_no_memory("a sparse matrix with more entries than 32 bits can count");
  }
  made.starts = ARENA_NEW(owner, int32_t, size + 1);
  made.rows = ARENA_NEW(owner, int32_t, entries);
  made.values = ARENA_NEW(owner, double, entries);
  if (!made.starts || !made.rows || !made.values) {
    return status_no_memory("a sparse matrix");
  }
  *out = made;
  return EXM_OK;
}

/* Entry counts in starts[1..] become offsets; returns their total. */
static size_t accumulate(sparse *a)
{
  for (size_t j = 0; j < a->size; j++) {
    a->starts[j + 1] += a->starts[j];
  }
  return (size_t)a->starts[a->size];
}

/* Sort the rows of each column and add up repeated ones: two passes of a bucket sort, by row and back by column, which
 * leave equal rows side by side in their first order, so that sums do not depend on chance. */
static exm_status compress(arena *scratch, sparse *a)
{
  size_t const entries = (size_t)a->starts[a->size];
  int32_t *next = ARENA_NEW(scratch, int32_t, a->size + 1);
  int32_t *column = ARENA_NEW(scratch, int32_t, entries);
  double *value = ARENA_NEW(scratch, double, entries);
  int32_t *row = ARENA_NEW(scratch, int32_t, entries);
  if (!next || !column || !value || !row) {
    return status_no_memory("the assembly of a sparse matrix");
  }
  for (size_t e = 0; e < entries; e++) {
    next[a->rows[e] + 1]++;
  }
  for (size_t j = 0; j < a->size; j++) {
    next[j + 1] += next[j];
  }
  for (size_t j = 0; j < a->size; j++) {
    for (int32_t e = a->starts[j]; e < a->starts[j + 1]; e++) {
      int32_t const place = next[a->rows[e]]++;
      column[place] = (int32_t)j;
      row[place] = a->rows[e];
      value[place] = a->values[e];
    }
  }
  memcpy(next, a->starts, a->size * sizeof *next);
  for (size_t e = 0; e < entries; e++) {
    int32_t const place = next[column[e]]++;
    a->rows[place] = row[e];
    a->values[place] = value[e];
  }
  int32_t kept = 0;
  for (size_t j = 0; j < a->size; j++) {
    int32_t const begin = a->starts[j], end = a->starts[j + 1];
    a->starts[j] = kept;
    for (int32_t e = begin; e < end; e++) {
      if (kept > a->starts[j] && a->rows[kept - 1] == a->rows[e]) {
        a->values[kept - 1] += a->values[e];
      } else {
        a->rows[kept] = a->rows[e];
        a->values[kept] = a->values[e];
        kept++;
      }
    }
  }
  a->starts[a->size] = kept;
  return EXM_OK;
}

/* A copy of exactly the size that it needs. */
static exm_status copy_out(arena *owner, const sparse *a, sparse *out)
{
  size_t const entries = (size_t)a->starts[a->size];
  sparse copy = {0};
  TRY(allocate(owner, a->size, entries, &copy));
  memcpy(copy.starts, a->starts, (a->size + 1) * sizeof *a->starts);
  memcpy(copy.rows, a->rows, entries * sizeof *a->rows);
  memcpy(copy.values, a->values, entries * sizeof *a->values);
  *out = copy;
  return EXM_OK;
}

/* next[j]: where the next entry of column j goes. */
static void put(sparse *a, int32_t *next, uint32_t i, uint32_t j, double value)
{
  int32_t const place = next[i < j ? i : j]++;
  a->rows[place] = (int32_t)(i < j ? j : i);
  a->values[place] = value;
}

exm_status sparse_from_triplets(arena *owner, size_t size, size_t count, const uint32_t *rows, const uint32_t *columns,
                                const double *values, sparse *out)
{
  arena scratch = {0};
  sparse a = {0};
  exm_status status = allocate(&scratch, size, count, &a);
  if (status < 0) {
    goto done;
  }
  for (size_t e = 0; e < count; e++) {
    a.starts[(rows[e] < columns[e] ? rows[e] : columns[e]) + 1]++;
  }
  accumulate(&a);
  int32_t *next = ARENA_NEW(&scratch, int32_t, size + 1);
  if (!next) {
    status = status_no_memory("the assembly of a sparse matrix");
    goto done;
  }
  memcpy(next, a.starts, size * sizeof *next);
  for (size_t e = 0; e < count; e++) {
    put(&a, next, rows[e], columns[e], values[e]);
  }
  status = compress(&scratch, &a);
  if (status == EXM_OK) {
    status = copy_out(owner, &a, out);
  }
done:
  arena_release(&scratch);
  return status;
}

exm_status sparse_laplacian(arena *owner, size_t size, size_t count, const uint32_t (*triangles)[3],
                            const double (*cotangents)[3], sparse *out)
{
  arena scratch = {0};
  sparse a = {0};
  exm_status status = count > INT32_MAX / 9 ? status_no_memory("a Laplacian with more entries than 32 bits can count")
                                            : allocate(&scratch, size, size + 9 * count, &a);
  if (status < 0) {
    goto done;
  }
  for (size_t j = 0; j < size; j++) {
    a.starts[j + 1] = 1;
  }
  for (size_t f = 0; f < count; f++) {
    for (int i = 0; i < 3; i++) {
      uint32_t const u = triangles[f][(i + 1) % 3], v = triangles[f][(i + 2) % 3];
      a.starts[u + 1]++;
      a.starts[v + 1]++;
      a.starts[(u < v ? u : v) + 1]++;
    }
  }
  accumulate(&a);
  int32_t *next = ARENA_NEW(&scratch, int32_t, size + 1);
  if (!next) {
    status = status_no_memory("the assembly of a sparse matrix");
    goto done;
  }
  memcpy(next, a.starts, size * sizeof *next);
  for (uint32_t j = 0; j < size; j++) {
    put(&a, next, j, j, 0);
  }
  for (size_t f = 0; f < count; f++) {
    for (int i = 0; i < 3; i++) {
      uint32_t const u = triangles[f][(i + 1) % 3], v = triangles[f][(i + 2) % 3];
      put(&a, next, u, u, cotangents[f][i]);
      put(&a, next, v, v, cotangents[f][i]);
      put(&a, next, u, v, -cotangents[f][i]);
    }
  }
  status = compress(&scratch, &a);
  if (status == EXM_OK) {
    status = copy_out(owner, &a, out);
  }
done:
  arena_release(&scratch);
  return status;
}

exm_status sparse_whole(arena *owner, const sparse *lower, sparse *out)
{
  size_t const size = lower->size;
  sparse a = {0};
  arena scratch = {0};
  exm_status status = EXM_OK;
  size_t *next = ARENA_NEW(&scratch, size_t, size + 1);
  if (!next) {
    status = status_no_memory("a sparse matrix");
    goto done;
  }
  for (size_t j = 0; j < size; j++) {
    for (int32_t e = lower->starts[j]; e < lower->starts[j + 1]; e++) {
      next[j + 1]++;
      next[lower->rows[e] + 1] += lower->rows[e] != (int32_t)j;
    }
  }
  for (size_t j = 0; j < size; j++) {
    next[j + 1] += next[j];
  }
  status = allocate(owner, size, next[size], &a);
  if (status < 0) {
    goto done;
  }
  for (size_t j = 0; j <= size; j++) {
    a.starts[j] = (int32_t)next[j];
  }
  /* Column j receives its rows above the diagonal from the columns before it, and only then its own: sorted. */
  for (size_t j = 0; j < size; j++) {
    for (int32_t e = lower->starts[j]; e < lower->starts[j + 1]; e++) {
      size_t const i = (size_t)lower->rows[e];
      size_t place = next[j]++;
      a.rows[place] = (int32_t)i;
      a.values[place] = lower->values[e];
      if (i != j) {
        place = next[i]++;
        a.rows[place] = (int32_t)j;
        a.values[place] = lower->values[e];
      }
    }
  }
  *out = a;
done:
  arena_release(&scratch);
  return status;
}

static int compare_rows(const void *left, const void *right)
{
  int32_t const a = *(const int32_t *)left, b = *(const int32_t *)right;
  return (a > b) - (a < b);
}

/* Insertion sort for the usual handful of rows. */
static void sort_rows(int32_t *rows, size_t count)
{
  if (count > 64) {
    qsort(rows, count, sizeof *rows, compare_rows);
    return;
  }
  for (size_t i = 1; i < count; i++) {
    int32_t const row = rows[i];
    size_t place = i;
    for (; place > 0 && rows[place - 1] > row; place--) {
      rows[place] = rows[place - 1];
    }
    rows[place] = row;
  }
}

/* The rows from j on of column j of A A: gathered in `rows` unless NULL; `seen` holds the columns each was last seen
 * in, plus one. Returns how many. */
static size_t square_pattern(const sparse *a, int32_t j, int32_t *seen, int32_t *rows)
{
  size_t count = 0;
  for (int32_t e = a->starts[j]; e < a->starts[j + 1]; e++) {
    int32_t const k = a->rows[e];
    for (int32_t f = a->starts[k]; f < a->starts[k + 1]; f++) {
      int32_t const i = a->rows[f];
      if (i >= j && seen[i] != j + 1) {
        seen[i] = j + 1;
        if (rows) {
          rows[count] = i;
        }
        count++;
      }
    }
  }
  return count;
}

exm_status sparse_square(arena *owner, const sparse *whole, const double *diagonal, sparse *out)
{
  size_t const size = whole->size;
  arena scratch = {0};
  sparse a = {0};
  exm_status status = EXM_OK;
  int32_t *seen = ARENA_NEW(&scratch, int32_t, size);
  double *sums = ARENA_NEW(&scratch, double, size);
  if (!seen || !sums) {
    status = status_no_memory("the square of a sparse matrix");
    goto done;
  }
  size_t entries = 0;
  for (size_t j = 0; j < size; j++) {
    entries += square_pattern(whole, (int32_t)j, seen, NULL);
  }
  status = allocate(owner, size, entries, &a);
  if (status < 0) {
    goto done;
  }
  memset(seen, 0, size * sizeof *seen);
  for (size_t j = 0; j < size; j++) {
    int32_t *rows = a.rows + a.starts[j];
    size_t const count = square_pattern(whole, (int32_t)j, seen, rows);
    sort_rows(rows, count);
    a.starts[j + 1] = a.starts[j] + (int32_t)count;
    for (int32_t e = whole->starts[j]; e < whole->starts[j + 1]; e++) {
      int32_t const k = whole->rows[e];
      double const factor = diagonal ? whole->values[e] * diagonal[k] : whole->values[e];
      for (int32_t f = whole->starts[k]; f < whole->starts[k + 1]; f++) {
        sums[whole->rows[f]] += factor * whole->values[f];
      }
    }
    for (size_t e = 0; e < count; e++) {
      a.values[(size_t)a.starts[j] + e] = sums[rows[e]];
    }
    for (int32_t e = whole->starts[j]; e < whole->starts[j + 1]; e++) {
      int32_t const k = whole->rows[e];
      for (int32_t f = whole->starts[k]; f < whole->starts[k + 1]; f++) {
        sums[whole->rows[f]] = 0;
      }
    }
  }
  *out = a;
done:
  arena_release(&scratch);
  return status;
}

void sparse_multiply(const sparse *whole, size_t count, const double *x, double *y)
{
  size_t const size = whole->size;
  for (size_t c = 0; c < count; c++) {
    const double *from = x + c * size;
    double *to = y + c * size;
    for (size_t j = 0; j < size; j++) {
      double sum = 0;
      for (int32_t e = whole->starts[j]; e < whole->starts[j + 1]; e++) {
        sum += whole->values[e] * from[whole->rows[e]];
      }
      to[j] = sum;
    }
  }
}
