/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/reduced.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Directions of the dictionary whose energy is below this share of the largest (in amplitude) are combinations of
 * others to rounding. Dropping one displaces the mesh by about its share of its size; keeping one needs coefficients as
 * large as its inverse, which cost the same digits in the final skinning. */
static double const RANK_TOLERANCE = 1e-7;
/* Above this many columns eigenvalues of the Gram matrix replace singular values: half the digits, a tenth of the time.
 */
enum { SINGULAR_MAXIMUM = 700 };
static double const GRAM_RANK_TOLERANCE = 1e-6;
/* Relative to the factors as they were: constraints that hold all there is leave nothing but this. */
static double const ROUNDING = 1e-12;
static double const SHAPE_TOLERANCE = 1e-11;

/** All groups' factors under one another, over all atoms: [rows][atoms]. */
static double *stack_factors(arena *owner, const group_factor *factors, size_t group_count, size_t atoms, size_t rows)
{
  double *stack = ARENA_NEW(owner, double, rows *atoms);
  double *row = stack;
  for (size_t g = 0; stack && g < group_count; g++) {
    for (size_t i = 0; i < factors[g].row_count; i++, row += atoms) {
      for (size_t j = 0; j < factors[g].column_count; j++) {
        row[factors[g].columns[j]] = factors[g].rows[i * factors[g].column_count + j];
      }
    }
  }
  return stack;
}

static exm_status cannot_be_held(size_t handle)
{
  return status_set_at(EXM_ERROR_NUMERIC, EXM_ELEMENT_HANDLE, handle,
                       "handle %zu cannot be held: its constraint follows from those of other handles", handle);
}

/** Gauss-Jordan with column pivoting: each constraint binds the atom that moves it most, and is solved for it. On
 * return A is the identity on the bound columns, and `inverse` what the right-hand side is multiplied by. */
static exm_status bind_atoms(const constraints *c, size_t atoms, double *A, double *inverse, size_t *bound)
{
  size_t const rows = c->row_count;
  for (size_t i = 0; i < rows; i++) {
    inverse[i * rows + i] = 1;
  }
  for (size_t i = 0; i < rows; i++) {
    double *row = A + i * atoms;
    size_t pivot = 0;
    for (size_t j = 1; j < atoms; j++) {
      pivot = fabs(row[j]) > fabs(row[pivot]) ? j : pivot;
    }
    if (fabs(row[pivot]) < 1e-9) {
      return cannot_be_held(c->rows[i].handle);
    }
    bound[i] = pivot;
    double const scale = 1 / row[pivot];
    for (size_t j = 0; j < atoms; j++) {
      row[j] *= scale;
    }
    for (size_t j = 0; j < rows; j++) {
      inverse[i * rows + j] *= scale;
    }
    for (size_t k = 0; k < rows; k++) {
      double const factor = A[k * atoms + pivot];
      if (k != i && factor != 0) {
        dense_axpy(atoms, -factor, row, A + k * atoms);
        dense_axpy(rows, -factor, inverse + i * rows, inverse + k * rows);
      }
    }
  }
  return EXM_OK;
}

static exm_status eliminate_constraints(arena *owner, const dictionary *d, const constraints *c, reduced_mesh *r)
{
  if (c->row_count > d->atom_count) {
    return cannot_be_held(c->rows[d->atom_count].handle);
  }
  arena scratch = {0};
  exm_status status = EXM_OK;
  size_t const rows = c->row_count, atoms = d->atom_count, kept = atoms - rows;
  double *A = ARENA_NEW(&scratch, double, rows *atoms);
  double *values = ARENA_NEW(&scratch, double, 1 + d->exemplar_count * d->dimension);
  unsigned char *is_bound = ARENA_NEW(&scratch, unsigned char, atoms);
  r->bound = ARENA_NEW(owner, size_t, rows);
  r->kept = ARENA_NEW(owner, size_t, kept);
  r->bound_to_c = ARENA_NEW(owner, double, rows *rows);
  r->bound_rest = ARENA_NEW(owner, double, rows *kept);
  r->exemplar_targets = ARENA_NEW(owner, double, rows * d->exemplar_count * d->dimension);
  r->is_frame_row = ARENA_NEW(owner, unsigned char, rows);
  if (!A || !values || !is_bound || !r->is_frame_row || !r->bound || !r->kept || !r->bound_to_c || !r->bound_rest ||
      !r->exemplar_targets) {
    status = status_no_memory("the handle constraints");
    goto done;
  }
  constraints_on_exemplars(c, d, r->exemplar_targets);
  constraints_matrix(c, d, values, A);
  status = bind_atoms(c, atoms, A, r->bound_to_c, r->bound);
  if (status < 0) {
    goto done;
  }
  for (size_t i = 0; i < rows; i++) {
    r->is_frame_row[i] = c->rows[i].is_frame != 0;
    is_bound[r->bound[i]] = 1;
  }
  size_t next = 0;
  for (size_t a = 0; a < atoms; a++) {
    if (!is_bound[a]) {
      r->kept[next++] = a;
    }
  }
  for (size_t i = 0; i < rows; i++) {
    for (size_t j = 0; j < kept; j++) {
      r->bound_rest[i * kept + j] = A[i * atoms + r->kept[j]];
    }
  }
done:
  arena_release(&scratch);
  return status;
}

