/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Linear constraints that come and go [Blended, 4.4].
 *
 * A row x of weight w adds w x x' to Gamma. Any root of Gamma^-1 serves, and with p = W'x
 *
 *     (Gamma + w x x')^-1 = W (I + w p p')^-1 W',    W <- W (I - g p p'),  g = (1 - 1 / sqrt(1 + w |p|^2)) / |p|^2,
 *
 * is one: no triangle has to be kept, U follows by the same step, and G by a rank-one term. */
#include <math.h>
#include <string.h>

#include "deform/blended/blended.h"
#include "linalg/dense.h"

/* So many updates cost as much as a new factorisation, and roundings add up. */
enum { UPDATES_MOST = 64 };
/* An update that takes away all but this of a direction's stiffness cancels too many digits. */
static double const CANCELLED = 1e-6;
/* Held beside everything, in the basis' own metric: what nothing else determines stays at rest. */
static double const FLOOR = 1e-12;
/* Without constraints nothing says where the mesh is: firm enough for rounding not to move it. */
static double const FREE_FLOOR = 1e-6;

static size_t proxy_rows(const blended *b)
{
  return b->exemplar_count * b->group_count * b->dimension;
}

static exm_status allocate(blended_constraints *c, const blended *b, size_t row_count)
{
  size_t const d = b->dimension, P = proxy_rows(b), n = b->bases[BLENDED_FIRST].atom_count;
  size_t const block = b->group_count * d;
  arena *owner = &c->memory;
  int whole = 1;
  c->row_count = row_count;
  c->rows = ARENA_NEW(owner, constraint_row, row_count);
  c->weights = ARENA_NEW(owner, double, row_count);
  c->sums = ARENA_NEW(owner, double, row_count);
  c->joint = ARENA_NEW(owner, double, row_count * b->joint_count);
  c->on_exemplars = ARENA_NEW(owner, double, row_count * b->exemplar_count * d);
  c->net_gram = ARENA_NEW(owner, double, n *n);
  c->free_root = ARENA_NEW(owner, double, b->bases[BLENDED_LAST].rank * b->bases[BLENDED_LAST].rank);
  c->targets = ARENA_NEW(owner, double, row_count *d);
  c->framed = ARENA_NEW(owner, double, row_count *d);
  c->weighted = ARENA_NEW(owner, double, row_count *d);
  for (int s = 0; s < BLENDED_STAGES; s++) {
    size_t const rank = b->bases[s].rank;
    blended_factor *f = &c->factors[s];
    f->rows = ARENA_NEW(owner, double, row_count *rank);
    f->root = ARENA_NEW(owner, double, rank *rank);
    f->responses = ARENA_NEW(owner, double, P *rank);
    f->green = ARENA_NEW(owner, double, b->exemplar_count *block *block);
    f->held = ARENA_NEW(owner, double, row_count *rank);
    f->z = ARENA_NEW(owner, double, rank *d);
    f->y = ARENA_NEW(owner, double, P *d);
    whole = whole && f->rows && f->root && f->responses && f->green && f->held && f->z && f->y;
  }
  whole = whole && c->rows && c->weights && c->sums && c->joint && c->on_exemplars && c->net_gram && c->free_root &&
          c->targets && c->framed && c->weighted;
  return whole ? EXM_OK : status_no_memory("the constraints");
}

/* ------------------------------------------------------------------------------------------------------- the factor */

/** G of every exemplar from U. */
static void find_green(const blended *b, int stage, blended_factor *f)
{
  size_t const block = b->group_count * b->dimension, rank = b->bases[stage].rank;
  for (size_t s = 0; s < b->exemplar_count; s++) {
    const double *U = f->responses + s * block * rank;
    dense_multiply(0, 1, block, block, rank, 1, U, U, 0, f->green + s * block * block);
  }
}

