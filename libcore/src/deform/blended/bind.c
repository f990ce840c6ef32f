/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "deform/blended/bind.h"
#include "deform/blended/warnings.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"
#include "weights/handles.h"

/* Shares of the progress bar. */
static double const AFTER_FUNCTIONS = 0.6, AFTER_ENERGY = 0.9;

/* ------------------------------------------------------------------------------------------- exemplars and handles */

/** The rigid motion of exemplar coordinates x [V][d] (stride doubles apart) onto the reference's, by masses. */
static void find_motion(const mesh *reference, const space *s, const double *x, size_t stride, double *turn,
                        double *shift)
{
  size_t const d = s->dimension;
  double total = 0, mean[3] = {0}, mean_reference[3] = {0}, moment[9] = {0}, y[3];
  for (size_t v = 0; v < reference->vertex_count; v++) {
    space_from_point(s, reference->positions[v], y);
    dense_axpy(d, reference->masses[v], x + v * stride, mean);
    dense_axpy(d, reference->masses[v], y, mean_reference);
    total += reference->masses[v];
  }
  for (size_t v = 0; v < reference->vertex_count; v++) {
    space_from_point(s, reference->positions[v], y);
    for (size_t i = 0; i < d; i++) {
      for (size_t j = 0; j < d; j++) {
        moment[i * d + j] +=
            reference->masses[v] * (y[i] - mean_reference[i] / total) * (x[v * stride + j] - mean[j] / total);
      }
    }
  }
  rotation_fit(d, 1, moment, turn);
  dense_times(d, d, 1, turn, mean, shift);
  for (size_t k = 0; k < d; k++) {
    shift[k] = (mean_reference[k] - shift[k]) / total;
  }
}

/** All exemplars laid on the reference, rigidly, in the caller's coordinates: similar atoms are then alike, and nothing
 *  depends on where exemplars lie. */
static exm_status align(const blended_request *request, const space *s, float *aligned)
{
  const mesh *reference = request->reference;
  size_t const V = reference->vertex_count, d = s->dimension;
  arena scratch = {0};
  double *x = ARENA_NEW(&scratch, double, V *d);
  if (!x) {
    return status_no_memory("the exemplars");
  }
  for (size_t e = 0; e < request->exemplar_count; e++) {
    double turn[9], shift[3], moved[3], point[3];
    for (size_t v = 0; v < V; v++) {
      const float *from = request->exemplars + (e * V + v) * 3;
      double const p[3] = {(double)from[0], (double)from[1], (double)from[2]};
      space_from_point(s, p, x + v * d);
    }
    find_motion(reference, s, x, d, turn, shift);
    for (size_t v = 0; v < V; v++) {
      dense_times(d, d, 1, turn, x + v * d, moved);
      dense_axpy(d, 1, shift, moved);
      space_to_point(s, moved, point);
      for (size_t k = 0; k < 3; k++) {
        aligned[(e * V + v) * 3 + k] = (float)point[k];
      }
    }
  }
  arena_release(&scratch);
  return EXM_OK;
}

/** Where the exemplars, as they were given, have the handles. */
static exm_status find_poses(const blended_request *request, blended_deformer *deformer)
{
  const space *s = &deformer->coordinates;
  size_t const H = request->handles->count, V = request->reference->vertex_count, d = s->dimension;
  arena scratch = {0};
  double *images = ARENA_NEW(&scratch, double, deformer->held.row_count *d);
  deformer->poses = ARENA_NEW(&deformer->base.memory, double, request->exemplar_count *H * 12);
  exm_status const status = images && deformer->poses ? EXM_OK : status_no_memory("the handles");
  for (size_t e = 0; e < request->exemplar_count && status == EXM_OK; e++) {
    const float *pose = request->exemplars + e * V * 3;
    constraints_on_pose(&deformer->held, s, pose, images);
    for (size_t h = 0; h < H; h++) {
      double linear[9] = {0}, in_caller[3][3], *to = deformer->poses + (e * H + h) * 12;
      constraints_frame(&deformer->held, d, h, images, d, linear);
      space_to_linear(s, linear, in_caller);
      for (size_t k = 0; k < 3; k++) {
        memcpy(to + 4 * k, in_caller[k], 3 * sizeof(double));
      }
      size_t const first = request->handles->vertex_offsets[h], last = request->handles->vertex_offsets[h + 1];
      for (size_t i = first; i < last; i++) {
        for (size_t k = 0; k < 3; k++) {
          to[4 * k + 3] += (double)pose[3 * (size_t)request->handles->vertices[i] + k] / (double)(last - first);
        }
      }
    }
  }
  arena_release(&scratch);
  return status;
}