/** Columns of the stacked factors for the kept atoms with the constraints eliminated, and for the constraints. */
static exm_status split_columns(arena *owner, const reduced_mesh *r, const double *stack, size_t rows, double **free,
                                double **held)
{
  size_t const kept = r->atom_count - r->constraint_count, bound = r->constraint_count;
  arena scratch = {0};
  exm_status status = EXM_OK;
  double *at_bound = ARENA_NEW(&scratch, double, rows *bound);
  *free = ARENA_NEW(owner, double, (rows > kept ? rows : kept) * kept);
  *held = ARENA_NEW(owner, double, rows *bound);
  if (!at_bound || !*free || !*held) {
    status = status_no_memory("the reduced operators");
    goto done;
  }
  for (size_t i = 0; i < rows; i++) {
    for (size_t j = 0; j < kept; j++) {
      (*free)[i * kept + j] = stack[i * r->atom_count + r->kept[j]];
    }
    for (size_t j = 0; j < bound; j++) {
      at_bound[i * bound + j] = stack[i * r->atom_count + r->bound[j]];
    }
  }
  dense_multiply(0, 0, rows, kept, bound, -1, at_bound, r->bound_rest, 1, *free);
  dense_multiply(0, 0, rows, bound, bound, 1, at_bound, r->bound_to_c, 0, *held);
done:
  arena_release(&scratch);
  return status;
}

/** Singular values, falling, and right singular vectors (rows of V) of X [rows][columns]. */
static exm_status spectrum(const double *X, size_t rows, size_t columns, double *values, double *V)
{
  arena scratch = {0};
  exm_status status;
  if (columns > SINGULAR_MAXIMUM) {
    dense_multiply(1, 0, columns, columns, rows, 1, X, X, 0, V);
    status = dense_eigen(columns, V, values);
    for (size_t i = 0; i < columns / 2; i++) {
      double const value = values[i];
      values[i] = values[columns - 1 - i];
      values[columns - 1 - i] = value;
      for (size_t j = 0; j < columns; j++) {
        double const entry = V[i * columns + j];
        V[i * columns + j] = V[(columns - 1 - i) * columns + j];
        V[(columns - 1 - i) * columns + j] = entry;
      }
    }
    for (size_t i = 0; i < columns; i++) {
      values[i] = sqrt(fmax(values[i], 0));
    }
    return status;
  }
  size_t const padded = rows > columns ? rows : columns;
  double *copy = ARENA_NEW(&scratch, double, padded *columns);
  if (!copy) {
    return status_no_memory("the reduced operators");
  }
  memcpy(copy, X, rows * columns * sizeof(double));
  status = dense_right_singular(padded, columns, copy, values, V);
  arena_release(&scratch);
  return status;
}

/** An energy-orthonormal basis of the free coefficients; on return X holds U = X basis, [rows][rank]. `whole` is the
 * size of the factors before the constraints were eliminated. */
static exm_status orthonormal_basis(arena *owner, reduced_mesh *r, double whole, double *X, size_t rows)
{
  size_t const kept = r->atom_count - r->constraint_count;
  arena scratch = {0};
  double *values = ARENA_NEW(&scratch, double, kept);
  double *V = ARENA_NEW(&scratch, double, kept *kept);
  exm_status status = values && V ? EXM_OK : status_no_memory("the reduced operators");
  if (status == EXM_OK) {
    status = spectrum(X, rows, kept, values, V);
  }
  if (status < 0) {
    goto done;
  }
  double const tolerance = kept > SINGULAR_MAXIMUM ? GRAM_RANK_TOLERANCE : RANK_TOLERANCE;
  r->rank = 0;
  while (r->rank < kept && values[r->rank] > fmax(tolerance * values[0], ROUNDING * whole)) {
    r->rank++;
  }
  r->basis = ARENA_NEW(owner, double, kept * r->rank);
  double *U = ARENA_NEW(&scratch, double, rows * r->rank);
  if (!r->basis || !U) {
    status = status_no_memory("the reduced operators");
    goto done;
  }
  for (size_t j = 0; j < kept; j++) {
    for (size_t i = 0; i < r->rank; i++) {
      r->basis[j * r->rank + i] = V[i * kept + j] / values[i];
    }
  }
  dense_multiply(0, 0, rows, r->rank, kept, 1, X, r->basis, 0, U);
  memcpy(X, U, rows * r->rank * sizeof(double));
done:
  arena_release(&scratch);
  return status;
}