/** W from a Cholesky factor of Gamma, with the rows of c or without any: W' = L^-1. */
static exm_status make_root(const blended *b, int stage, const blended_constraints *c, size_t row_count, double *root)
{
  const blended_basis *s = &b->bases[stage];
  size_t const rank = s->rank;
  arena scratch = {0};
  double *gamma = ARENA_NEW(&scratch, double, rank *rank);
  exm_status status = gamma ? EXM_OK : status_no_memory("the constraints");
  if (status < 0) {
    return status;
  }
  memcpy(gamma, s->elastic, rank * rank * sizeof(double));
  dense_axpy(rank * rank, b->beta_sm, s->bending, gamma);
  for (size_t i = 0; i < rank; i++) {
    gamma[i * rank + i] += row_count > 0 ? FLOOR : FREE_FLOOR;
  }
  for (size_t r = 0; r < row_count; r++) {
    const double *x = c->factors[stage].rows + r * rank;
    for (size_t i = 0; i < rank && c->weights[r] > 0; i++) {
      dense_axpy(rank, b->beta_lc * c->weights[r] * x[i], x, gamma + i * rank);
    }
  }
  if (!dense_cholesky(rank, gamma)) {
    status = status_set(EXM_ERROR_NUMERIC, "the energy's matrix is not positive definite");
  }
  for (size_t i = 0; i < rank && status == EXM_OK; i++) {
    double *row = root + i * rank; /* row i of W is column i of L^-1 */
    memset(row, 0, rank * sizeof(double));
    row[i] = 1;
    dense_cholesky_forward(rank, gamma, row);
  }
  arena_release(&scratch);
  return status;
}

static exm_status make_factor(const blended *b, int stage, blended_constraints *c)
{
  const blended_basis *s = &b->bases[stage];
  blended_factor *f = &c->factors[stage];
  size_t const rank = s->rank;
  TRY(make_root(b, stage, c, c->row_count, f->root));
  dense_multiply(0, 0, proxy_rows(b), rank, rank, 1, s->proxies, f->root, 0, f->responses);
  dense_multiply(0, 0, c->row_count, rank, rank, 1, f->rows, f->root, 0, f->held);
  find_green(b, stage, f);
  return EXM_OK;
}

/** rows -= factor (rows p) p' */
static void reflect(size_t count, size_t rank, double factor, const double *p, double *rows)
{
  for (size_t i = 0; i < count; i++) {
    dense_axpy(rank, -factor * dense_dot(rank, rows + i * rank, p), p, rows + i * rank);
  }
}

/** Add weight x x' to one stage's Gamma; 0 where too little would be left to trust. p: scratch [rank + S G d]. */
static int update_factor(const blended *b, int stage, double weight, const double *x, blended_constraints *c, double *p)
{
  size_t const rank = b->bases[stage].rank, P = proxy_rows(b), block = b->group_count * b->dimension;
  blended_factor *f = &c->factors[stage];
  double *seen = p + rank;
  dense_times_transposed(rank, rank, 1, f->root, rank, x, p);
  double const length2 = dense_dot(rank, p, p), stiffened = 1 + weight * length2;
  if (!(stiffened > CANCELLED)) {
    return 0;
  }
  if (!(length2 > 0)) {
    return 1;
  }
  dense_times(P, rank, 1, f->responses, p, seen);
  for (size_t s = 0; s < b->exemplar_count; s++) {
    const double *own = seen + s * block;
    for (size_t i = 0; i < block; i++) {
      dense_axpy(block, -weight / stiffened * own[i], own, f->green + (s * block + i) * block);
    }
  }
  double const factor = (1 - 1 / sqrt(stiffened)) / length2;
  reflect(rank, rank, factor, p, f->root);
  reflect(P, rank, factor, p, f->responses);
  reflect(c->row_count, rank, factor, p, f->held);
  return 1;
}

/** beta_lc X'X over the first stage's raw atoms. */
static void find_net_gram(const blended *b, blended_constraints *c)
{
  const blended_basis *first = &b->bases[BLENDED_FIRST];
  size_t const n = first->atom_count;
  memset(c->net_gram, 0, n * n * sizeof(double));
  for (size_t r = 0; r < c->row_count; r++) {
    const double *x = c->joint + r * b->joint_count;
    for (size_t i = 0; i < n && c->weights[r] > 0; i++) {
      double const own = b->beta_lc * c->weights[r] * x[first->atoms[i]];
      for (size_t j = 0; j < n; j++) {
        c->net_gram[i * n + j] += own * x[first->atoms[j]];
      }
    }
  }
}