/* ---------------------------------------------------------------------------------------------------- dictionaries */

/** Lambda of eq. 6 over the joint dictionary: the functions' Laplacian energy, for every exemplar's coordinate alike.
 */
static exm_status find_bending(arena *scratch, const dictionary *atoms, const double *forms, double **out)
{
  size_t const n = atoms->atom_count, per = 1 + atoms->exemplar_count * atoms->dimension, F = atoms->handle_count;
  double *bending = ARENA_NEW(scratch, double, n *n);
  if (!bending) {
    return status_no_memory("the dictionary");
  }
  for (size_t f = 0; f < F; f++) {
    for (size_t g = 0; g < F; g++) {
      for (size_t k = 0; k < per; k++) {
        bending[(f * per + k) * n + g * per + k] = forms[f * F + g];
      }
    }
  }
  *out = bending;
  return EXM_OK;
}

static exm_status build_solver(blended_deformer *deformer, const blended_functions *functions,
                               const blended_request *request)
{
  blended *b = &deformer->solver;
  arena scratch = {0};
  arena *owner = &deformer->base.memory;
  double *bending = NULL;
  size_t *atoms[BLENDED_STAGES], counts[BLENDED_STAGES];
  *b = (blended){.dimension = deformer->coordinates.dimension,
                 .group_count = deformer->base.info.edge_group_count,
                 .exemplar_count = request->exemplar_count,
                 .compared_count = request->settings.compared_exemplar_count ? request->settings.compared_exemplar_count
                                                                             : request->exemplar_count,
                 .joint_count = deformer->atoms.atom_count,
                 .energy = &deformer->energy,
                 .beta_lc = request->settings.constraint_weight,
                 .beta_sm = request->settings.smoothness};
  exm_status status = find_bending(&scratch, &deformer->atoms, functions->forms, &bending);
  for (int s = 0; s < BLENDED_STAGES && status == EXM_OK; s++) {
    status = blended_choose_atoms(&scratch, &deformer->atoms, &deformer->energy, functions, s, &request->settings,
                                  &deformer->info, &atoms[s], &counts[s]);
    if (status == EXM_OK) {
      status = blended_basis_create(owner, &deformer->energy, bending, counts[s], atoms[s], &b->bases[s]);
    }
  }
  if (status == EXM_OK) {
    b->first_bending = ARENA_NEW(owner, double, counts[BLENDED_FIRST]);
    status = b->first_bending ? EXM_OK : status_no_memory("the deformer");
  }
  for (size_t i = 0; status == EXM_OK && i < counts[BLENDED_FIRST]; i++) {
    b->first_bending[i] = bending[atoms[BLENDED_FIRST][i] * (b->joint_count + 1)];
  }
  if (status == EXM_OK && (status = blended_allocate(owner, b)) == EXM_OK) {
    status = blended_constraints_begin(b, &deformer->atoms, &deformer->held);
  }
  deformer->info.start_atom_count = status == EXM_OK ? counts[BLENDED_FIRST] : 0;
  deformer->info.atom_count = status == EXM_OK ? counts[BLENDED_LAST] : 0;
  arena_release(&scratch);
  return status;
}

/** The centre of every handle, free ones as well, as a row over the joint dictionary. */
static exm_status find_centres(const exm_handles *handles, blended_deformer *deformer)
{
  const dictionary *atoms = &deformer->atoms;
  arena scratch = {0};
  constraint_row row = {0};
  constraints const one = {.row_count = 1, .rows = &row};
  double *values = ARENA_NEW(&scratch, double, 1 + atoms->exemplar_count * atoms->dimension);
  double *weights = ARENA_NEW(&scratch, double, handles->vertex_offsets[handles->count]);
  deformer->centres = ARENA_NEW(&deformer->base.memory, double, handles->count * atoms->atom_count);
  exm_status const status = values && weights && deformer->centres ? EXM_OK : status_no_memory("the handles");
  for (size_t h = 0; h < handles->count && status == EXM_OK; h++) {
    size_t const first = handles->vertex_offsets[h], count = handles->vertex_offsets[h + 1] - first;
    for (size_t i = 0; i < count; i++) {
      weights[i] = 1 / (double)count;
    }
    row = (constraint_row){.handle = h, .term_count = count, .vertices = handles->vertices + first, .weights = weights};
    constraints_matrix(&one, atoms, values, deformer->centres + h * atoms->atom_count);
  }
  arena_release(&scratch);
  return status;
}

