/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/system.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

exm_status system_pattern(arena *owner, const rings *around, sparse *out)
{
  size_t const V = around->vertex_count, entries = V + around->offsets[V] / 2;
  sparse a = {.size = V};
  if (V >= INT32_MAX || entries >= INT32_MAX) {
    return status_no_memory("a sparse matrix with more entries than 32 bits can count");
  }
  a.starts = ARENA_NEW(owner, int32_t, V + 1);
  a.rows = ARENA_NEW(owner, int32_t, entries);
  a.values = ARENA_NEW(owner, double, entries);
  if (!a.starts || !a.rows || !a.values) {
    return status_no_memory("a sparse matrix");
  }
  int32_t next = 0;
  for (size_t i = 0; i < V; i++) {
    a.rows[next++] = (int32_t)i;
    for (uint32_t e = around->offsets[i]; e < around->offsets[i + 1]; e++) {
      if (around->neighbors[e] > i) {
        a.rows[next++] = (int32_t)around->neighbors[e];
      }
    }
    a.starts[i + 1] = next;
  }
  *out = a;
  return EXM_OK;
}

/* Both ends of an edge count its spokes: eq. 5 with d_ij = (d_i + d_j) / 2. */
static double edge_weight(const spokes *s, const rigidity_system *system, size_t i, uint32_t e)
{
  return s->weights[e] * (system->multiplicity[i] + system->multiplicity[s->around.neighbors[e]]);
}

static void fill_matrix(const spokes *s, const held *h, const rigidity_system *system, sparse *a)
{
  int32_t next = 0;
  for (size_t i = 0; i < a->size; i++) {
    double *diagonal = &a->values[next++];
    *diagonal = h->is_out[i];
    for (uint32_t e = s->around.offsets[i]; e < s->around.offsets[i + 1]; e++) {
      uint32_t const j = s->around.neighbors[e];
      double const weight = h->is_out[i] ? 0 : edge_weight(s, system, i, e);
      *diagonal += weight;
      if (j > i) {
        a->values[next++] = h->is_out[j] ? 0 : -weight;
      }
    }
  }
}

static exm_status find_couplings(const spokes *s, const held *h, rigidity_system *system)
{
  size_t most = 0;
  for (size_t f = 0; f < h->fixed_count; f++) {
    uint32_t const v = h->fixed[f].vertex;
    most += s->around.offsets[v + 1] - s->around.offsets[v];
  }
  system->couplings = ARENA_NEW(&system->memory, system_coupling, most);
  if (!system->couplings) {
    return status_no_memory("the handles");
  }
  for (size_t f = 0; f < h->fixed_count; f++) {
    uint32_t const v = h->fixed[f].vertex;
    for (uint32_t e = s->around.offsets[v]; e < s->around.offsets[v + 1]; e++) {
      uint32_t const j = s->around.neighbors[e];
      if (!h->is_out[j]) {
        system->couplings[system->coupling_count++] =
            (system_coupling){.vertex = j, .fixed = (uint32_t)f, .weight = edge_weight(s, system, v, e)};
      }
    }
  }
  return EXM_OK;
}

static exm_status find_multiplicity(const held *h, const double *counts, size_t V, rigidity_system *system)
{
  size_t const entries = h->disc_count ? h->disc_offsets[h->disc_count] : 0;
  system->multiplicity = ARENA_NEW(&system->memory, double, V);
  system->disc_weights = ARENA_NEW(&system->memory, double, entries);
  system->disc_rotations[0] = ARENA_NEW(&system->memory, row12, h->disc_count);
  system->disc_rotations[1] = ARENA_NEW(&system->memory, row12, h->disc_count);
  if (!system->multiplicity || !system->disc_weights || !system->disc_rotations[0] || !system->disc_rotations[1]) {
    return status_no_memory("the handles");
  }
  memcpy(system->multiplicity, counts, V * sizeof *counts);
  for (size_t i = 0; i < entries; i++) {
    uint32_t const v = h->disc_vertices[i];
    system->disc_weights[i] = counts[v] * h->disc_weights[i];
    system->multiplicity[v] += system->disc_weights[i];
  }
  return EXM_OK;
}