static exm_status make_factors(const blended *b, blended_constraints *c)
{
  for (int s = 0; s < BLENDED_STAGES; s++) {
    TRY(make_factor(b, s, c));
  }
  TRY(make_root(b, BLENDED_LAST, c, 0, c->free_root));
  find_net_gram(b, c);
  c->updates = 0;
  return EXM_OK;
}

/* --------------------------------------------------------------------------------------------------------- the rows */

/** A row's terms, its values on the joint dictionary, on exemplars and in the stages' bases. */
static exm_status fill_row(const blended *b, const constraint_row *row, double weight, size_t at,
                           blended_constraints *c)
{
  size_t const count = row->term_count;
  uint32_t *vertices = ARENA_NEW(&c->memory, uint32_t, count);
  double *weights = ARENA_NEW(&c->memory, double, count);
  if (!vertices || !weights) {
    return status_no_memory("the constraints");
  }
  memcpy(vertices, row->vertices, count * sizeof *vertices);
  memcpy(weights, row->weights, count * sizeof *weights);
  c->rows[at] = *row;
  c->rows[at].vertices = vertices;
  c->rows[at].weights = weights;
  c->weights[at] = weight;
  for (size_t t = 0; t < count; t++) {
    c->sums[at] += weights[t];
  }
  /* What cancels to rounding is a difference. */
  c->sums[at] = fabs(c->sums[at]) < 1e-9 ? 0 : c->sums[at];
  for (int s = 0; s < BLENDED_STAGES; s++) {
    const blended_basis *basis = &b->bases[s];
    double *x = c->factors[s].rows + at * basis->rank;
    for (size_t i = 0; i < basis->atom_count; i++) {
      dense_axpy(basis->rank, c->joint[at * b->joint_count + basis->atoms[i]], basis->basis + i * basis->rank, x);
    }
  }
  return EXM_OK;
}

/** Copies of old rows: [from, to) go to `at`. */
static exm_status keep_rows(const blended *b, const blended_constraints *old, size_t from, size_t to, size_t at,
                            blended_constraints *c)
{
  size_t const joint = b->joint_count, width = b->exemplar_count * b->dimension;
  if (from == to) {
    return EXM_OK;
  }
  memcpy(c->joint + at * joint, old->joint + from * joint, (to - from) * joint * sizeof(double));
  memcpy(c->on_exemplars + at * width, old->on_exemplars + from * width, (to - from) * width * sizeof(double));
  for (size_t r = from; r < to; r++) {
    TRY(fill_row(b, &old->rows[r], old->weights[r], at + r - from, c));
  }
  return EXM_OK;
}

static exm_status add_rows(const blended *b, const dictionary *d, size_t count, const constraint_row *rows,
                           const double *weights, size_t at, blended_constraints *c)
{
  size_t const width = b->exemplar_count * b->dimension;
  arena scratch = {0};
  double *atoms = ARENA_NEW(&scratch, double, 1 + width);
  constraints const list = {.row_count = count, .rows = (constraint_row *)rows};
  exm_status status = atoms ? EXM_OK : status_no_memory("the constraints");
  if (status == EXM_OK) {
    constraints_matrix(&list, d, atoms, c->joint + at * b->joint_count);
    constraints_on_exemplars(&list, d, c->on_exemplars + at * width);
  }
  for (size_t r = 0; r < count && status == EXM_OK; r++) {
    status = fill_row(b, &rows[r], weights ? weights[r] : 1, at + r, c);
  }
  arena_release(&scratch);
  return status;
}

