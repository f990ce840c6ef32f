/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"

/* What an atom weighs beside its elastic energy, so that constants count as well. */
static double const MASS_SHARE = 1;
/* And beside its smoothness: where atoms are collinear, coefficients that give the same pose differ in that alone, and
 * minimising must be free to choose among them. Small, so that the basis stays orthonormal in the rest nearly. */
static double const BENDING_SHARE = 1e-10;
/* Directions below this share of the largest are noise of the Gram matrix: atoms are collinear wherever exemplars
 * agree, and that is the first limitation the paper admits. 1e-6 of the mesh in amplitude. */
static double const RANK_TOLERANCE = 1e-12;

/** out [n][n] = rows and columns `atoms` of A [all][all]. */
static void select_block(size_t all, size_t n, const size_t *atoms, const double *A, double *out)
{
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < n; j++) {
      out[i * n + j] = A[atoms[i] * all + atoms[j]];
    }
  }
}

/** out [rank][rank] = basis' A basis for the rows and columns of `atoms`. block, half: scratch [n][n]. */
static void reduce_form(const blended_basis *s, size_t all, const double *A, double *block, double *half, double *out)
{
  size_t const n = s->atom_count, rank = s->rank;
  select_block(all, n, s->atoms, A, block);
  dense_multiply(0, 0, n, rank, n, 1, block, s->basis, 0, half);
  dense_multiply(1, 0, rank, rank, n, 1, s->basis, half, 0, out);
}

/** Basis vectors from the eigenvectors of the metric, scaled by what each atom weighs on its own: atoms' sizes differ
 * by orders, and noise is relative to each. */
static exm_status find_basis(arena *owner, const edge_energy *energy, const double *bending, double *metric,
                             double *block, double *values, blended_basis *s)
{
  size_t const n = s->atom_count;
  select_block(energy->atom_count, n, s->atoms, energy->laplacian, metric);
  select_block(energy->atom_count, n, s->atoms, energy->masses, block);
  dense_axpy(n * n, MASS_SHARE, block, metric);
  select_block(energy->atom_count, n, s->atoms, bending, block);
  dense_axpy(n * n, BENDING_SHARE, block, metric);
  double *scales = block; /* [n] */
  for (size_t i = 0; i < n; i++) {
    double const weight = metric[i * n + i];
    scales[i] = weight > 0 ? 1 / sqrt(weight) : 0;
  }
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < n; j++) {
      metric[i * n + j] *= scales[i] * scales[j];
    }
  }
  TRY(dense_eigen(n, metric, values));
  size_t first = 0;
  while (first < n && !(values[first] > RANK_TOLERANCE * values[n - 1])) {
    first++;
  }
  s->rank = n - first;
  if (s->rank == 0) {
    return status_set(EXM_ERROR_NUMERIC, "the dictionary spans nothing: all its atoms vanish");
  }
  s->basis = ARENA_NEW(owner, double, n * s->rank);
  if (!s->basis) {
    return status_no_memory("the dictionary");
  }
  for (size_t k = 0; k < s->rank; k++) {
    for (size_t i = 0; i < n; i++) {
      s->basis[i * s->rank + k] = scales[i] * metric[(first + k) * n + i] / sqrt(values[first + k]);
    }
  }
  return EXM_OK;
}

static exm_status find_proxies(arena *owner, arena *scratch, const edge_energy *energy, blended_basis *s)
{
  size_t const rows = energy->exemplar_count * energy->group_count * energy->dimension, n = s->atom_count;
  double *selected = ARENA_NEW(scratch, double, rows *n);
  s->proxies = ARENA_NEW(owner, double, rows * s->rank);
  if (!selected || !s->proxies) {
    return status_no_memory("the dictionary");
  }
  for (size_t i = 0; i < rows; i++) {
    for (size_t j = 0; j < n; j++) {
      selected[i * n + j] = energy->proxies[i * energy->atom_count + s->atoms[j]];
    }
  }
  dense_multiply(0, 0, rows, s->rank, n, 1, selected, s->basis, 0, s->proxies);
  return EXM_OK;
}