/** Move the constraints' proxies out of the span of U: the pose of least energy under c needs no u. */
static exm_status make_orthogonal(arena *owner, reduced_mesh *r, const double *U, double *F, size_t rows)
{
  r->shift = ARENA_NEW(owner, double, r->rank * r->constraint_count);
  if (!r->shift) {
    return status_no_memory("the reduced operators");
  }
  dense_multiply(1, 0, r->rank, r->constraint_count, rows, 1, U, F, 0, r->shift);
  dense_multiply(0, 0, rows, r->constraint_count, r->rank, -1, U, r->shift, 1, F);
  return EXM_OK;
}

/** Proxies of one group: the exemplars' E, and side by side what turns with them: U | F. */
typedef struct group_rows {
  size_t count, width, other_width;
  double *E, *others;
} group_rows;

static exm_status gather_group(arena *scratch, const reduced_mesh *r, const group_factor *factor,
                               const double *coefficients, const double *U, const double *F, group_rows *out)
{
  size_t const width = r->exemplar_count * r->dimension, rank = r->rank, bound = r->constraint_count;
  group_rows rows = {.count = factor->row_count, .width = width, .other_width = rank + bound};
  rows.E = ARENA_NEW(scratch, double, rows.count *width);
  rows.others = ARENA_NEW(scratch, double, rows.count *rows.other_width);
  if (!rows.E || !rows.others) {
    return status_no_memory("the reduced operators");
  }
  for (size_t i = 0; i < rows.count; i++) {
    double *other = rows.others + i * rows.other_width;
    for (size_t j = 0; j < factor->column_count; j++) {
      dense_axpy(width, factor->rows[i * factor->column_count + j], coefficients + factor->columns[j] * width,
                 rows.E + i * width);
    }
    memcpy(other, U + i * rank, rank * sizeof(double));
    memcpy(other + rank, F + i * bound, bound * sizeof(double));
  }
  *out = rows;
  return EXM_OK;
}

/** Copy columns [from, from + width) of rows [first, last). */
static void take(const group_rows *rows, size_t first, size_t last, size_t from, size_t width, double *out)
{
  for (size_t i = first; i < last; i++) {
    memcpy(out + (i - first) * width, rows->others + i * rows->other_width + from, width * sizeof(double));
  }
}

/** Put a turned group in place: its first `rank` rows hold exemplars. */
static void append_group(const group_rows *rows, size_t shape_rank, size_t g, double *rest_rows, reduced_mesh *r)
{
  size_t const shape = r->shape_offsets[g], rest = r->rest_offsets[g], bound = r->constraint_count;
  memcpy(r->shapes + shape * rows->width, rows->E, shape_rank * rows->width * sizeof(double));
  take(rows, 0, shape_rank, r->rank, bound, r->Fx + shape * bound);
  take(rows, shape_rank, rows->count, r->rank, bound, r->Fr + rest * bound);
  take(rows, shape_rank, rows->count, 0, r->rank + bound, rest_rows + rest * (r->rank + bound));
  r->shape_offsets[g + 1] = shape + shape_rank;
  r->rest_offsets[g + 1] = rest + rows->count - shape_rank;
  take(rows, 0, shape_rank, 0, r->rank, r->Ux + shape * r->rank);
  take(rows, shape_rank, rows->count, 0, r->rank, r->Ur + rest * r->rank);
}

static exm_status allocate_rows(arena *owner, const group_factor *factors, size_t rows, reduced_mesh *r)
{
  size_t const width = r->exemplar_count * r->dimension, bound = r->constraint_count;
  size_t shape_bound = 0;
  for (size_t g = 0; g < r->group_count; g++) {
    shape_bound += factors[g].row_count < width ? factors[g].row_count : width;
  }
  r->shape_offsets = ARENA_NEW(owner, size_t, r->group_count + 1);
  r->rest_offsets = ARENA_NEW(owner, size_t, r->group_count + 1);
  r->shapes = ARENA_NEW(owner, double, shape_bound *width);
  r->Ux = ARENA_NEW(owner, double, shape_bound * r->rank);
  r->Fx = ARENA_NEW(owner, double, shape_bound *bound);
  r->Ur = ARENA_NEW(owner, double, rows * r->rank);
  r->Fr = ARENA_NEW(owner, double, rows *bound);
  if (!r->shape_offsets || !r->rest_offsets || !r->shapes || !r->Ux || !r->Fx || !r->Ur || !r->Fr) {
    return status_no_memory("the reduced operators");
  }
  return EXM_OK;
}

