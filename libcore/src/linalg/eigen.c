/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The only user of ARPACK [Lehoucq, Sorensen and Yang, "ARPACK Users' Guide", 1998], in shift-invert mode: the lowest
 * eigenvalues lambda of A x = lambda M x are the largest ones, 1 / (lambda + shift), of
 *
 *     B = M^1/2 (A + shift M)^-1 M^1/2,    y = M^1/2 x,
 *
 * so that one sparse factorisation serves the whole search. B is kept orthogonal to what is known already: the
 * constants of a Laplacian, for which A itself is singular.
 *
 * ARPACK keeps its place in static variables between calls, so one search at a time runs in a process. */
#include "linalg/eigen.h"

#include <math.h>
#include <string.h>

#include "linalg/cholesky.h"
#include "linalg/dense.h"
#include "linalg/single_blas.h"

/* Fortran's entries, as for LAPACK: the C header differs from one packager to another. Lengths of character arguments
 * come last. */
void dsaupd_(int *ido, const char *bmat, const int *n, const char *which, const int *nev, const double *tol,
             double *resid, const int *ncv, double *v, const int *ldv, int *iparam, int *ipntr, double *workd,
             double *workl, const int *lworkl, int *info, size_t bmat_length, size_t which_length);
void dseupd_(const int *rvec, const char *howmny, int *select, double *d, double *z, const int *ldz,
             const double *sigma, const char *bmat, const int *n, const char *which, const int *nev, const double *tol,
             double *resid, const int *ncv, double *v, const int *ldv, int *iparam, int *ipntr, double *workd,
             double *workl, const int *lworkl, int *info, size_t howmny_length, size_t bmat_length,
             size_t which_length);

/* Up to this size all eigenpairs are found by a dense method. */
enum { DENSE_SIZE = 192, RESTARTS = 60, ATTEMPTS = 5 };
/* Vectors that ARPACK keeps beyond once and a half those wanted: fewer restarts against more orthogonalisation. */
enum { MARGIN = 6 };
/* Residuals of eigenvectors of B, beside their eigenvalues; those of eigenvalues are its square. */
static double const TOLERANCE = 1e-11;
/* What is enough to see whether there is another copy. */
static double const GLANCE = 1e-3;
/* A value that is lower than the highest found by less than this share of it is a copy of it, which may be left out. */
static double const DISTINCT = 1e-9;
/* Rounds of the search for copies. */
enum { ROUNDS = 64 };

typedef struct search {
  const eigen_problem *problem;
  size_t size;
  cholesky *factor;
  double *roots;    /* [size] M^1/2 */
  double *excluded; /* [excluded_count][size] orthonormal y */
  size_t excluded_count;
} search;

/* y -= its part along what is excluded; twice, since once leaves what cancellation made up. */
static void exclude(const search *s, double *y)
{
  for (int pass = 0; pass < 2; pass++) {
    for (size_t i = 0; i < s->excluded_count; i++) {
      const double *vector = s->excluded + i * s->size;
      dense_axpy(s->size, -dense_dot(s->size, vector, y), vector, y);
    }
  }
}

/* to = B from, both orthogonal to what is excluded. */
static exm_status apply(const search *s, const double *from, double *to)
{
  for (size_t i = 0; i < s->size; i++) {
    to[i] = s->roots[i] * from[i];
  }
  TRY(cholesky_solve(s->factor, 1, to));
  for (size_t i = 0; i < s->size; i++) {
    to[i] *= s->roots[i];
  }
  exclude(s, to);
  return EXM_OK;
}

/* One search of ARPACK's. */
typedef struct lanczos {
  int n, wanted, basis_size, work_size, info;
  double tolerance;
  int is_stuck;
  int iparam[11], ipntr[11];
  double *residual, *basis, *work_d, *work_l;
} lanczos;

/* Knuth's multiplier (MMIX). A start of our own makes results repeatable; orthogonal to nothing in particular. */
static void begin_vector(const search *s, double *y)
{
  uint64_t state = 1 + s->excluded_count;
  for (size_t i = 0; i < s->size; i++) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    y[i] = ((double)(state >> 11) * 0x1p-53 - 0.5) * s->roots[i];
  }
  exclude(s, y);
}

static exm_status iterate(const search *s, lanczos *l)
{
  int ido = 0;
  l->info = 1; /* start from `residual` */
  l->iparam[0] = 1;
  l->iparam[2] = RESTARTS;
  l->iparam[6] = 1;
  for (;;) {
    SINGLE_BLAS(dsaupd_(&ido, "I", &l->n, "LA", &l->wanted, &l->tolerance, l->residual, &l->basis_size, l->basis, &l->n,
                        l->iparam, l->ipntr, l->work_d, l->work_l, &l->work_size, &l->info, 1, 2));
    if (ido != 1 && ido != -1) {
      break;
    }
    TRY(apply(s, l->work_d + l->ipntr[0] - 1, l->work_d + l->ipntr[1] - 1));
    if (s->problem->stop && s->problem->stop(s->problem->user) != 0) {
      return status_set(EXM_ERROR_CANCELLED, "cancelled while looking for eigenfunctions");
    }
  }
  if (l->info != 0) {
    l->is_stuck = l->info == 1 || l->info == 3; /* restarts used up, or none possible */
    return status_set(EXM_ERROR_NUMERIC, "ARPACK did not converge on %d eigenvalues of a matrix of %d rows (info %d)",
                      l->wanted, l->n, l->info);
  }
  return EXM_OK;
}

