/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Unknowns of the cone program and what they cost one another: Q of eq. 20 with the pose eliminated.
 *
 * A column is Z_gs - X_g: what taking more of exemplar s changes, X being the blend that the search starts at. Entries
 * of Q are then of the size of these changes and not of the mesh, and its rounding with them. */
#include <string.h>

#include "base/simd.h"
#include "deform/amrap/amrap.h"
#include "linalg/dense.h"

/* With carriers, P P' is kept up to this many vertices (64 MiB); beyond, each column is a sparse solve. */
enum { GREEN_MAXIMUM = 2900, GREEN_BATCH = 64 };

static size_t rows_of(const reduced_mesh *r, size_t g)
{
  return r->shape_offsets[g + 1] - r->shape_offsets[g];
}

static size_t carriers_of(const reduced_mesh *r, size_t g)
{
  return r->carriers->offsets[g + 1] - r->carriers->offsets[g];
}

/* ----------------------------------------------------------------------------------------------------------- set-up */

/** Places of the vertices, by the last group that they carry for. */
static exm_status sort_carriers(arena *owner, arena *scratch, amrap *a, size_t *place)
{
  const reduced_mesh *r = &a->reduced;
  size_t const G = r->group_count, V = r->atom_count;
  amrap_columns *m = &a->columns;
  size_t *last = ARENA_NEW(scratch, size_t, V), *next = ARENA_NEW(scratch, size_t, G + 1);
  m->green_starts = ARENA_NEW(owner, size_t, G + 1);
  m->green_places = ARENA_NEW(owner, uint32_t, r->carriers->offsets[G]);
  if (!last || !next || !m->green_starts || !m->green_places) {
    return status_no_memory("the deformer");
  }
  for (size_t g = 0; g < G; g++) {
    for (size_t k = r->carriers->offsets[g]; k < r->carriers->offsets[g + 1]; k++) {
      last[r->carriers->indices[k]] = g;
    }
  }
  for (size_t v = 0; v < V; v++) {
    m->green_starts[last[v] + 1]++;
  }
  for (size_t g = 0; g < G; g++) {
    m->green_starts[g + 1] += m->green_starts[g];
    next[g] = m->green_starts[g];
  }
  for (size_t v = 0; v < V; v++) {
    place[v] = next[last[v]]++;
  }
  for (size_t k = 0; k < r->carriers->offsets[G]; k++) {
    m->green_places[k] = (uint32_t)place[r->carriers->indices[k]];
  }
  return EXM_OK;
}

/** P P', a batch of columns at a time. */
static exm_status fill_green(arena *owner, arena *scratch, const size_t *place, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const V = r->atom_count;
  double *forces = ARENA_NEW(scratch, double, V *GREEN_BATCH);
  double *u = ARENA_NEW(scratch, double, r->rank *GREEN_BATCH);
  a->columns.green = ARENA_NEW(owner, double, V *V);
  if (!forces || !u || !a->columns.green) {
    return status_no_memory("the deformer");
  }
  for (size_t first = 0; first < V; first += GREEN_BATCH) {
    size_t const some = V - first < GREEN_BATCH ? V - first : GREEN_BATCH;
    memset(forces, 0, V * some * sizeof(double));
    for (size_t i = 0; i < some; i++) {
      forces[(first + i) * some + i] = 1;
    }
    vertices_to_basis(&r->carriers->space, some, forces, u);
    vertices_from_basis(&r->carriers->space, some, u, forces);
    for (size_t v = 0; v < V; v++) {
      for (size_t i = 0; i < some; i++) {
        a->columns.green[place[first + i] * V + place[v]] = forces[v * some + i];
      }
    }
  }
  return EXM_OK;
}

