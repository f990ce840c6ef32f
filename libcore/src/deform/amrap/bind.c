/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "deform/amrap/deformer.h"
#include "linalg/dense.h"
#include "numeric/clustering.h"
#include "weights/bounded_biharmonic.h"
#include "weights/handles.h"

/* Shares of the progress bar. */
static double const AFTER_WEIGHTS = 0.6, AFTER_GROUPS = 0.65, AFTER_FACTORS = 0.8;

static exm_status find_weights(const amrap_request *request, const progress *report, amrap_deformer *deformer)
{
  size_t const count = deformer->base.info.handle_count * deformer->base.info.vertex_count;
  deformer->base.weights = ARENA_NEW(&deformer->base.memory, float, count);
  if (!deformer->base.weights) {
    return status_no_memory("the skinning weights");
  }
  if (request->settings.weights) {
    memcpy(deformer->base.weights, request->settings.weights, count * sizeof(float));
    return handles_check_weights(request->reference, request->handles, deformer->base.weights);
  }
  double const start = clock_seconds();
  deformer->weight_status =
      weights_bounded_biharmonic(request->reference, request->handles, report, deformer->base.weights);
  TRY(deformer->weight_status);
  deformer->base.info.weight_seconds = clock_seconds() - start;
  return EXM_OK;
}

/** Edge groups: k-means of the rows of the weights [AMRAP, 5.2]. shares [count]: of the surface. */
static exm_status find_groups(const amrap_request *request, amrap_deformer *deformer, double **shares)
{
  const mesh *reference = request->reference;
  size_t const V = reference->vertex_count, H = request->handles->count;
  size_t const wanted = request->settings.edge_group_count ? request->settings.edge_group_count : 2 * H;
  arena scratch = {0};
  float *rows = ARENA_NEW(&scratch, float, V *H);
  deformer->groups = ARENA_NEW(&deformer->base.memory, uint32_t, V);
  *shares = ARENA_NEW(&deformer->base.memory, double, wanted);
  exm_status status = rows && deformer->groups && *shares ? EXM_OK : status_no_memory("the edge groups");
  if (status == EXM_OK) {
    for (size_t h = 0; h < H; h++) {
      for (size_t v = 0; v < V; v++) {
        rows[v * H + h] = deformer->base.weights[h * V + v];
      }
    }
    status = clustering_kmeans(rows, V, H, reference->masses, wanted, deformer->groups,
                               &deformer->base.info.edge_group_count);
  }
  arena_release(&scratch);
  if (status < 0) {
    return status;
  }
  double total = 0;
  for (size_t v = 0; v < V; v++) {
    (*shares)[deformer->groups[v]] += reference->masses[v];
    total += reference->masses[v];
  }
  for (size_t g = 0; g < deformer->base.info.edge_group_count; g++) {
    (*shares)[g] /= total;
  }
  return EXM_OK;
}

/** The difference of all handles' weights along an edge, [H]. */
static void weight_difference(const dictionary *d, size_t a, size_t b, double *out)
{
  memset(out, 0, d->handle_count * sizeof(double));
  for (size_t i = d->weight_offsets[a]; i < d->weight_offsets[a + 1]; i++) {
    out[d->weight_handles[i]] += d->weight_values[i];
  }
  for (size_t i = d->weight_offsets[b]; i < d->weight_offsets[b + 1]; i++) {
    out[d->weight_handles[i]] -= d->weight_values[i];
  }
}

/** Energy of heights over the plane as a form in the handles' heights, [H][H]. difference [H]. */
static void height_energy(const mesh *reference, const dictionary *d, double *difference, double *energy)
{
  size_t const H = d->handle_count;
  for (size_t t = 0; t < reference->triangle_count; t++) {
    for (size_t i = 0; i < 3; i++) {
      weight_difference(d, reference->triangles[t][(i + 1) % 3], reference->triangles[t][(i + 2) % 3], difference);
      for (size_t h = 0; h < H; h++) {
        if (difference[h] != 0) {
          dense_axpy(H, reference->cotangents[t][i] * difference[h], difference, energy + h * H);
        }
      }
    }
  }
}

