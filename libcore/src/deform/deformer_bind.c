/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "deform/deformer.h"
#include "linalg/dense.h"
#include "numeric/clustering.h"
#include "weights/bounded_biharmonic.h"
#include "weights/handles.h"

/* Shares of the progress bar. */
static double const AFTER_WEIGHTS = 0.6, AFTER_GROUPS = 0.65, AFTER_FACTORS = 0.8;

/** Every connected part needs a handle that says where it is: free ones do not. */
static exm_status check_held(const deformer_request *request)
{
  const mesh *reference = request->reference;
  const exm_handles *handles = request->handles;
  size_t const parts = reference->report.component_count;
  arena scratch = {0};
  unsigned char *is_held = ARENA_NEW(&scratch, unsigned char, parts);
  if (!is_held) {
    return status_no_memory("the handles");
  }
  for (size_t h = 0; h < handles->count; h++) {
    for (size_t i = handles->vertex_offsets[h]; i < handles->vertex_offsets[h + 1]; i++) {
      is_held[reference->components[handles->vertices[i]]] |= handles->kinds[h] != EXM_HANDLE_FREE;
    }
  }
  size_t loose = 0, first = SIZE_MAX;
  for (size_t v = reference->vertex_count; v-- > 0;) {
    first = is_held[reference->components[v]] ? first : v;
  }
  for (size_t p = 0; p < parts; p++) {
    loose += !is_held[p];
  }
  arena_release(&scratch);
  if (loose > 0) {
    return status_set_at(EXM_ERROR_UNCONSTRAINED, EXM_ELEMENT_VERTEX, first,
                         "%zu of %zu connected parts have only free handles, or none, that of vertex %zu for one: each "
                         "needs a pinned or oriented handle",
                         loose, parts, first);
  }
  return EXM_OK;
}

static exm_status find_weights(const deformer_request *request, const progress *report, exm_deformer *deformer)
{
  size_t const count = deformer->info.handle_count * deformer->info.vertex_count;
  deformer->weights = ARENA_NEW(&deformer->memory, float, count);
  if (!deformer->weights) {
    return status_no_memory("the skinning weights");
  }
  if (request->settings.weights) {
    memcpy(deformer->weights, request->settings.weights, count * sizeof(float));
    return handles_check_weights(request->reference, request->handles, deformer->weights);
  }
  double const start = clock_seconds();
  TRY(weights_bounded_biharmonic(request->reference, request->handles, report, deformer->weights));
  deformer->info.weight_seconds = clock_seconds() - start;
  return EXM_OK;
}