/** The rest's rows [rest_rows][rank + constraints] matter only through their energy: keep the triangle of their QR. */
static exm_status keep_rest_root(arena *owner, double *rest_rows, reduced_mesh *r)
{
  size_t const width = r->rank + r->constraint_count;
  r->rest_root_rows = r->rest_rows < width ? r->rest_rows : width;
  r->rest_root = ARENA_NEW(owner, double, r->rest_root_rows *width);
  if (!r->rest_root) {
    return status_no_memory("the reduced operators");
  }
  if (r->rest_root_rows > 0) {
    TRY(dense_qr_factor(r->rest_rows, width, rest_rows));
    memcpy(r->rest_root, rest_rows, r->rest_root_rows * width * sizeof(double));
  }
  return EXM_OK;
}

static exm_status turn_groups(arena *owner, const dictionary *d, const group_factor *factors, const double *U,
                              const double *F, size_t rows, reduced_mesh *r)
{
  arena scratch = {0};
  double *coefficients = ARENA_NEW(&scratch, double, d->atom_count * r->exemplar_count * r->dimension);
  double *rest_rows = ARENA_NEW(&scratch, double, rows *(r->rank + r->constraint_count));
  exm_status status =
      coefficients && rest_rows ? allocate_rows(owner, factors, rows, r) : status_no_memory("the reduced operators");
  if (status < 0) {
    goto done;
  }
  dictionary_exemplar_coefficients(d, coefficients);
  for (size_t g = 0, row = 0; g < r->group_count && status == EXM_OK; row += factors[g++].row_count) {
    arena local = {0};
    group_rows group = {0};
    size_t shape_rank = 0;
    status =
        gather_group(&local, r, &factors[g], coefficients, U + row * r->rank, F + row * r->constraint_count, &group);
    if (status == EXM_OK) {
      status = dense_rotate_rows(group.count, group.width, group.E, group.other_width, group.others, SHAPE_TOLERANCE,
                                 &shape_rank);
    }
    if (status == EXM_OK) {
      append_group(&group, shape_rank, g, rest_rows, r);
    }
    arena_release(&local);
  }
  r->shape_rows = r->shape_offsets[r->group_count];
  r->rest_rows = r->rest_offsets[r->group_count];
  if (status == EXM_OK) {
    status = keep_rest_root(owner, rest_rows, r);
  }
done:
  arena_release(&scratch);
  return status;
}

/** What solves multiply with. */
static exm_status finish(arena *owner, reduced_mesh *r)
{
  size_t const width = r->exemplar_count * r->dimension;
  r->size = sqrt(dense_dot(r->shape_rows * width, r->shapes, r->shapes) / (double)r->exemplar_count);
  r->G = ARENA_NEW(owner, double, r->shape_rows * r->shape_rows);
  if (!r->G) {
    return status_no_memory("the reduced operators");
  }
  dense_multiply(0, 1, r->shape_rows, r->shape_rows, r->rank, 1, r->Ux, r->Ux, 0, r->G);
  return EXM_OK;
}

exm_status reduced_create(arena *owner, const dictionary *d, const constraints *c, const group_factor *factors,
                          size_t group_count, const progress *report, reduced_mesh *out)
{
  reduced_mesh r = {.dimension = d->dimension,
                    .group_count = group_count,
                    .exemplar_count = d->exemplar_count,
                    .constraint_count = c->row_count,
                    .atom_count = d->atom_count};
  arena scratch = {0};
  size_t rows = 0;
  double *U = NULL, *F = NULL;
  exm_status status = EXM_OK;
  for (size_t g = 0; g < group_count; g++) {
    rows += factors[g].row_count;
  }
  double *stack = stack_factors(&scratch, factors, group_count, d->atom_count, rows);
  if (!stack) {
    status = status_no_memory("the reduced operators");
    goto done;
  }
  if ((status = eliminate_constraints(owner, d, c, &r)) < 0 ||
      (status = split_columns(&scratch, &r, stack, rows, &U, &F)) < 0 ||
      (status = progress_report(report, 0.2, "reducing the mesh")) < 0 ||
      (status = orthonormal_basis(owner, &r, sqrt(dense_dot(rows * d->atom_count, stack, stack)), U, rows)) < 0 ||
      (status = make_orthogonal(owner, &r, U, F, rows)) < 0 ||
      (status = progress_report(report, 0.7, "reducing the mesh")) < 0 ||
      (status = turn_groups(owner, d, factors, U, F, rows, &r)) < 0 || (status = finish(owner, &r)) < 0) {
    goto done;
  }
  *out = r;
done:
  arena_release(&scratch);
  return status;
}