/** Heights of all handles from those of the held ones: free handles at least energy. */
static exm_status map_heights(const mesh *reference, const dictionary *d, amrap_deformer *deformer)
{
  size_t const H = d->handle_count;
  arena scratch = {0};
  double *energy = ARENA_NEW(&scratch, double, H *H);
  double *free_block = ARENA_NEW(&scratch, double, H *H);
  double *column = ARENA_NEW(&scratch, double, H);
  size_t *free = ARENA_NEW(&scratch, size_t, H);
  deformer->height_map = ARENA_NEW(&deformer->base.memory, double, H *H);
  exm_status status =
      energy && free_block && column && free && deformer->height_map ? EXM_OK : status_no_memory("the handles");
  if (status < 0) {
    goto done;
  }
  size_t count = 0;
  for (size_t h = 0; h < H; h++) {
    if (deformer->base.handle_kinds[h] == EXM_HANDLE_FREE) {
      free[count++] = h;
    } else {
      deformer->height_map[h * H + h] = 1;
    }
  }
  if (d->dimension != 2 || count == 0) {
    goto done;
  }
  height_energy(reference, d, column, energy);
  for (size_t i = 0; i < count; i++) {
    for (size_t j = 0; j < count; j++) {
      free_block[i * count + j] = energy[free[i] * H + free[j]];
    }
  }
  if (!dense_cholesky(count, free_block)) {
    status = status_set(EXM_ERROR_NUMERIC, "the free handles' heights are undetermined");
    goto done;
  }
  for (size_t h = 0; h < H; h++) {
    if (deformer->base.handle_kinds[h] == EXM_HANDLE_FREE) {
      continue;
    }
    for (size_t i = 0; i < count; i++) {
      column[i] = -energy[free[i] * H + h];
    }
    dense_cholesky_forward(count, free_block, column);
    dense_cholesky_backward(count, free_block, column);
    for (size_t i = 0; i < count; i++) {
      deformer->height_map[free[i] * H + h] = column[i];
    }
  }
done:
  arena_release(&scratch);
  return status;
}

static exm_status allocate_state(amrap_deformer *deformer)
{
  size_t const H = deformer->base.info.handle_count, S = deformer->base.info.exemplar_count,
               d = deformer->coordinates.dimension;
  size_t const atoms = deformer->solver.reduced.atom_count, scratch = reduced_scratch(&deformer->solver.reduced);
  size_t const affine = H * (1 + 3 * S) * 3, widest = scratch > 1 + S * d ? scratch : 1 + S * d;
  arena *owner = &deformer->base.memory;
  deformer->heights = ARENA_NEW(owner, double, H);
  deformer->pinned_heights = ARENA_NEW(owner, double, H);
  deformer->affine = ARENA_NEW(owner, double, affine);
  deformer->coefficients = ARENA_NEW(owner, double, atoms *d);
  deformer->scratch = ARENA_NEW(owner, double, widest *d);
  deformer->targets = ARENA_NEW(owner, double, deformer->held.row_count *d);
  if (!deformer->heights || !deformer->pinned_heights || !deformer->affine || !deformer->coefficients ||
      !deformer->scratch || !deformer->targets) {
    return status_no_memory("the deformer");
  }
  return EXM_OK;
}

/* The root of a group's Laplacian is dense, and so cubic work. */
enum { LARGEST_WHOLE_GROUP = 400 };

/** Is the mesh no larger than its dictionary? Then positions themselves are the smaller space, and hold all that the
 * dictionary could. */
static int has_few_vertices(const amrap_request *request, const amrap_deformer *deformer, size_t *sizes)
{
  const dictionary *d = &deformer->atoms;
  size_t const atoms = d->handle_count * (1 + d->exemplar_count * d->dimension);
  size_t largest = 0;
  for (size_t v = 0; v < d->vertex_count; v++) {
    sizes[deformer->groups[v]]++;
  }
  for (size_t g = 0; g < deformer->base.info.edge_group_count; g++) {
    largest = sizes[g] > largest ? sizes[g] : largest;
  }
  return d->vertex_count <= atoms && d->vertex_count > deformer->held.row_count && largest <= LARGEST_WHOLE_GROUP &&
         request->reference->report.loose_vertex_count == 0;
}

/** The reduced mesh over the vertices. */
static exm_status reduce_vertices(const amrap_request *request, arena *scratch, amrap_deformer *deformer)
{
  size_t const groups = deformer->base.info.edge_group_count;
  progress const measuring = progress_part(&request->report, AFTER_GROUPS, AFTER_FACTORS);
  progress const reducing = progress_part(&request->report, AFTER_FACTORS, 1);
  group_factor *roots = ARENA_NEW(scratch, group_factor, groups);
  if (!roots) {
    return status_no_memory("the edge groups");
  }
  TRY(group_roots_create(scratch, request->reference, deformer->groups, groups, &measuring, roots));
  return reduced_create_whole(&deformer->base.memory, request->reference, &deformer->atoms, &deformer->held, roots,
                              groups, &reducing, &deformer->solver.reduced);
}