static exm_status prepare_carriers(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  arena scratch = {0};
  size_t *place = ARENA_NEW(&scratch, size_t, r->atom_count);
  exm_status status = place ? sort_carriers(owner, &scratch, a, place) : status_no_memory("the deformer");
  if (status == EXM_OK && r->atom_count <= GREEN_MAXIMUM) {
    status = fill_green(owner, &scratch, place, a);
  } else if (status == EXM_OK) {
    size_t const width = a->columns_per_group * r->dimension;
    a->columns.forces = ARENA_NEW(owner, double, r->atom_count *width);
    a->columns.forces_u = ARENA_NEW(owner, double, r->rank *width);
    status = a->columns.forces && a->columns.forces_u ? EXM_OK : status_no_memory("the deformer");
  }
  arena_release(&scratch);
  return status;
}

exm_status amrap_columns_create(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, G = r->group_count, S = r->exemplar_count;
  amrap_columns *m = &a->columns;
  *m = (amrap_columns){.limit = G * a->columns_per_group};
  for (size_t g = 0; g < G; g++) {
    size_t const rows = rows_of(r, g) * d, carriers = r->carriers ? carriers_of(r, g) * d : 0;
    m->row_stride = rows > m->row_stride ? rows : m->row_stride;
    m->carrier_stride = carriers > m->carrier_stride ? carriers : m->carrier_stride;
  }
  size_t const range = r->carriers ? r->atom_count : r->shape_rows;
  m->group = ARENA_NEW(owner, size_t, m->limit);
  m->shape = ARENA_NEW(owner, size_t, m->limit);
  m->slot_of = ARENA_NEW(owner, size_t, G * S);
  m->vacant = ARENA_NEW(owner, size_t, m->limit);
  m->order = ARENA_NEW(owner, size_t, m->limit);
  m->turned = ARENA_NEW(owner, double, m->limit * m->row_stride);
  m->carried = ARENA_NEW(owner, double, m->limit * m->carrier_stride);
  m->slope = ARENA_NEW(owner, double, m->limit);
  m->Q = ARENA_NEW(owner, double, m->limit * m->limit);
  m->response = ARENA_NEW(owner, double, a->columns_per_group *d *range);
  m->anchor = ARENA_NEW(owner, double, r->shape_rows *d);
  m->misfit = ARENA_NEW(owner, double, r->shape_rows *d);
  m->felt = ARENA_NEW(owner, double, m->row_stride > m->carrier_stride ? m->row_stride : m->carrier_stride);
  m->is_new = ARENA_NEW(owner, unsigned char, m->limit);
  if (!m->group || !m->shape || !m->slot_of || !m->vacant || !m->order || !m->turned || !m->carried || !m->slope ||
      !m->Q || !m->response || !m->anchor || !m->misfit || !m->felt || !m->is_new) {
    return status_no_memory("the deformer");
  }
  return r->carriers ? prepare_carriers(owner, a) : EXM_OK;
}

/* -------------------------------------------------------------------------------------------------------- responses */

/** out += sum of factors times rows, four rows at a time. */
SIMD_CLONES static void add_rows(size_t width, size_t count, const double *const *rows, const double *factors,
                                 size_t factor_stride, double *out)
{
  size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    const double *r0 = rows[k], *r1 = rows[k + 1], *r2 = rows[k + 2], *r3 = rows[k + 3];
    double const f0 = factors[k * factor_stride], f1 = factors[(k + 1) * factor_stride],
                 f2 = factors[(k + 2) * factor_stride], f3 = factors[(k + 3) * factor_stride];
    for (size_t i = 0; i < width; i++) {
      out[i] += f0 * r0[i] + f1 * r1[i] + (f2 * r2[i] + f3 * r3[i]);
    }
  }
  for (; k < count; k++) {
    for (size_t i = 0; i < width; i++) {
      out[i] += factors[k * factor_stride] * rows[k][i];
    }
  }
}