exm_status blended_basis_create(arena *owner, const edge_energy *energy, const double *bending, size_t atom_count,
                                const size_t *atoms, blended_basis *out)
{
  size_t const n = atom_count, all = energy->atom_count;
  arena scratch = {0};
  blended_basis s = {.atom_count = n, .atoms = ARENA_NEW(owner, size_t, n)};
  double *metric = ARENA_NEW(&scratch, double, n *n);
  double *block = ARENA_NEW(&scratch, double, n *n);
  double *values = ARENA_NEW(&scratch, double, n);
  exm_status status = s.atoms && metric && block && values ? EXM_OK : status_no_memory("the dictionary");
  if (status < 0) {
    goto done;
  }
  memcpy(s.atoms, atoms, n * sizeof *atoms);
  status = find_basis(owner, energy, bending, metric, block, values, &s);
  if (status < 0) {
    goto done;
  }
  s.elastic = ARENA_NEW(owner, double, s.rank *s.rank);
  s.bending = ARENA_NEW(owner, double, s.rank *s.rank);
  if (!s.elastic || !s.bending) {
    status = status_no_memory("the dictionary");
    goto done;
  }
  reduce_form(&s, all, energy->laplacian, block, metric, s.elastic);
  reduce_form(&s, all, bending, block, metric, s.bending);
  status = find_proxies(owner, &scratch, energy, &s);
  *out = s;
done:
  arena_release(&scratch);
  return status;
}

/** K of the first stage's raw atoms, and the diagonal of its Lambda. */
static exm_status keep_first_atoms(arena *owner, blended *b)
{
  const blended_basis *first = &b->bases[BLENDED_FIRST];
  size_t const n = first->atom_count, rows = b->exemplar_count * b->group_count * b->dimension;
  b->first_proxies = ARENA_NEW(owner, double, rows *n);
  if (!b->first_proxies) {
    return status_no_memory("the deformer");
  }
  for (size_t i = 0; i < rows; i++) {
    for (size_t j = 0; j < n; j++) {
      b->first_proxies[i * n + j] = b->energy->proxies[i * b->joint_count + first->atoms[j]];
    }
  }
  return EXM_OK;
}

exm_status blended_allocate(arena *owner, blended *b)
{
  size_t const d = b->dimension, stacked = b->exemplar_count * b->group_count * d * d;
  size_t const first = b->bases[BLENDED_FIRST].rank, last = b->bases[BLENDED_LAST].rank;
  size_t const rank = first > last ? first : last, atoms = b->bases[BLENDED_FIRST].atom_count;
  double **const arrays[] = {&b->rotations, &b->fits, &b->turned, &b->started, &b->best};
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
    *arrays[i] = ARENA_NEW(owner, double, stacked);
    if (!*arrays[i]) {
      return status_no_memory("the deformer");
    }
  }
  b->frames = ARENA_NEW(owner, blended_frame, b->exemplar_count);
  b->reached = ARENA_NEW(owner, double, rank *d);
  b->z = ARENA_NEW(owner, double, rank *d);
  b->u = ARENA_NEW(owner, double, rank *d);
  b->coefficients = ARENA_NEW(owner, double, b->joint_count *d);
  b->net_x = ARENA_NEW(owner, double, atoms *d);
  b->net_product = ARENA_NEW(owner, double, atoms *d);
  b->net_scratch = ARENA_NEW(owner, double, atoms *(1 + d));
  b->net_lasso = ARENA_NEW(owner, double, atoms);
  b->net_ridge = ARENA_NEW(owner, double, atoms);
  if (!b->frames || !b->reached || !b->z || !b->u || !b->coefficients || !b->net_x || !b->net_product ||
      !b->net_scratch || !b->net_lasso || !b->net_ridge) {
    return status_no_memory("the deformer");
  }
  return keep_first_atoms(owner, b);
}