/** The reduced mesh over the dictionary. */
static exm_status reduce_dictionary(const amrap_request *request, arena *scratch, amrap_deformer *deformer)
{
  size_t const groups = deformer->base.info.edge_group_count;
  progress const measuring = progress_part(&request->report, AFTER_GROUPS, AFTER_FACTORS);
  progress const reducing = progress_part(&request->report, AFTER_FACTORS, 1);
  group_factor *factors = ARENA_NEW(scratch, group_factor, groups);
  if (!factors) {
    return status_no_memory("the edge groups");
  }
  TRY(dictionary_mix(&deformer->base.memory, request->reference, &deformer->atoms));
  TRY(group_factors_create(scratch, request->reference, &deformer->atoms, deformer->groups, groups, &measuring,
                           factors));
  return reduced_create(&deformer->base.memory, &deformer->atoms, &deformer->held, factors, groups, &reducing,
                        &deformer->solver.reduced);
}

/** The solver's mesh over whichever is smaller. Where vertices are held by nothing but one another, only the dictionary
 * says so. */
static exm_status reduce(const amrap_request *request, amrap_deformer *deformer)
{
  arena scratch = {0};
  size_t *sizes = ARENA_NEW(&scratch, size_t, deformer->base.info.edge_group_count);
  exm_status status = sizes ? EXM_ERROR_NUMERIC : status_no_memory("the edge groups");
  if (sizes && has_few_vertices(request, deformer, sizes)) {
    status = reduce_vertices(request, &scratch, deformer);
  }
  /* What cannot be held with every vertex free cannot be held by fewer atoms. */
  exm_element kind = EXM_ELEMENT_NONE;
  size_t index = 0;
  status_element(&kind, &index);
  int const is_handle = deformer->solver.reduced.carriers && kind == EXM_ELEMENT_HANDLE;
  if (status == EXM_ERROR_NUMERIC && !is_handle) {
    reduced_release(&deformer->solver.reduced);
    deformer->solver.reduced = (reduced_mesh){0};
    status = reduce_dictionary(request, &scratch, deformer);
  }
  arena_release(&scratch);
  return status;
}

/** Weights, groups and the dictionary, then everything that the solver needs of the mesh. */
static exm_status build(const amrap_request *request, amrap_deformer *deformer)
{
  double *shares = NULL;
  const progress *whole = &request->report;
  progress const weighing = progress_part(whole, 0, AFTER_WEIGHTS);
  TRY(find_weights(request, &weighing, deformer));
  TRY(find_groups(request, deformer, &shares));
  TRY(progress_report(whole, AFTER_GROUPS, "grouping edges"));
  dictionary_source const source = {.handles = request->handles,
                                    .weight_count = request->handles->count,
                                    .weights = deformer->base.weights,
                                    .exemplar_count = request->exemplar_count,
                                    .poses = request->exemplars};
  TRY(dictionary_create(&deformer->base.memory, request->reference, &source, &deformer->coordinates, &deformer->atoms));
  TRY(constraints_create(&deformer->base.memory, request->reference, request->handles, &deformer->coordinates,
                         &deformer->held));
  TRY(map_heights(request->reference, &deformer->atoms, deformer));
  TRY(reduce(request, deformer));
  TRY(amrap_prepare(&deformer->base.memory, shares, &deformer->solver));
  TRY(allocate_state(deformer));
  if (!deformer->solver.reduced.carriers) {
    TRY(skinning_create(request->reference->vertex_count, request->handles->count, request->exemplar_count,
                        deformer->base.weights, request->exemplars, &deformer->skin));
  }
  TRY(progress_report(whole, 1, "binding"));
  return deformer->weight_status == EXM_OK
             ? EXM_OK
             : status_set(deformer->weight_status, "bound with skinning weights that hold their bounds but are not the "
                                                   "smoothest: the iteration cap was met first");
}

exm_status amrap_deformer_bind(const amrap_request *request, exm_deformer **out)
{
  double const start = clock_seconds();
  exm_deformer *base = NULL;
  TRY(handles_check(request->reference, request->handles));
  TRY(deformer_check_held(request->reference, request->handles));
  TRY(deformer_begin(sizeof(amrap_deformer), &amrap_methods, EXM_DEFORMER_AMRAP, request->reference, request->handles,
                     &base));
  amrap_deformer *deformer = (amrap_deformer *)base;
  base->info.exemplar_count = request->exemplar_count;
  exm_status status = space_create(request->reference, request->exemplars, request->exemplar_count,
                                   request->settings.dimension, &deformer->coordinates);
  if (status < 0 || (status = build(request, deformer)) < 0) {
    deformer_destroy(base);
    return status;
  }
  base->info.dimension = (int32_t)deformer->coordinates.dimension;
  base->info.coefficient_count = deformer->solver.reduced.rank;
  base->info.bind_seconds = clock_seconds() - start;
  *out = base;
  return status;
}