/* ----------------------------------------------------------------------------------------------------------- patches
 *
 * With M the means of patches, E which patches are on which grounded part, z = A^-1 b with grounds at the origin, a
 * step is p = z - A^-1 M' lambda + y on grounded parts, where
 *
 *   S lambda - E y = M z - c,   E' lambda = 0,   S = M A^-1 M'.
 *
 * The second says that the forces on a part that nothing else holds add up to nothing. */

static void patch_means(const held *h, size_t width, const double *values, double *means)
{
  for (size_t q = 0; q < h->patch_count; q++) {
    const held_patch *patch = &h->patches[q];
    double *mean = means + q * width;
    memset(mean, 0, width * sizeof *mean);
    for (uint32_t i = patch->begin; i < patch->end; i++) {
      dense_axpy(width, 1.0 / (patch->end - patch->begin), values + h->patch_vertices[i] * width, mean);
    }
  }
}

static exm_status find_responses(const held *h, size_t V, rigidity_system *system)
{
  size_t const Q = h->patch_count;
  system->responses = ARENA_NEW(&system->memory, double, V *Q);
  if (!system->responses || (Q > 0 && V > SIZE_MAX / sizeof(double) / Q)) {
    return status_no_memory("the handles");
  }
  for (size_t q = 0; q < Q; q++) {
    const held_patch *patch = &h->patches[q];
    for (uint32_t i = patch->begin; i < patch->end; i++) {
      uint32_t const v = h->patch_vertices[i];
      system->responses[v * Q + q] = h->is_out[v] ? 0 : 1.0 / (patch->end - patch->begin);
    }
  }
  return cholesky_solve_rows(system->factor, Q, system->responses);
}

/* The solution for each unit miss, by Cholesky factors of S and of E' S^-1 E. Row q of `inverse` is S^-1 e_q. */
static int solve_patches(const held *h, double *S, double *inverse, double *T, double *places, double *solution)
{
  size_t const Q = h->patch_count, G = h->ground_count;
  if (!dense_cholesky(Q, S)) {
    return 0;
  }
  for (size_t q = 0; q < Q; q++) {
    inverse[q * Q + q] = 1;
    dense_cholesky_forward(Q, S, inverse + q * Q);
    dense_cholesky_backward(Q, S, inverse + q * Q);
  }
  for (size_t q = 0; q < Q; q++) {
    for (size_t p = 0; p < Q && h->patches[q].ground != HELD_NONE; p++) {
      if (h->patches[p].ground != HELD_NONE) {
        T[h->patches[q].ground * G + h->patches[p].ground] += inverse[q * Q + p];
      }
    }
  }
  if (!dense_cholesky(G, T)) {
    return 0;
  }
  for (size_t q = 0; q < Q; q++) {
    memset(places, 0, G * sizeof *places);
    for (size_t p = 0; p < Q; p++) {
      if (h->patches[p].ground != HELD_NONE) {
        places[h->patches[p].ground] -= inverse[q * Q + p];
      }
    }
    dense_cholesky_forward(G, T, places);
    dense_cholesky_backward(G, T, places);
    for (size_t p = 0; p < Q; p++) {
      solution[p * Q + q] = inverse[q * Q + p];
      for (size_t o = 0; o < Q; o++) {
        solution[p * Q + q] +=
            h->patches[o].ground != HELD_NONE ? inverse[o * Q + p] * places[h->patches[o].ground] : 0;
      }
    }
    for (size_t g = 0; g < G; g++) {
      solution[(Q + g) * Q + q] = places[g];
    }
  }
  return 1;
}

