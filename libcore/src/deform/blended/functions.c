/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "deform/blended/bind.h"
#include "linalg/dense.h"
#include "linalg/sparse.h"
#include "numeric/clustering.h"
#include "weights/decomposition.h"
#include "weights/eigenfunctions.h"

/* Rotation clusters of a single exemplar, which shows no motion; and how many eigenfunctions tell them apart. */
enum { STILL_CLUSTERS = 20, PLACE_FUNCTIONS = 10 };
enum { BONE_LIMIT = 40, INFLUENCES = 4, WEIGHT_ROUNDS = 10 };
/* Of rigid clusters, as a share of the diagonal. */
static double const BONE_TOLERANCE = 0.01;

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

/** Labels without gaps, and how many there are. */
static exm_status renumber(size_t count, uint32_t *labels, size_t limit, size_t *made)
{
  arena scratch = {0};
  uint32_t *numbers = ARENA_NEW(&scratch, uint32_t, limit);
  exm_status const status = numbers ? EXM_OK : status_no_memory("the rotation clusters");
  uint32_t next = 0;
  for (size_t v = 0; v < count && numbers; v++) {
    uint32_t *number = &numbers[labels[v]];
    *number = *number ? *number : ++next;
    labels[v] = *number - 1;
  }
  *made = next;
  arena_release(&scratch);
  return status;
}

/** What a bind is after, and what it has found. */
typedef struct finder {
  const blended_request *request;
  const exm_blended_bind_settings *settings;
  const float *aligned;
  blended_deformer *deformer;
  blended_functions *out;
  size_t V, eigen_count, bone_count;
  float *eigen; /* [eigen_count][V] */
  double *values;
  float *bones; /* [bone_count][V]; NULL: not wanted */
} finder;

static int wants_skeleton(const finder *f)
{
  return f->settings->dictionary == EXM_DICTIONARY_SKELETON;
}

/** Weights that were given, with the clusters that follow from them. */
static exm_status take_weights(arena *scratch, finder *f)
{
  f->bone_count = f->settings->bone_count;
  f->bones = ARENA_NEW(scratch, float, f->bone_count * f->V);
  if (!f->bones) {
    return status_no_memory("the skinning weights");
  }
  memcpy(f->bones, f->settings->weights, f->bone_count * f->V * sizeof(float));
  for (size_t v = 0; v < f->V; v++) {
    size_t best = 0;
    for (size_t i = 1; i < f->bone_count; i++) {
      best = f->bones[i * f->V + v] > f->bones[best * f->V + v] ? i : best;
    }
    f->deformer->clusters[v] = (uint32_t)best;
  }
  return renumber(f->V, f->deformer->clusters, f->bone_count, &f->deformer->base.info.edge_group_count);
}

/** Bones out of the exemplars' motion, and their weights where the dictionary is made of those. */
static exm_status decompose(arena *scratch, finder *f, const progress *report)
{
  const mesh *reference = f->request->reference;
  size_t const wanted = f->settings->bone_count, limit = wanted ? wanted : f->V < BONE_LIMIT ? f->V : BONE_LIMIT;
  progress const clustering = progress_part(report, 0, 0.5), weighing = progress_part(report, 0.5, 1);
  decomposition d;
  int32_t rounds = 0;
  TRY(decomposition_create(scratch, reference, f->aligned, f->request->exemplar_count, limit, INFLUENCES, &d));
  TRY(decomposition_cluster(&d, wanted, BONE_TOLERANCE * reference->report.diagonal, &clustering));
  if (wants_skeleton(f)) {
    TRY(decomposition_alternate(&d, WEIGHT_ROUNDS, &weighing, &rounds));
    f->bones = ARENA_NEW(scratch, float, d.bone_count * f->V);
    if (!f->bones) {
      return status_no_memory("the skinning weights");
    }
    for (size_t v = 0; v < f->V; v++) {
      for (size_t i = 0; i < d.counts[v]; i++) {
        f->bones[d.bones[v * INFLUENCES + i] * f->V + v] = (float)d.weights[v * INFLUENCES + i];
      }
    }
  }
  f->bone_count = d.bone_count;
  f->deformer->info.decomposition_error = decomposition_error(&d, NULL);
  memcpy(f->deformer->clusters, d.labels, f->V * sizeof *d.labels);
  return renumber(f->V, f->deformer->clusters, d.bone_count, &f->deformer->base.info.edge_group_count);
}

/** Rotation clusters where bones do not say: by motion, if their number is given, or by place. */
static exm_status find_clusters(arena *scratch, finder *f, const progress *report)
{
  const mesh *reference = f->request->reference;
  size_t const wanted = f->settings->cluster_count;
  size_t *made = &f->deformer->base.info.edge_group_count;
  if (wanted > 0 && f->request->exemplar_count > 1) {
    decomposition d;
    TRY(decomposition_create(scratch, reference, f->aligned, f->request->exemplar_count, wanted, 1, &d));
    TRY(decomposition_cluster(&d, wanted, 0, report));
    memcpy(f->deformer->clusters, d.labels, f->V * sizeof *d.labels);
    return renumber(f->V, f->deformer->clusters, wanted, made);
  }
  if (wanted > 0 || f->bone_count <= 1) {
    size_t const count = wanted > 0 ? wanted : STILL_CLUSTERS;
    return cluster_by_place(reference, f->eigen, f->values, f->eigen_count, count, f->deformer->clusters, made);
  }
  return EXM_OK;
}

