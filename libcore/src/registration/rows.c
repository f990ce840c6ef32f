/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "linalg/dense.h"
#include "registration/registration.h"

/* Rows that are multiplied at a time: they and the basis stay in the cache. */
enum { BATCH = 128 };

/** Add weight times the joint dictionary's atoms at a vertex. values: scratch, one function's atoms. */
static void add_atoms(const dictionary *d, uint32_t vertex, double weight, double *values, double *row)
{
  size_t const per = 1 + d->exemplar_count * d->dimension;
  for (size_t i = d->weight_offsets[vertex]; i < d->weight_offsets[vertex + 1]; i++) {
    size_t const h = d->weight_handles[i];
    dictionary_atoms(d, h, vertex, weight * d->weight_values[i], values);
    dense_axpy(per, 1, values, row + d->atom_offsets[h]);
  }
}

exm_status registration_rows(const registration *r, size_t count, size_t each, const uint32_t *vertices,
                             const double *weights, double *out)
{
  const dictionary *d = &r->deformer->atoms;
  const blended_basis *basis = registration_basis(r);
  size_t const n = basis->atom_count, rank = basis->rank;
  arena scratch = {0};
  double *row = ARENA_NEW(&scratch, double, d->atom_count);
  double *values = ARENA_NEW(&scratch, double, 1 + d->exemplar_count * d->dimension);
  double *selected = ARENA_NEW(&scratch, double, BATCH *n);
  if (!row || !values || !selected) {
    arena_release(&scratch);
    return status_no_memory("rows of the dictionary");
  }
  for (size_t first = 0; first < count; first += BATCH) {
    size_t const rows = first + BATCH < count ? BATCH : count - first;
    for (size_t i = 0; i < rows; i++) {
      memset(row, 0, d->atom_count * sizeof *row);
      for (size_t t = (first + i) * each; t < (first + i + 1) * each; t++) {
        add_atoms(d, vertices[t], weights ? weights[t] : 1, values, row);
      }
      for (size_t k = 0; k < n; k++) {
        selected[i * n + k] = row[basis->atoms[k]];
      }
    }
    dense_multiply(0, 0, rows, rank, n, 1, selected, basis->basis, 0, out + first * rank);
  }
  arena_release(&scratch);
  return EXM_OK;
}
