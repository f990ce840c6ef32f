/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/pca.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/simd.h"
#include "linalg/dense.h"

/* Columns of the rows that are centred and multiplied at a time: n x 512 double precision numbers stay in the second-
 * level cache for a few hundred rows, and the product of a block is large enough for BLAS. */
enum { BLOCK = 512 };

/** Columns first .. first + width - 1 of the rows, centred, as block [n][width]; their means [width]. */
SIMD_CLONES static void centre_block(size_t n, const float *const *rows, size_t first, size_t width, double *block,
                                     double *means)
{
  memset(means, 0, width * sizeof(double));
  for (size_t i = 0; i < n; i++) {
    const float *row = rows[i] + first;
    double *to = block + i * width;
    for (size_t j = 0; j < width; j++) {
      to[j] = (double)row[j];
      means[j] += to[j];
    }
  }
  for (size_t j = 0; j < width; j++) {
    means[j] /= (double)n;
  }
  for (size_t i = 0; i < n; i++) {
    double *to = block + i * width;
    for (size_t j = 0; j < width; j++) {
      to[j] -= means[j];
    }
  }
}

static exm_status find_gram(const float *const *rows, double *block, double *means, const progress *report, pca *p,
                            double *gram)
{
  size_t const n = p->row_count;
  for (size_t first = 0; first < p->dimension; first += BLOCK) {
    size_t const width = p->dimension - first < BLOCK ? p->dimension - first : BLOCK;
    TRY(progress_report(report, 0.7 * (double)first / (double)p->dimension, "comparing frames"));
    centre_block(n, rows, first, width, block, means);
    for (size_t j = 0; j < width; j++) {
      p->mean[first + j] = (float)means[j];
    }
    dense_add_gram(n, width, block, gram);
  }
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < i; j++) {
      gram[j * n + i] = gram[i * n + j];
    }
  }
  return EXM_OK;
}

/** How many of the falling squared lengths are kept. */
static size_t choose_count(const double *rising, size_t n, size_t wanted, double limit)
{
  double const largest = rising[n - 1];
  size_t const most = wanted > 0 && wanted < n - 1 ? wanted : n - 1;
  double rest = 0;
  size_t count = n;
  while (count > 0 && !(rising[n - count] > largest * DBL_EPSILON * (double)n && largest > 0)) {
    count--; /* nothing but rounding */
  }
  count = count < most ? count : most;
  for (; wanted == 0 && count > 0; count--) {
    rest = 0;
    for (size_t i = 0; i + count - 1 < n; i++) {
      rest += fmax(rising[i], 0);
    }
    if (rest > limit) {
      break;
    }
  }
  return count;
}

/** Squared lengths and vectors become coordinates [n][m] and the combinations W [n][m] that make the basis. */
static void find_coordinates(const double *vectors, const double *rising, pca *p, double *combinations)
{
  size_t const n = p->row_count, m = p->component_count;
  for (size_t j = 0; j < m; j++) {
    const double *vector = vectors + (n - 1 - j) * n;
    /* Below what a Gram matrix resolves the length is a guess; any will do as long as it is used both ways. */
    double const length = sqrt(fmax(rising[n - 1 - j], rising[n - 1] * DBL_EPSILON * DBL_EPSILON));
    size_t largest = 0;
    for (size_t i = 1; i < n; i++) {
      /* Ties in opposite directions are decided by rounding unless one side has to win clearly. */
      largest = fabs(vector[i]) > 1.000001 * fabs(vector[largest]) ? i : largest;
    }
    double const sign = vector[largest] < 0 ? -1 : 1;
    for (size_t i = 0; i < n; i++) {
      p->coordinates[i * m + j] = sign * vector[i] * length;
      combinations[i * m + j] = sign * vector[i] / length;
    }
  }
}

static exm_status find_basis(const float *const *rows, const double *combinations, double *block, double *means,
                             double *product, const progress *report, pca *p)
{
  size_t const n = p->row_count, m = p->component_count;
  for (size_t first = 0; first < p->dimension; first += BLOCK) {
    size_t const width = p->dimension - first < BLOCK ? p->dimension - first : BLOCK;
    TRY(progress_report(report, 0.8 + 0.2 * (double)first / (double)p->dimension, "combining frames"));
    centre_block(n, rows, first, width, block, means);
    dense_multiply(1, 0, m, width, n, 1, combinations, block, 0, product);
    for (size_t j = 0; j < m; j++) {
      float *to = p->basis + j * p->dimension + first;
      for (size_t i = 0; i < width; i++) {
        to[i] = (float)product[j * width + i];
      }
    }
  }
  return EXM_OK;
}

static exm_status allocate(arena *owner, pca *p)
{
  p->basis = ARENA_NEW(owner, float, p->component_count * p->dimension);
  p->coordinates = ARENA_NEW(owner, double, p->row_count * p->component_count);
  return p->basis && p->coordinates ? EXM_OK : status_no_memory("the principal components");
}