static exm_status allocate_state(blended_deformer *deformer)
{
  size_t const F = deformer->atoms.handle_count, S = deformer->atoms.exemplar_count;
  size_t const d = deformer->coordinates.dimension, H = deformer->base.info.handle_count;
  arena *owner = &deformer->base.memory;
  deformer->affine = ARENA_NEW(owner, double, F *(1 + 3 * S) * 3);
  deformer->placed = ARENA_NEW(owner, double, deformer->atoms.atom_count *d);
  deformer->heights = ARENA_NEW(owner, double, F);
  deformer->scratch = ARENA_NEW(owner, double, (1 + S * d) * d);
  deformer->handle_weights = ARENA_NEW(owner, double, H);
  deformer->images = ARENA_NEW(owner, double, deformer->held.row_count *d);
  if (!deformer->affine || !deformer->placed || !deformer->heights || !deformer->scratch || !deformer->handle_weights ||
      !deformer->images) {
    return status_no_memory("the deformer");
  }
  for (size_t h = 0; h < H; h++) {
    deformer->handle_weights[h] = 1;
  }
  return EXM_OK;
}

static exm_status build(const blended_request *request, blended_deformer *deformer)
{
  const mesh *reference = request->reference;
  size_t const V = reference->vertex_count, S = request->exemplar_count;
  const progress *whole = &request->report;
  progress const finding = progress_part(whole, 0, AFTER_FUNCTIONS);
  progress const measuring = progress_part(whole, AFTER_FUNCTIONS, AFTER_ENERGY);
  arena scratch = {0};
  arena *owner = &deformer->base.memory;
  float *aligned = ARENA_NEW(&scratch, float, S *V * 3);
  blended_functions functions = {0};
  exm_status status = aligned ? EXM_OK : status_no_memory("the exemplars");
  if (status < 0 ||
      (status = constraints_create(owner, reference, request->handles, &deformer->coordinates, &deformer->held)) < 0 ||
      (status = find_poses(request, deformer)) < 0 || (status = align(request, &deformer->coordinates, aligned)) < 0 ||
      (status = blended_find_functions(owner, request, aligned, &finding, deformer, &functions)) < 0) {
    goto done;
  }
  dictionary_source const source = {
      .weight_count = functions.count, .weights = deformer->functions, .exemplar_count = S, .poses = aligned};
  if ((status = dictionary_create(owner, reference, &source, &deformer->coordinates, &deformer->atoms)) < 0 ||
      (status = edge_energy_create(owner, reference, &deformer->atoms, deformer->clusters,
                                   deformer->base.info.edge_group_count, &measuring, &deformer->energy)) < 0 ||
      (status = build_solver(deformer, &functions, request)) < 0 || (status = allocate_state(deformer)) < 0 ||
      (status = find_centres(request->handles, deformer)) < 0 ||
      (status = skinning_create(V, deformer->skin_count, S, deformer->functions, aligned, &deformer->skin)) < 0) {
    goto done;
  }
  status = progress_report(whole, 1, "binding");
done:
  arena_release(&scratch);
  return status;
}

exm_status blended_deformer_bind(const blended_request *request, exm_deformer **out)
{
  double const start = clock_seconds();
  exm_deformer *base = NULL;
  TRY(handles_check(request->reference, request->handles));
  TRY(deformer_check_held(request->reference, request->handles));
  TRY(deformer_begin(sizeof(blended_deformer), &blended_methods, EXM_DEFORMER_BLENDED, request->reference,
                     request->handles, &base));
  blended_deformer *deformer = (blended_deformer *)base;
  base->info.exemplar_count = request->exemplar_count;
  exm_status status = space_create(request->reference, request->exemplars, request->exemplar_count,
                                   request->settings.dimension, &deformer->coordinates);
  if (status < 0 || (status = build(request, deformer)) < 0) {
    deformer_destroy(base);
    return status;
  }
  base->info.dimension = (int32_t)deformer->coordinates.dimension;
  base->info.coefficient_count = deformer->solver.bases[BLENDED_LAST].rank;
  status = blended_warn_exemplars(deformer, request->reference);
  if (status == EXM_OK) {
    status = blended_warn_spread(&deformer->solver, deformer->solver.held.on_exemplars,
                                 request->exemplar_count * deformer->coordinates.dimension);
  }
  if (status < 0) {
    deformer_destroy(base);
    return status;
  }
  base->info.bind_seconds = clock_seconds() - start;
  *out = base;
  return status;
}