/** G (Z - X) of new slots of one group by rows of G or P P', on the places from `start` on. */
static void respond_by_rows(amrap *a, size_t g, size_t count, const size_t *slots, size_t start)
{
  enum { MOST = 16 };
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  size_t const d = r->dimension, range = r->carriers ? r->atom_count : r->shape_rows;
  size_t const inner = r->carriers ? carriers_of(r, g) : rows_of(r, g);
  const double *matrix = r->carriers ? m->green : r->G, *rows[MOST];
  for (size_t i = 0; i < count; i++) {
    const double *factors =
        r->carriers ? m->carried + slots[i] * m->carrier_stride : m->turned + slots[i] * m->row_stride;
    for (size_t k = 0; k < d; k++) {
      double *out = m->response + (i * d + k) * range;
      memset(out + start, 0, (range - start) * sizeof(double));
      for (size_t first = 0; first < inner; first += MOST) {
        size_t const some = inner - first < MOST ? inner - first : MOST;
        for (size_t j = 0; j < some; j++) {
          size_t const row =
              r->carriers ? m->green_places[r->carriers->offsets[g] + first + j] : r->shape_offsets[g] + first + j;
          rows[j] = matrix + row * range + start;
        }
        add_rows(range - start, some, rows, factors + first * d + k, d, out + start);
      }
    }
  }
}

/** The same by sparse solves. */
static void respond_by_solves(amrap *a, size_t g, size_t count, const size_t *slots)
{
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  size_t const d = r->dimension, V = r->atom_count, width = count * d;
  memset(m->forces, 0, V * width * sizeof(double));
  for (size_t i = 0; i < count; i++) {
    for (size_t k = 0; k < carriers_of(r, g); k++) {
      memcpy(m->forces + r->carriers->indices[r->carriers->offsets[g] + k] * width + i * d,
             m->carried + slots[i] * m->carrier_stride + k * d, d * sizeof(double));
    }
  }
  vertices_to_basis(&r->carriers->space, width, m->forces, m->forces_u);
  vertices_from_basis(&r->carriers->space, width, m->forces_u, m->forces);
  for (size_t v = 0; v < V; v++) {
    for (size_t i = 0; i < width; i++) {
      m->response[i * V + v] = m->forces[v * width + i];
    }
  }
}

/** The response where group g's columns feel it, laid out as they are. Returns its length. */
static size_t response_at(const amrap *a, size_t g, const double *response, double *out)
{
  const reduced_mesh *r = &a->reduced;
  const amrap_columns *m = &a->columns;
  size_t const d = r->dimension, range = r->carriers ? r->atom_count : r->shape_rows;
  size_t const count = r->carriers ? carriers_of(r, g) : rows_of(r, g);
  const uint32_t *places = NULL;
  if (r->carriers) {
    places = (m->green ? m->green_places : r->carriers->indices) + r->carriers->offsets[g];
  }
  for (size_t k = 0; k < count; k++) {
    size_t const place = places ? places[k] : r->shape_offsets[g] + k;
    for (size_t i = 0; i < d; i++) {
      out[k * d + i] = response[i * range + place];
    }
  }
  return count * d;
}

/* ------------------------------------------------------------------------------------------------------------ slots */

void amrap_columns_anchor(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  memset(m->slot_of, 0xff, r->group_count * r->exemplar_count * sizeof *m->slot_of);
  m->vacant_count = m->limit;
  for (size_t i = 0; i < m->limit; i++) {
    m->vacant[i] = m->limit - 1 - i;
  }
  memcpy(m->anchor, a->X, r->shape_rows * r->dimension * sizeof(double));
  for (size_t i = 0; i < r->shape_rows * r->dimension; i++) {
    m->misfit[i] = a->y[i] - a->X[i];
  }
}

static void fill_slot(amrap *a, size_t slot, size_t g, size_t s)
{
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  size_t const d = r->dimension, first = r->shape_offsets[g], rows = rows_of(r, g);
  double *turned = m->turned + slot * m->row_stride;
  m->group[slot] = g;
  m->shape[slot] = s;
  for (size_t row = 0; row < rows; row++) {
    amrap_turn(a, first + row, g, s, turned + row * d);
  }
  for (size_t i = 0; i < rows * d; i++) {
    turned[i] -= m->anchor[first * d + i];
  }
  m->slope[slot] = dense_dot(rows * d, turned, m->misfit + first * d);
  if (r->carriers) {
    reduced_carry(r, g, d, turned, m->carried + slot * m->carrier_stride);
  }
}

