/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The atoms of each stage, reduced by clustering those that are alike [Blended, 4.4]. */
#include <math.h>
#include <string.h>

#include "deform/blended/bind.h"
#include "linalg/dense.h"
#include "numeric/medoids.h"

/* Beside the largest diagonal entry, so that collinear atoms do not stop a factorisation. */
static double const RIDGE = 1e-12;

/** All atoms of a stage; those of the constant come first, and they are the exemplars themselves. */
static exm_status list_atoms(arena *owner, const dictionary *d, const blended_functions *functions, int stage,
                             size_t exemplar_count, size_t **atoms, size_t *count)
{
  size_t const per = 1 + d->exemplar_count * d->dimension, kept = 1 + exemplar_count * d->dimension;
  size_t const F = stage == BLENDED_FIRST ? functions->first_count : functions->last_count;
  *atoms = ARENA_NEW(owner, size_t, F * kept);
  if (!*atoms) {
    return status_no_memory("the dictionary");
  }
  *count = 0;
  for (size_t i = 0; i < F; i++) {
    size_t const f = stage == BLENDED_FIRST ? functions->first[i] : i;
    for (size_t k = 0; k < kept; k++) {
      (*atoms)[(*count)++] = f * per + k;
    }
  }
  return EXM_OK;
}

/** 1 - |cos| between atoms, in the mesh's masses. */
static void find_distances(const edge_energy *energy, size_t count, const size_t *atoms, double *distances)
{
  size_t const all = energy->atom_count;
  for (size_t i = 0; i < count; i++) {
    for (size_t j = 0; j < count; j++) {
      double const own = energy->masses[atoms[i] * (all + 1)], other = energy->masses[atoms[j] * (all + 1)];
      double const product = energy->masses[atoms[i] * all + atoms[j]];
      double const cosine = own > 0 && other > 0 ? fabs(product) / sqrt(own * other) : 0;
      distances[i * count + j] = i == j ? 0 : fmax(1 - cosine, 0);
    }
  }
}

/** Distance of each dropped atom from the span of those kept as a share of its own size; the largest. */
static exm_status measure(const edge_energy *energy, size_t count, const size_t *atoms, size_t kept,
                          const size_t *places, double *worst)
{
  size_t const all = energy->atom_count;
  arena scratch = {0};
  double *gram = ARENA_NEW(&scratch, double, kept *kept);
  double *column = ARENA_NEW(&scratch, double, kept);
  double *scales = ARENA_NEW(&scratch, double, kept);
  exm_status const status = gram && column && scales ? EXM_OK : status_no_memory("the reduction of atoms");
  if (status < 0) {
    goto done;
  }
  for (size_t i = 0; i < kept; i++) {
    double const own = energy->masses[atoms[places[i]] * (all + 1)];
    scales[i] = own > 0 ? 1 / sqrt(own) : 0;
  }
  for (size_t i = 0; i < kept; i++) {
    for (size_t j = 0; j < kept; j++) {
      gram[i * kept + j] = scales[i] * scales[j] * energy->masses[atoms[places[i]] * all + atoms[places[j]]];
    }
    gram[i * kept + i] += scales[i] > 0 ? RIDGE : 1;
  }
  *worst = 0;
  if (!dense_cholesky(kept, gram)) {
    goto done;
  }
  for (size_t a = 0; a < count; a++) {
    double const own = energy->masses[atoms[a] * (all + 1)];
    for (size_t i = 0; i < kept; i++) {
      column[i] = scales[i] * energy->masses[atoms[a] * all + atoms[places[i]]];
    }
    dense_cholesky_forward(kept, gram, column);
    double const left = own - dense_dot(kept, column, column);
    *worst = own > 0 ? fmax(*worst, sqrt(fmax(left / own, 0))) : *worst;
  }
done:
  arena_release(&scratch);
  return status;
}

exm_status blended_choose_atoms(arena *owner, const dictionary *d, const edge_energy *energy,
                                const blended_functions *functions, int stage,
                                const exm_blended_bind_settings *settings, exm_blended_info *info, size_t **atoms,
                                size_t *count)
{
  size_t const used = settings->dictionary_exemplar_count ? settings->dictionary_exemplar_count : d->exemplar_count;
  TRY(list_atoms(owner, d, functions, stage, used, atoms, count));
  size_t const fixed = 1 + used * d->dimension, asked = (size_t)ceil(settings->atoms_kept * (double)*count);
  size_t const kept = asked > fixed ? asked : fixed;
  info->whole_atom_count = *count;
  info->reduction_error = 0;
  if (kept >= *count) {
    return EXM_OK;
  }
  arena scratch = {0};
  double *distances = ARENA_NEW(&scratch, double, *count **count);
  size_t *places = ARENA_NEW(&scratch, size_t, kept);
  exm_status status = distances && places ? EXM_OK : status_no_memory("the reduction of atoms");
  if (status == EXM_OK) {
    find_distances(energy, *count, *atoms, distances);
    status = medoids_find(*count, distances, fixed, kept, places);
  }
  if (status == EXM_OK) {
    status = measure(energy, *count, *atoms, kept, places, &info->reduction_error);
  }
  for (size_t i = 0; i < kept && status == EXM_OK; i++) {
    (*atoms)[i] = (*atoms)[places[i]];
  }
  *count = kept;
  arena_release(&scratch);
  return status;
}