/** Functions of the last stage first: the constant, bones or eigenfunctions; then what the first stages need besides.
 */
static exm_status join(arena *owner, finder *f)
{
  blended_functions *out = f->out;
  size_t const V = f->V, start = f->settings->start_eigenfunction_count;
  out->last_count = wants_skeleton(f) ? 1 + f->bone_count : f->eigen_count;
  out->count = wants_skeleton(f) ? out->last_count + start - 1 : out->last_count;
  out->first_count = start;
  f->deformer->functions = ARENA_NEW(owner, float, out->count *V);
  out->first = ARENA_NEW(owner, size_t, start);
  out->forms = ARENA_NEW(owner, double, out->count * out->count);
  if (!f->deformer->functions || !out->first || !out->forms) {
    return status_no_memory("the dictionary");
  }
  float *to = f->deformer->functions;
  if (wants_skeleton(f)) {
    memcpy(to, f->eigen, V * sizeof(float));
    memcpy(to + V, f->bones, f->bone_count * V * sizeof(float));
    memcpy(to + out->last_count * V, f->eigen + V, (start - 1) * V * sizeof(float));
  } else {
    memcpy(to, f->eigen, out->count * V * sizeof(float));
  }
  for (size_t i = 0; i < start; i++) {
    out->first[i] = wants_skeleton(f) && i > 0 ? out->last_count + i - 1 : i;
  }
  return laplacian_energies(f->request->reference, f->deformer->functions, out->count, out->forms);
}

/** Skinning weights have kinks, and the finer the mesh the larger their Laplacian energy: it is brought to the size
 * that as many eigenfunctions have, sum_j (4 pi j)^2 by Weyl's law, so that beta_sm means the same for both. */
static void scale_forms(const finder *f)
{
  double *forms = f->out->forms, own = 0, smooth = 0;
  size_t const n = f->out->count;
  for (size_t i = 1; i <= f->bone_count; i++) {
    own += forms[i * (n + 1)];
    smooth += 16 * M_PI * M_PI * (double)(i * i);
  }
  double const factor = own > smooth ? smooth / own : 1;
  for (size_t i = 0; i < n; i++) {
    for (size_t j = 0; j < n; j++) {
      int const is_bone = i <= f->bone_count, is_other_bone = j <= f->bone_count;
      forms[i * n + j] *= is_bone && is_other_bone ? factor : is_bone || is_other_bone ? sqrt(factor) : 1;
    }
  }
}

exm_status blended_find_functions(arena *owner, const blended_request *request, const float *aligned,
                                  const progress *report, blended_deformer *deformer, blended_functions *out)
{
  const exm_blended_bind_settings *settings = &request->settings;
  double const start = clock_seconds();
  arena scratch = {0};
  finder f = {.request = request,
              .settings = settings,
              .aligned = aligned,
              .deformer = deformer,
              .out = out,
              .V = request->reference->vertex_count};
  progress const solving = progress_part(report, 0, 0.5), decomposing = progress_part(report, 0.5, 1);
  f.eigen_count = wants_skeleton(&f) && settings->start_eigenfunction_count > PLACE_FUNCTIONS
                      ? settings->start_eigenfunction_count
                  : wants_skeleton(&f) ? PLACE_FUNCTIONS
                                       : settings->eigenfunction_count;
  f.eigen_count = f.eigen_count < f.V ? f.eigen_count : f.V;
  f.eigen = ARENA_NEW(&scratch, float, f.eigen_count *f.V);
  f.values = ARENA_NEW(&scratch, double, f.eigen_count);
  deformer->clusters = ARENA_NEW(owner, uint32_t, f.V);
  exm_status status = f.eigen && f.values && deformer->clusters ? EXM_OK : status_no_memory("the dictionary");
  if (status < 0 || (status = eigenfunctions(request->reference, f.eigen_count, &solving, f.eigen, f.values)) < 0) {
    goto done;
  }
  if (settings->weights) {
    status = take_weights(&scratch, &f);
  } else if (request->exemplar_count > 1 || wants_skeleton(&f)) {
    status = decompose(&scratch, &f, &decomposing);
  }
  if (status < 0 || (status = find_clusters(&scratch, &f, &decomposing)) < 0 || (status = join(owner, &f)) < 0) {
    goto done;
  }
  if (wants_skeleton(&f)) {
    scale_forms(&f);
  }
  deformer->skin_count = deformer->info.weight_count = out->last_count;
  deformer->info.bone_count = f.bone_count;
  deformer->base.info.weight_seconds = clock_seconds() - start;
done:
  arena_release(&scratch);
  return status;
}