/** Unknowns that are wanted no more give up their slots; new ones are filled. Returns how many are new. */
static size_t take_slots(amrap *a, const unsigned char *wanted, size_t *count)
{
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  size_t const S = r->exemplar_count;
  size_t added = 0;
  for (size_t i = 0; wanted && i < r->group_count * S; i++) {
    if (!wanted[i] && m->slot_of[i] != SIZE_MAX) {
      m->vacant[m->vacant_count++] = m->slot_of[i];
      m->slot_of[i] = SIZE_MAX;
    }
  }
  *count = 0;
  for (size_t g = 0; g < r->group_count; g++) {
    a->block_offsets[g] = *count;
    for (size_t s = 0; s < S; s++) {
      size_t *slot = &m->slot_of[g * S + s];
      if (wanted && !wanted[g * S + s]) {
        continue;
      }
      int const is_new = *slot == SIZE_MAX;
      if (is_new) {
        *slot = m->vacant[--m->vacant_count];
        fill_slot(a, *slot, g, s);
        added++;
      }
      m->is_new[*count] = (unsigned char)is_new;
      m->order[(*count)++] = *slot;
    }
  }
  a->block_offsets[r->group_count] = *count;
  return added;
}

/** Entries of Q of one new unknown with all later ones and with earlier ones that are not new. */
static void fill_entries(amrap *a, size_t i, size_t count, const double *response, double mu)
{
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  size_t const slot = m->order[i], g = m->group[slot], stride = r->carriers ? m->carrier_stride : m->row_stride;
  const double *columns = r->carriers ? m->carried : m->turned;
  size_t at = SIZE_MAX, length = 0;
  for (size_t j = 0; j < count; j++) {
    if (j < i && m->is_new[j]) {
      continue;
    }
    size_t const other = m->order[j];
    if (m->group[other] != at) {
      at = m->group[other];
      length = response_at(a, at, response, m->felt);
    }
    double value = -dense_dot(length, m->felt, columns + other * stride) / (1 + mu);
    if (at == g) {
      value +=
          dense_dot(rows_of(r, g) * r->dimension, m->turned + slot * m->row_stride, m->turned + other * m->row_stride);
    }
    m->Q[slot * m->limit + other] = m->Q[other * m->limit + slot] = value;
  }
}

size_t amrap_columns_choose(amrap *a, const unsigned char *wanted, double mu)
{
  const reduced_mesh *r = &a->reduced;
  amrap_columns *m = &a->columns;
  size_t const d = r->dimension, range = r->carriers ? r->atom_count : r->shape_rows;
  size_t count = 0;
  size_t const added = take_slots(a, wanted, &count);
  for (size_t g = 0; added > 0 && g < r->group_count; g++) {
    size_t const first = a->block_offsets[g], last = a->block_offsets[g + 1];
    size_t some = 0;
    for (size_t i = first; i < last; i++) {
      if (m->is_new[i]) {
        a->columns.vacant[m->vacant_count + some++] = m->order[i]; /* room behind the stack's top */
      }
    }
    if (some == 0) {
      continue;
    }
    if (r->carriers && !m->green) {
      respond_by_solves(a, g, some, m->vacant + m->vacant_count);
    } else {
      /* Where all are new, earlier groups have seen to their share. */
      size_t const start = added < count ? 0 : r->carriers ? m->green_starts[g] : r->shape_offsets[g];
      respond_by_rows(a, g, some, m->vacant + m->vacant_count, start);
    }
    for (size_t i = first, at = 0; i < last; i++) {
      if (m->is_new[i]) {
        fill_entries(a, i, count, m->response + d * range * at++, mu);
      }
    }
  }
  return count;
}
