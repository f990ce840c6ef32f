/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where the alternation begins: coefficients of few atoms that meet the constraints [Blended, eq. 20-23]. */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"
#include "numeric/elastic_net.h"

enum { PATH = 10, SWEEPS = 60 };
static double const NET_TOLERANCE = 1e-5;
/* The plain start's own ridge, beside the largest diagonal entry: with fewer constraints than atoms eq. 22 has a whole
 * space of minima, of which this takes the smallest. */
static double const PLAIN_RIDGE = 1e-6;

/** A'y of the net for coordinate k, over the first stage's raw atoms. */
static void net_product(const blended *b, size_t k, double *out)
{
  const blended_basis *first = &b->bases[BLENDED_FIRST];
  const blended_constraints *c = &b->held;
  memset(out, 0, first->atom_count * sizeof(double));
  for (size_t r = 0; r < c->row_count; r++) {
    const double *x = c->joint + r * b->joint_count;
    double const pull = c->weighted[r * b->dimension + k];
    for (size_t j = 0; j < first->atom_count && pull != 0; j++) {
      out[j] += pull * x[first->atoms[j]];
    }
  }
}

/** The constant's translation is where the mesh lies; it costs nothing. */
static void set_penalties(blended *b, const blended_options *options)
{
  const blended_basis *first = &b->bases[BLENDED_FIRST];
  double most = 0;
  for (size_t j = 0; j < first->atom_count; j++) {
    most = fmax(most, b->held.net_gram[j * first->atom_count + j]);
  }
  for (size_t j = 0; j < first->atom_count; j++) {
    int const is_place = first->atoms[j] == 0;
    b->net_lasso[j] = is_place || options->is_plain ? 0 : options->sparsity;
    b->net_ridge[j] = b->beta_sm * b->first_bending[j] + (is_place ? 0 : PLAIN_RIDGE * most);
  }
}

/** Eq. 22, all coordinates at once: a dense ridge regression. x, product [d][atoms]. */
static exm_status solve_plain(blended *b)
{
  size_t const n = b->bases[BLENDED_FIRST].atom_count;
  arena scratch = {0};
  double *matrix = ARENA_NEW(&scratch, double, n *n);
  exm_status status = matrix ? EXM_OK : status_no_memory("the solve");
  if (status == EXM_OK) {
    memcpy(matrix, b->held.net_gram, n * n * sizeof(double));
    for (size_t j = 0; j < n; j++) {
      matrix[j * n + j] += b->net_ridge[j] + (b->net_ridge[j] > 0 ? 0 : 1e-12);
    }
    if (!dense_cholesky(n, matrix)) {
      status = status_set(EXM_ERROR_NUMERIC, "the beginning's matrix is not positive definite");
    }
  }
  for (size_t k = 0; k < b->dimension && status == EXM_OK; k++) {
    memcpy(b->net_x + k * n, b->net_product + k * n, n * sizeof(double));
    dense_cholesky_forward(n, matrix, b->net_x + k * n);
    dense_cholesky_backward(n, matrix, b->net_x + k * n);
  }
  arena_release(&scratch);
  return status;
}

static void solve_sparse(blended *b)
{
  size_t const n = b->bases[BLENDED_FIRST].atom_count;
  elastic_net const net = {.count = n,
                           .gram = b->held.net_gram,
                           .ridge = b->net_ridge,
                           .lasso = b->net_lasso,
                           .path_count = PATH,
                           .sweep_limit = SWEEPS,
                           .tolerance = NET_TOLERANCE};
  for (size_t k = 0; k < b->dimension; k++) {
    elastic_net_solve(&net, b->net_product + k * n, b->net_scratch, b->net_x + k * n);
  }
}

exm_status blended_begin(blended *b, const blended_options *options, size_t *used)
{
  size_t const n = b->bases[BLENDED_FIRST].atom_count, d = b->dimension;
  size_t const P = b->exemplar_count * b->group_count * d;
  double *rows = b->net_scratch + n; /* [n][d] */
  set_penalties(b, options);
  for (size_t k = 0; k < d; k++) {
    net_product(b, k, b->net_product + k * n);
  }
  if (options->is_plain) {
    TRY(solve_plain(b));
  } else {
    solve_sparse(b);
  }
  *used = 0;
  for (size_t j = 0; j < n; j++) {
    int is_used = 0;
    for (size_t k = 0; k < d; k++) {
      rows[j * d + k] = b->net_x[k * n + j];
      is_used |= rows[j * d + k] != 0;
    }
    *used += (size_t)is_used;
  }
  dense_times(P, n, d, b->first_proxies, rows, b->fits);
  rotation_fit(d, b->exemplar_count * b->group_count, b->fits, b->rotations);
  return EXM_OK;
}