/** W, U and G as they are, for as many rows. */
static void copy_factors(const blended *b, const blended_constraints *old, blended_constraints *c)
{
  size_t const block = b->group_count * b->dimension;
  for (int s = 0; s < BLENDED_STAGES; s++) {
    size_t const rank = b->bases[s].rank;
    const blended_factor *from = &old->factors[s];
    blended_factor *to = &c->factors[s];
    memcpy(to->root, from->root, rank * rank * sizeof(double));
    memcpy(to->responses, from->responses, proxy_rows(b) * rank * sizeof(double));
    memcpy(to->green, from->green, b->exemplar_count * block * block * sizeof(double));
    dense_multiply(0, 0, c->row_count, rank, rank, 1, to->rows, to->root, 0, to->held);
  }
  memcpy(c->free_root, old->free_root, b->bases[BLENDED_LAST].rank * b->bases[BLENDED_LAST].rank * sizeof(double));
  c->updates = old->updates;
}

/** One change of weight: the row's place (among the new rows or, where it goes, the old ones) and by how much. */
typedef struct change {
  const blended_constraints *from;
  size_t row;
  double weight;
} change;

/** Rows that say the same on all atoms, each with the first that does. */
static exm_status find_parallel(const blended *b, blended_constraints *c)
{
  size_t const count = c->row_count < BLENDED_COMPARED ? c->row_count : BLENDED_COMPARED, joint = b->joint_count;
  c->pairs = ARENA_NEW(&c->memory, parallel_rows, count);
  if (!c->pairs) {
    return status_no_memory("the constraints");
  }
  for (size_t i = 1; i < count; i++) {
    const double *x = c->joint + i * joint;
    double const own = dense_dot(joint, x, x);
    for (size_t j = 0; j < i; j++) {
      const double *y = c->joint + j * joint;
      double const other = dense_dot(joint, y, y), product = dense_dot(joint, x, y);
      if (own > 0 && other > 0 && product * product >= (1 - 1e-12) * own * other) {
        c->pairs[c->pair_count++] = (parallel_rows){.first = j, .second = i, .factor = product / other};
        break;
      }
    }
  }
  return EXM_OK;
}

/** Factors of c out of those of the old constraints, by updates where they are few, and put in place. */
static exm_status settle(blended *b, size_t change_count, const change *changes, blended_constraints *c)
{
  size_t most = 0;
  for (int s = 0; s < BLENDED_STAGES; s++) {
    most = b->bases[s].rank > most ? b->bases[s].rank : most;
  }
  arena scratch = {0};
  double *p = ARENA_NEW(&scratch, double, most + proxy_rows(b));
  exm_status status = p ? EXM_OK : status_no_memory("the constraints");
  int is_updated = status == EXM_OK && b->held.updates + change_count <= UPDATES_MOST;
  if (is_updated) {
    copy_factors(b, &b->held, c);
    c->updates += change_count;
  }
  for (size_t i = 0; i < change_count && is_updated; i++) {
    for (int s = 0; s < BLENDED_STAGES && is_updated; s++) {
      const double *x = changes[i].from->factors[s].rows + changes[i].row * b->bases[s].rank;
      is_updated = update_factor(b, s, b->beta_lc * changes[i].weight, x, c, p);
    }
  }
  if (is_updated) {
    find_net_gram(b, c);
  } else if (status == EXM_OK) {
    status = make_factors(b, c);
  }
  status = status == EXM_OK ? find_parallel(b, c) : status;
  arena_release(&scratch);
  if (status == EXM_OK) {
    arena_release(&b->held.memory);
    b->held = *c;
  } else {
    arena_release(&c->memory);
  }
  return status;
}

exm_status blended_constraints_begin(blended *b, const dictionary *d, const constraints *held)
{
  blended_constraints c = {.handle_row_count = held->row_count};
  exm_status status = allocate(&c, b, held->row_count);
  if (status == EXM_OK) {
    status = add_rows(b, d, held->row_count, held->rows, NULL, 0, &c);
  }
  if (status == EXM_OK) {
    status = make_factors(b, &c);
  }
  status = status == EXM_OK ? find_parallel(b, &c) : status;
  if (status < 0) {
    arena_release(&c.memory);
    return status;
  }
  b->held = c;
  return EXM_OK;
}