/* values [wanted] of B, falling; vectors [wanted][size] y, orthonormal. */
static exm_status extract(lanczos *l, double *values, double *vectors)
{
  int const with_vectors = 1;
  double const sigma = 0;
  int *select = NULL;
  arena scratch = {0};
  double *rising = ARENA_NEW(&scratch, double, (size_t)l->wanted);
  double *found = ARENA_NEW(&scratch, double, (size_t)l->n *(size_t)l->wanted);
  select = ARENA_NEW(&scratch, int, (size_t)l->basis_size);
  exm_status status = EXM_OK;
  if (!rising || !found || !select) {
    status = status_no_memory("eigenfunctions");
    goto done;
  }
  SINGLE_BLAS(dseupd_(&with_vectors, "A", select, rising, found, &l->n, &sigma, "I", &l->n, "LA", &l->wanted,
                      &l->tolerance, l->residual, &l->basis_size, l->basis, &l->n, l->iparam, l->ipntr, l->work_d,
                      l->work_l, &l->work_size, &l->info, 1, 1, 2));
  if (l->info != 0) {
    status = status_set(EXM_ERROR_NUMERIC, "ARPACK found no eigenvectors (info %d)", l->info);
    goto done;
  }
  size_t const wanted = (size_t)l->wanted, size = (size_t)l->n;
  for (size_t i = 0; i < wanted; i++) {
    values[i] = rising[wanted - 1 - i];
    memcpy(vectors + i * size, found + (wanted - 1 - i) * size, size * sizeof(double));
  }
done:
  arena_release(&scratch);
  return status;
}

static exm_status attempt(const search *s, size_t count, double tolerance, size_t basis_size, int *is_stuck,
                          double *values, double *vectors)
{
  arena scratch = {0};
  lanczos l = {.n = (int)s->size, .wanted = (int)count, .tolerance = tolerance, .basis_size = (int)basis_size};
  l.work_size = l.basis_size * (l.basis_size + 8);
  l.residual = ARENA_NEW(&scratch, double, s->size);
  l.basis = ARENA_NEW(&scratch, double, s->size *basis_size);
  l.work_d = ARENA_NEW(&scratch, double, 3 * s->size);
  l.work_l = ARENA_NEW(&scratch, double, (size_t)l.work_size);
  exm_status status =
      l.residual && l.basis && l.work_d && l.work_l ? EXM_OK : status_no_memory("a search for eigenfunctions");
  if (status == EXM_OK) {
    begin_vector(s, l.residual);
#pragma omp critical(arpack)
    {
      status = iterate(s, &l);
      if (status == EXM_OK) {
        status = extract(&l, values, vectors);
      }
    }
  }
  *is_stuck = l.is_stuck;
  arena_release(&scratch);
  return status;
}

/* A small basis is fastest; where several equal eigenvalues lie across the end of those wanted it may not do. */
static exm_status search_once(const search *s, size_t count, double tolerance, double *values, double *vectors)
{
  size_t const left = s->size - s->excluded_count;
  size_t basis = count + count / 2 + MARGIN;
  for (int round = 0;; round++) {
    int is_stuck = 0;
    basis = basis < left ? basis : left;
    exm_status const status = attempt(s, count, tolerance, basis, &is_stuck, values, vectors);
    if (!is_stuck || basis == left || round == ATTEMPTS) {
      return status;
    }
    basis *= 2;
  }
}

/* Put another pair where it belongs among `count` falling ones, and drop the last. */
static void insert(size_t count, size_t size, double value, const double *vector, double *values, double *vectors)
{
  size_t place = count - 1;
  for (; place > 0 && values[place - 1] < value; place--) {
    values[place] = values[place - 1];
    memcpy(vectors + place * size, vectors + (place - 1) * size, size * sizeof(double));
  }
  values[place] = value;
  memcpy(vectors + place * size, vector, size * sizeof(double));
}