static exm_status prepare_patches(const held *h, size_t V, rigidity_system *system)
{
  size_t const Q = h->patch_count, G = h->ground_count;
  arena scratch = {0};
  double *S = ARENA_NEW(&scratch, double, Q *Q), *inverse = ARENA_NEW(&scratch, double, Q *Q);
  double *T = ARENA_NEW(&scratch, double, G *G), *places = ARENA_NEW(&scratch, double, G);
  system->solution = ARENA_NEW(&system->memory, double, (Q + G) * Q);
  system->misses = ARENA_NEW(&system->memory, double, 3 * Q);
  system->answers = ARENA_NEW(&system->memory, double, 3 * (Q + G));
  exm_status status = S && inverse && T && places && system->solution && system->misses && system->answers
                          ? find_responses(h, V, system)
                          : status_no_memory("the handles");
  if (status == EXM_OK) {
    patch_means(h, Q, system->responses, S);
    if (!solve_patches(h, S, inverse, T, places, system->solution)) {
      status = status_set(EXM_ERROR_NUMERIC, "the handles' constraints cannot be told from each other");
    }
  }
  arena_release(&scratch);
  return status;
}

exm_status system_create(const spokes *s, const held *h, sparse *pattern, const double *counts,
                         const rigidity_system *like, rigidity_system *out)
{
  size_t const V = s->around.vertex_count;
  *out = (rigidity_system){.vertex_count = V};
  TRY(find_multiplicity(h, counts, V, out));
  fill_matrix(s, h, out, pattern);
  TRY(like ? cholesky_create_like(like->factor, pattern, &out->factor) : cholesky_create(pattern, &out->factor));
  TRY(find_couplings(s, h, out));
  return h->patch_count ? prepare_patches(h, V, out) : EXM_OK;
}

void system_destroy(rigidity_system *system)
{
  cholesky_destroy(system->factor);
  arena_release(&system->memory);
  *system = (rigidity_system){0};
}

static void correct_patches(rigidity_system *system, const held *h, const uint32_t *components, const double *targets,
                            double *positions)
{
  size_t const Q = h->patch_count, V = system->vertex_count;
  patch_means(h, 3, positions, system->misses);
  for (size_t q = 0; q < Q; q++) {
    double wanted[3];
    held_place(h, h->patches[q].handle, h->patches[q].arm, targets, wanted);
    for (size_t k = 0; k < 3; k++) {
      system->misses[3 * q + k] -= wanted[k];
    }
  }
  dense_times(Q + h->ground_count, Q, 3, system->solution, system->misses, system->answers);
  const double *places = system->answers + 3 * Q;
  for (size_t v = 0; v < V; v++) {
    double *p = positions + 3 * v;
    for (size_t q = 0; q < Q; q++) {
      dense_axpy(3, -system->responses[v * Q + q], system->answers + 3 * q, p);
    }
    uint32_t const ground = h->component_grounds[components[v]];
    if (ground != HELD_NONE) {
      dense_axpy(3, 1, places + 3 * (size_t)ground, p);
    }
  }
}

exm_status system_solve(rigidity_system *system, const held *h, const uint32_t *components, const double *targets,
                        double *positions)
{
  double place[3];
  for (size_t g = 0; g < h->ground_count; g++) {
    memset(positions + 3 * (size_t)h->grounds[g], 0, 3 * sizeof *positions);
  }
  for (size_t f = 0; f < h->fixed_count; f++) {
    held_place(h, h->fixed[f].handle, h->fixed[f].arm, targets, place);
    memcpy(positions + 3 * (size_t)h->fixed[f].vertex, place, sizeof place);
  }
  for (size_t c = 0; c < system->coupling_count; c++) {
    const system_coupling *coupling = &system->couplings[c];
    const double *fixed = positions + 3 * (size_t)h->fixed[coupling->fixed].vertex;
    dense_axpy(3, coupling->weight, fixed, positions + 3 * (size_t)coupling->vertex);
  }
  TRY(cholesky_solve_rows(system->factor, 3, positions));
  if (h->patch_count > 0) {
    correct_patches(system, h, components, targets, positions);
  }
  return EXM_OK;
}