exm_status blended_constraints_add(blended *b, const dictionary *d, size_t count, const constraint_row *rows,
                                   const double *weights)
{
  size_t const before = b->held.row_count;
  blended_constraints c = {.handle_row_count = b->held.handle_row_count};
  arena scratch = {0};
  change *changes = ARENA_NEW(&scratch, change, count);
  exm_status status = changes ? allocate(&c, b, before + count) : status_no_memory("the constraints");
  if (status == EXM_OK) {
    status = keep_rows(b, &b->held, 0, before, 0, &c);
  }
  if (status == EXM_OK) {
    status = add_rows(b, d, count, rows, weights, before, &c);
  }
  for (size_t i = 0; i < count && status == EXM_OK; i++) {
    changes[i] = (change){.from = &c, .row = before + i, .weight = c.weights[before + i]};
  }
  if (status == EXM_OK) {
    status = settle(b, count, changes, &c);
  } else {
    arena_release(&c.memory);
  }
  arena_release(&scratch);
  return status;
}

exm_status blended_constraints_remove(blended *b, size_t first, size_t count)
{
  size_t const before = b->held.row_count, from = b->held.handle_row_count + first;
  blended_constraints c = {.handle_row_count = b->held.handle_row_count};
  arena scratch = {0};
  change *changes = ARENA_NEW(&scratch, change, count);
  exm_status status = changes ? allocate(&c, b, before - count) : status_no_memory("the constraints");
  if (status == EXM_OK) {
    status = keep_rows(b, &b->held, 0, from, 0, &c);
  }
  if (status == EXM_OK) {
    status = keep_rows(b, &b->held, from + count, before, from, &c);
  }
  for (size_t i = 0; i < count && status == EXM_OK; i++) {
    changes[i] = (change){.from = &b->held, .row = from + i, .weight = -b->held.weights[from + i]};
  }
  if (status == EXM_OK) {
    status = settle(b, count, changes, &c);
  } else {
    arena_release(&c.memory);
  }
  arena_release(&scratch);
  return status;
}

exm_status blended_constraints_weigh(blended *b, const double *weights)
{
  size_t const count = b->held.row_count;
  blended_constraints c = {.handle_row_count = b->held.handle_row_count};
  arena scratch = {0};
  size_t change_count = 0;
  change *changes = ARENA_NEW(&scratch, change, count);
  exm_status status = changes ? allocate(&c, b, count) : status_no_memory("the constraints");
  if (status == EXM_OK) {
    status = keep_rows(b, &b->held, 0, count, 0, &c);
  }
  for (size_t i = 0; i < count && status == EXM_OK; i++) {
    if (weights[i] != c.weights[i]) {
      changes[change_count++] = (change){.from = &c, .row = i, .weight = weights[i] - c.weights[i]};
      c.weights[i] = weights[i];
    }
  }
  if (status == EXM_OK) {
    status = settle(b, change_count, changes, &c);
  } else {
    arena_release(&c.memory);
  }
  arena_release(&scratch);
  return status;
}

exm_status blended_set_energies(blended *b, double beta_lc, double beta_sm)
{
  size_t const count = b->held.row_count;
  blended changed = *b;
  blended_constraints c = {.handle_row_count = b->held.handle_row_count};
  changed.beta_lc = beta_lc;
  changed.beta_sm = beta_sm;
  exm_status status = allocate(&c, b, count);
  if (status == EXM_OK) {
    status = keep_rows(b, &b->held, 0, count, 0, &c);
  }
  if (status == EXM_OK) {
    status = make_factors(&changed, &c);
  }
  status = status == EXM_OK ? find_parallel(b, &c) : status;
  if (status < 0) {
    arena_release(&c.memory);
    return status;
  }
  arena_release(&b->held.memory);
  b->held = c;
  b->beta_lc = beta_lc;
  b->beta_sm = beta_sm;
  return EXM_OK;
}