static exm_status fit(arena *owner, arena *scratch, const float *const *rows, size_t components, double limit,
                      const progress *report, pca *p)
{
  size_t const n = p->row_count;
  double *block = ARENA_NEW(scratch, double, n *BLOCK);
  double *means = ARENA_NEW(scratch, double, BLOCK);
  double *gram = ARENA_NEW(scratch, double, n *n);
  double *values = ARENA_NEW(scratch, double, n);
  p->mean = ARENA_NEW(owner, float, p->dimension);
  if (!block || !means || !gram || !values || !p->mean) {
    return status_no_memory("comparing frames");
  }
  TRY(find_gram(rows, block, means, report, p, gram));
  for (size_t i = 0; i < n; i++) {
    p->total += gram[i * n + i];
  }
  TRY(progress_report(report, 0.7, "finding components"));
  TRY(dense_eigen(n, gram, values));
  p->component_count = choose_count(values, n, components, limit);
  for (size_t i = 0; i + p->component_count < n; i++) {
    p->rest += fmax(values[i], 0);
  }
  TRY(allocate(owner, p));
  double *combinations = ARENA_NEW(scratch, double, n * p->component_count);
  double *product = ARENA_NEW(scratch, double, BLOCK * p->component_count);
  if (!combinations || !product) {
    return status_no_memory("the principal components");
  }
  find_coordinates(gram, values, p, combinations);
  return find_basis(rows, combinations, block, means, product, report, p);
}

exm_status pca_fit(arena *owner, size_t row_count, size_t dimension, const float *const *rows, size_t components,
                   double limit, const progress *report, pca *out)
{
  arena scratch = {0};
  pca p = {.row_count = row_count, .dimension = dimension};
  exm_status const status = fit(owner, &scratch, rows, components, limit, report, &p);
  arena_release(&scratch);
  if (status >= 0) {
    *out = p;
  }
  return status;
}

/* Numbers of `out` that are combined at a time: they stay in the first-level cache while every component passes. */
enum { STRIP = 1024 };

SIMD_CLONES static void add_components(const pca *p, const double *coordinates, size_t first, size_t width, double *to)
{
  size_t j = 0;
  for (; j + 4 <= p->component_count; j += 4) { /* four at a time: a quarter of the loads and stores of `to` */
    const float *a = p->basis + j * p->dimension + first, *b = a + p->dimension, *c = b + p->dimension,
                *d = c + p->dimension;
    double const x = coordinates[j], y = coordinates[j + 1], z = coordinates[j + 2], w = coordinates[j + 3];
    for (size_t i = 0; i < width; i++) {
      to[i] += x * (double)a[i] + y * (double)b[i] + z * (double)c[i] + w * (double)d[i];
    }
  }
  for (; j < p->component_count; j++) {
    const float *a = p->basis + j * p->dimension + first;
    double const x = coordinates[j];
    for (size_t i = 0; i < width; i++) {
      to[i] += x * (double)a[i];
    }
  }
}

void pca_combine(const pca *p, const double *coordinates, double *out)
{
  for (size_t first = 0; first < p->dimension; first += STRIP) {
    size_t const width = p->dimension - first < STRIP ? p->dimension - first : STRIP;
    for (size_t i = 0; i < width; i++) {
      out[first + i] = (double)p->mean[first + i];
    }
    add_components(p, coordinates, first, width, out + first);
  }
}

void pca_combine_single(const pca *p, const double *coordinates, float *out)
{
  double strip[STRIP];
  for (size_t first = 0; first < p->dimension; first += STRIP) {
    size_t const width = p->dimension - first < STRIP ? p->dimension - first : STRIP;
    for (size_t i = 0; i < width; i++) {
      strip[i] = (double)p->mean[first + i];
    }
    add_components(p, coordinates, first, width, strip);
    for (size_t i = 0; i < width; i++) {
      out[first + i] = (float)strip[i];
    }
  }
}

void pca_combine_linear(const pca *p, const double *coordinates, double *out)
{
  memset(out, 0, p->dimension * sizeof(double));
  for (size_t first = 0; first < p->dimension; first += STRIP) {
    add_components(p, coordinates, first, p->dimension - first < STRIP ? p->dimension - first : STRIP, out + first);
  }
}

SIMD_CLONES static double centred_dot(size_t count, const float *row, const float *mean, const float *other)
{
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (size_t i = 0; i < count; i++) {
    sum += ((double)row[i] - (double)mean[i]) * (double)other[i];
  }
  return sum;
}

double pca_project(const pca *p, const float *row, double *coordinates)
{
  double strip[STRIP], squared = 0;
  for (size_t j = 0; j < p->component_count; j++) {
    coordinates[j] = centred_dot(p->dimension, row, p->mean, p->basis + j * p->dimension);
  }
  for (size_t first = 0; first < p->dimension; first += STRIP) {
    size_t const width = p->dimension - first < STRIP ? p->dimension - first : STRIP;
    for (size_t i = 0; i < width; i++) {
      strip[i] = (double)p->mean[first + i];
    }
    add_components(p, coordinates, first, width, strip);
    for (size_t i = 0; i < width; i++) {
      squared += (strip[i] - (double)row[first + i]) * (strip[i] - (double)row[first + i]);
    }
  }
  return squared;
}
