/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "deform/blended/bind.h"
#include "linalg/dense.h"
#include "linalg/sparse.h"
#include "numeric/clustering.h"
#include "weights/eigenfunctions.h"

/* Rotation clusters of a single exemplar, which shows no motion. */
enum { STILL_CLUSTERS = 20 };

/** Laplacian energies w_i' L M^-1 L w_j of functions [count][V], times the area: for eigenfunctions of mean square 1
 * the squares of eigenvalues times area [Blended, eq. 6]. */
static exm_status laplacian_energies(const mesh *reference, const float *functions, size_t count, double *forms)
{
  size_t const V = reference->vertex_count;
  arena scratch = {0};
  sparse lower, whole;
  double total = 0;
  double *in = ARENA_NEW(&scratch, double, V *count);
  double *out = ARENA_NEW(&scratch, double, V *count);
  exm_status status = in && out ? EXM_OK : status_no_memory("the smoothness energy");
  if (status < 0 ||
      (status = sparse_laplacian(&scratch, V, reference->triangle_count, (const uint32_t(*)[3])reference->triangles,
                                 (const double(*)[3])reference->cotangents, &lower)) < 0 ||
      (status = sparse_whole(&scratch, &lower, &whole)) < 0) {
    goto done;
  }
  for (size_t i = 0; i < V * count; i++) {
    in[i] = (double)functions[i];
  }
  sparse_multiply(&whole, count, in, out);
  for (size_t v = 0; v < V; v++) {
    total += reference->masses[v];
    for (size_t f = 0; f < count; f++) {
      out[f * V + v] /= sqrt(reference->masses[v]);
    }
  }
  dense_multiply(0, 1, count, count, V, total, out, out, 0, forms);
done:
  arena_release(&scratch);
  return status;
}

/** The first `count` eigenfunctions at mean square 1, [count][V]; the constant is 1. */
static exm_status eigenfunctions(const mesh *reference, size_t count, const progress *report, float *out,
                                 double *values)
{
  size_t const V = reference->vertex_count;
  arena scratch = {0};
  double total = 0;
  double *functions = ARENA_NEW(&scratch, double, count *V);
  exm_status status = functions ? EXM_OK : status_no_memory("eigenfunctions");
  if (status == EXM_OK) {
    status = weights_eigenfunctions(reference, count, report, values, functions);
  }
  for (size_t v = 0; v < V; v++) {
    total += reference->masses[v];
  }
  for (size_t i = 0; i < count * V && status == EXM_OK; i++) {
    out[i] = i < V ? 1 : (float)(functions[i] * sqrt(total));
  }
  arena_release(&scratch);
  return status;
}

/** Clusters of vertices that lie together, by eigenfunctions over the roots of their eigenvalues. */
static exm_status cluster_by_place(const mesh *reference, const float *functions, const double *values, size_t count,
                                   size_t wanted, uint32_t *labels, size_t *made)
{
  size_t const V = reference->vertex_count;
  arena scratch = {0};
  float *rows = ARENA_NEW(&scratch, float, V *count);
  exm_status status = rows ? EXM_OK : status_no_memory("the rotation clusters");
  double lowest = 0;
  for (size_t f = count; f-- > 1;) {
    lowest = values[f] > 0 ? values[f] : lowest;
  }
  for (size_t v = 0; v < V && status == EXM_OK; v++) {
    for (size_t f = 1; f < count; f++) {
      double const value = values[f] > 0 ? sqrt(lowest / values[f]) : 10;
      rows[v * count + f] = (float)((double)functions[f * V + v] * value);
    }
  }
  if (status == EXM_OK) {
    status = clustering_kmeans(rows, V, count, reference->masses, wanted, labels, made);
  }
  arena_release(&scratch);
  return status;
}

exm_status blended_find_functions(arena *owner, const blended_request *request, const float *aligned,
                                  const progress *report, blended_deformer *deformer, blended_functions *out)
{
  const mesh *reference = request->reference;
  const exm_blended_bind_settings *settings = &request->settings;
  size_t const V = reference->vertex_count, count = settings->eigenfunction_count;
  double const start = clock_seconds();
  arena scratch = {0};
  (void)aligned;
  double *values = ARENA_NEW(&scratch, double, count);
  deformer->functions = ARENA_NEW(owner, float, count *V);
  deformer->clusters = ARENA_NEW(owner, uint32_t, V);
  out->count = out->last_count = count;
  out->first_count = settings->start_eigenfunction_count;
  out->first = ARENA_NEW(owner, size_t, count);
  out->forms = ARENA_NEW(owner, double, count *count);
  exm_status status = values && deformer->functions && deformer->clusters && out->first && out->forms
                          ? EXM_OK
                          : status_no_memory("the dictionary");
  for (size_t i = 0; i < count && status == EXM_OK; i++) {
    out->first[i] = i;
  }
  if (status == EXM_OK) {
    status = eigenfunctions(reference, count, report, deformer->functions, values);
  }
  if (status == EXM_OK) {
    status = laplacian_energies(reference, deformer->functions, count, out->forms);
  }
  if (status == EXM_OK) {
    size_t const wanted = settings->cluster_count ? settings->cluster_count : STILL_CLUSTERS;
    status = cluster_by_place(reference, deformer->functions, values, count, wanted, deformer->clusters,
                              &deformer->base.info.edge_group_count);
  }
  deformer->skin_count = count;
  deformer->info.weight_count = count;
  deformer->base.info.weight_seconds = clock_seconds() - start;
  arena_release(&scratch);
  return status;
}

exm_status blended_choose_atoms(arena *owner, const dictionary *d, const edge_energy *energy,
                                const blended_functions *functions, int stage,
                                const exm_blended_bind_settings *settings, exm_blended_info *info, size_t **atoms,
                                size_t *count)
{
  size_t const per = 1 + d->exemplar_count * d->dimension;
  size_t const used = settings->dictionary_exemplar_count ? settings->dictionary_exemplar_count : d->exemplar_count;
  size_t const kept = 1 + used * d->dimension;
  size_t const F = stage == BLENDED_FIRST ? functions->first_count : functions->last_count;
  (void)energy;
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
  info->whole_atom_count = F * kept;
  return EXM_OK;
}