/* Lanczos methods see one vector of an eigenspace, and its other dimensions only by rounding. */
static exm_status find_copies(search *s, size_t count, double *values, double *vectors)
{
  size_t const before = s->excluded_count;
  arena scratch = {0};
  double *vector = ARENA_NEW(&scratch, double, s->size);
  exm_status status = vector ? EXM_OK : status_no_memory("eigenfunctions");
  memcpy(s->excluded + before * s->size, vectors, count * s->size * sizeof(double));
  s->excluded_count = before + count;
  for (int round = 0; round < ROUNDS && status == EXM_OK && s->excluded_count + 2 < s->size; round++) {
    double value = 0;
    status = search_once(s, 1, GLANCE, &value, vector);
    if (status < 0 || value <= values[count - 1] * (1 + DISTINCT)) {
      break; /* what is seen of a value is never above it, and a copy shows early: it leads by far */
    }
    status = search_once(s, 1, TOLERANCE, &value, vector);
    if (status < 0) {
      break;
    }
    insert(count, s->size, value, vector, values, vectors);
    memcpy(s->excluded + before * s->size, vectors, count * s->size * sizeof(double));
  }
  s->excluded_count = before;
  arena_release(&scratch);
  return status;
}

static exm_status factor(arena *scratch, search *s)
{
  const sparse *lower = s->problem->lower;
  size_t const entries = (size_t)lower->starts[lower->size];
  sparse shifted = *lower;
  shifted.values = ARENA_NEW(scratch, double, entries);
  if (!shifted.values) {
    return status_no_memory("eigenfunctions");
  }
  memcpy(shifted.values, lower->values, entries * sizeof(double));
  for (size_t j = 0; j < lower->size; j++) {
    for (int32_t e = lower->starts[j]; e < lower->starts[j + 1]; e++) {
      if (lower->rows[e] == (int32_t)j) {
        shifted.values[e] += s->problem->shift * s->problem->masses[j];
      }
    }
  }
  return cholesky_create(&shifted, &s->factor);
}

/* Few vertices: all of M^-1/2 A M^-1/2, what is known lifted out of the way. */
static exm_status solve_densely(arena *scratch, search *s, size_t count, double *values, double *vectors)
{
  size_t const n = s->size;
  const sparse *lower = s->problem->lower;
  double *A = ARENA_NEW(scratch, double, n *n);
  double *all = ARENA_NEW(scratch, double, n);
  if (!A || !all) {
    return status_no_memory("eigenfunctions");
  }
  double largest = 0;
  for (size_t j = 0; j < n; j++) {
    for (int32_t e = lower->starts[j]; e < lower->starts[j + 1]; e++) {
      size_t const i = (size_t)lower->rows[e];
      A[i * n + j] = A[j * n + i] = lower->values[e] / (s->roots[i] * s->roots[j]);
      largest = fmax(largest, fabs(A[i * n + j]));
    }
  }
  for (size_t k = 0; k < s->excluded_count; k++) {
    const double *y = s->excluded + k * n;
    for (size_t i = 0; i < n; i++) {
      dense_axpy(n, 1e3 * (double)n * largest * y[i], y, A + i * n);
    }
  }
  TRY(dense_eigen(n, A, all));
  memcpy(values, all, count * sizeof(double));
  memcpy(vectors, A, count * n * sizeof(double));
  return EXM_OK;
}

static exm_status solve_sparsely(arena *scratch, search *s, size_t count, double *values, double *vectors)
{
  exm_status status = factor(scratch, s);
  if (status == EXM_OK) {
    status = search_once(s, count, TOLERANCE, values, vectors);
  }
  if (status == EXM_OK) {
    status = find_copies(s, count, values, vectors);
  }
  cholesky_destroy(s->factor);
  for (size_t i = 0; i < count && status == EXM_OK; i++) {
    values[i] = 1 / values[i] - s->problem->shift;
  }
  return status;
}

exm_status eigen_lowest(const eigen_problem *problem, size_t count, double *values, double *vectors)
{
  size_t const size = problem->lower->size, known = problem->known_count;
  arena scratch = {0};
  search s = {.problem = problem, .size = size, .excluded_count = known};
  exm_status status = EXM_OK;
  s.roots = ARENA_NEW(&scratch, double, size);
  s.excluded = ARENA_NEW(&scratch, double, (known + count) * size);
  if (!s.roots || !s.excluded) {
    status = status_no_memory("eigenfunctions");
    goto done;
  }
  for (size_t i = 0; i < size; i++) {
    s.roots[i] = sqrt(problem->masses[i]);
    for (size_t k = 0; k < known; k++) {
      s.excluded[k * size + i] = s.roots[i] * problem->known[k * size + i];
    }
  }
  status = count == 0 ? EXM_OK
           : size <= DENSE_SIZE || 3 * (count + known) + 12 > size
               ? solve_densely(&scratch, &s, count, values, vectors)
               : solve_sparsely(&scratch, &s, count, values, vectors);
  for (size_t i = 0; i < count && status == EXM_OK; i++) {
    values[i] = fmax(values[i], 0);
    for (size_t v = 0; v < size; v++) {
      vectors[i * size + v] /= s.roots[v];
    }
  }
done:
  arena_release(&scratch);
  return status;
}