/** Edge groups: k-means of the rows of the weights [AMRAP, 5.2]. shares [count]: of the surface. */
static exm_status find_groups(const deformer_request *request, exm_deformer *deformer, double **shares)
{
  const mesh *reference = request->reference;
  size_t const V = reference->vertex_count, H = request->handles->count;
  size_t const wanted = request->settings.edge_group_count ? request->settings.edge_group_count : 2 * H;
  arena scratch = {0};
  float *rows = ARENA_NEW(&scratch, float, V *H);
  deformer->groups = ARENA_NEW(&deformer->memory, uint32_t, V);
  *shares = ARENA_NEW(&deformer->memory, double, wanted);
  exm_status status = rows && deformer->groups && *shares ? EXM_OK : status_no_memory("the edge groups");
  if (status == EXM_OK) {
    for (size_t h = 0; h < H; h++) {
      for (size_t v = 0; v < V; v++) {
        rows[v * H + h] = deformer->weights[h * V + v];
      }
    }
    status =
        clustering_kmeans(rows, V, H, reference->masses, wanted, deformer->groups, &deformer->info.edge_group_count);
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
  for (size_t g = 0; g < deformer->info.edge_group_count; g++) {
    (*shares)[g] /= total;
  }
  return EXM_OK;
}

/** Energy of heights over the plane as a form in the handles' heights, [H][H]. */
static void height_energy(const dictionary *d, const group_factor *factors, size_t group_count, double *energy)
{
  size_t const H = d->handle_count;
  for (size_t g = 0; g < group_count; g++) {
    const group_factor *f = &factors[g];
    for (size_t a = 0; a < f->column_count; a++) {
      for (size_t b = 0; b < f->column_count; b++) {
        size_t i = 0, j = 0;
        while (i < H && d->atom_offsets[i] != f->columns[a]) {
          i++;
        }
        while (j < H && d->atom_offsets[j] != f->columns[b]) {
          j++;
        }
        for (size_t row = 0; i < H && j < H && row < f->row_count; row++) {
          energy[i * H + j] += f->rows[row * f->column_count + a] * f->rows[row * f->column_count + b];
        }
      }
    }
  }
}

/** Heights of all handles from those of the held ones: free handles at least energy. */
static exm_status map_heights(const dictionary *d, const group_factor *factors, exm_deformer *deformer)
{
  size_t const H = d->handle_count;
  arena scratch = {0};
  double *energy = ARENA_NEW(&scratch, double, H *H);
  double *free_block = ARENA_NEW(&scratch, double, H *H);
  double *column = ARENA_NEW(&scratch, double, H);
  size_t *free = ARENA_NEW(&scratch, size_t, H);
  exm_status status = energy && free_block && column && free ? EXM_OK : status_no_memory("the handles");
  if (status < 0) {
    goto done;
  }
  size_t count = 0;
  for (size_t h = 0; h < H; h++) {
    if (deformer->handle_kinds[h] == EXM_HANDLE_FREE) {
      free[count++] = h;
    } else {
      deformer->height_map[h * H + h] = 1;
    }
  }
  if (d->dimension != 2 || count == 0) {
    goto done;
  }
  height_energy(d, factors, deformer->info.edge_group_count, energy);
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
    if (deformer->handle_kinds[h] == EXM_HANDLE_FREE) {
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

static exm_status allocate_state(exm_deformer *deformer, const mesh *reference, const exm_handles *handles)
{
  size_t const H = handles->count, S = deformer->info.exemplar_count, d = deformer->coordinates.dimension;
  size_t const rank = deformer->solver.reduced.rank, atoms = deformer->atoms.atom_count;
  size_t const affine = H * (1 + 3 * S) * 3, widest = rank > 1 + S * d ? rank : 1 + S * d;
  arena *owner = &deformer->memory;
  deformer->heights = ARENA_NEW(owner, double, H);
  deformer->pinned_heights = ARENA_NEW(owner, double, H);
  deformer->affine = ARENA_NEW(owner, double, affine);
  deformer->coefficients = ARENA_NEW(owner, double, atoms *d);
  deformer->scratch = ARENA_NEW(owner, double, widest *d);
  deformer->reference = ARENA_NEW(owner, float, 3 * reference->vertex_count);
  deformer->targets = ARENA_NEW(owner, double, deformer->held.row_count *d);
  if (!deformer->heights || !deformer->pinned_heights || !deformer->affine || !deformer->coefficients ||
      !deformer->scratch || !deformer->reference || !deformer->targets) {
    return status_no_memory("the deformer");
  }
  for (size_t i = 0; i < 3 * reference->vertex_count; i++) {
    deformer->reference[i] = (float)reference->positions[i / 3][i % 3];
  }
  return EXM_OK;
}

static exm_status keep_handles(exm_deformer *deformer, const exm_handles *handles)
{
  size_t const H = handles->count;
  deformer->handle_kinds = ARENA_NEW(&deformer->memory, int32_t, H);
  deformer->height_map = ARENA_NEW(&deformer->memory, double, H *H);
  if (!deformer->handle_kinds || !deformer->height_map) {
    return status_no_memory("the handles");
  }
  memcpy(deformer->handle_kinds, handles->kinds, H * sizeof(int32_t));
  return EXM_OK;
}

/** Weights, groups and the dictionary, then everything that the solver needs of the mesh. */
static exm_status build(const deformer_request *request, exm_deformer *deformer)
{
  arena scratch = {0};
  double *shares = NULL;
  reduced_mesh reduced;
  const progress *whole = &request->report;
  progress const weighing = progress_part(whole, 0, AFTER_WEIGHTS);
  progress const measuring = progress_part(whole, AFTER_GROUPS, AFTER_FACTORS);
  progress const reducing = progress_part(whole, AFTER_FACTORS, 1);
  exm_status status;
  TRY(keep_handles(deformer, request->handles));
  TRY(find_weights(request, &weighing, deformer));
  TRY(find_groups(request, deformer, &shares));
  TRY(progress_report(whole, AFTER_GROUPS, "grouping edges"));
  TRY(dictionary_create(&deformer->memory, request->reference, request->handles, deformer->weights, request->exemplars,
                        request->exemplar_count, &deformer->coordinates, &deformer->atoms));
  TRY(constraints_create(&deformer->memory, request->reference, request->handles, &deformer->coordinates,
                         &deformer->held));
  size_t const groups = deformer->info.edge_group_count;
  group_factor *factors = ARENA_NEW(&scratch, group_factor, groups);
  status = factors ? EXM_OK : status_no_memory("the edge groups");
  if (status < 0 ||
      (status = group_factors_create(&scratch, request->reference, &deformer->atoms, deformer->groups, groups,
                                     &measuring, factors)) < 0 ||
      (status = map_heights(&deformer->atoms, factors, deformer)) < 0 ||
      (status = reduced_create(&deformer->memory, &deformer->atoms, &deformer->held, factors, groups, &reducing,
                               &reduced)) < 0 ||
      (status = amrap_prepare(&deformer->memory, &reduced, shares, &deformer->solver)) < 0 ||
      (status = allocate_state(deformer, request->reference, request->handles)) < 0 ||
      (status = skinning_create(request->reference->vertex_count, request->handles->count, request->exemplar_count,
                                deformer->weights, request->exemplars, &deformer->skin)) < 0) {
    goto done;
  }
  status = progress_report(whole, 1, "binding");
done:
  arena_release(&scratch);
  return status;
}

exm_status deformer_bind(const deformer_request *request, exm_deformer **out)
{
  double const start = clock_seconds();
  exm_deformer *deformer = calloc(1, sizeof *deformer);
  if (!deformer) {
    return status_no_memory("the deformer");
  }
  deformer->info = (exm_deformer_info){.struct_size = sizeof deformer->info,
                                       .vertex_count = request->reference->vertex_count,
                                       .handle_count = request->handles->count,
                                       .exemplar_count = request->exemplar_count};
  exm_status status = handles_check(request->reference, request->handles);
  if (status < 0 || (status = check_held(request)) < 0 ||
      (status = space_create(request->reference, request->exemplars, request->exemplar_count,
                             request->settings.dimension, &deformer->coordinates)) < 0 ||
      (status = build(request, deformer)) < 0) {
    deformer_destroy(deformer);
    return status;
  }
  deformer->info.dimension = (int32_t)deformer->coordinates.dimension;
  deformer->info.coefficient_count = deformer->solver.reduced.rank;
  deformer->info.bind_seconds = clock_seconds() - start;
  *out = deformer;
  return EXM_OK;
}
