/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/amrap/deformer.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/** Targets off a planar mesh's plane: handles lift the skin by their weights, free ones follow at least bending. */
static void lift(amrap_deformer *deformer, const double *targets)
{
  size_t const H = deformer->base.info.handle_count;
  for (size_t h = 0; h < H; h++) {
    const double *target = targets + 12 * h;
    double const point[3] = {target[3], target[7], target[11]};
    int const is_free = deformer->base.handle_kinds[h] == EXM_HANDLE_FREE;
    deformer->pinned_heights[h] = is_free ? 0 : space_height(&deformer->coordinates, point);
  }
  dense_times(H, H, 1, deformer->height_map, deformer->pinned_heights, deformer->heights);
}

/** Where skinning by the affine coefficients takes a handle's centre. */
static void skinned_centre(const amrap_deformer *deformer, size_t handle, double point[3])
{
  const dictionary *d = &deformer->atoms;
  size_t const width = d->exemplar_count * d->dimension, rows = 1 + 3 * d->exemplar_count;
  const double *from = deformer->affine + handle * rows * 3;
  double centre[3];
  memcpy(point, from, 3 * sizeof(double));
  for (size_t s = 0; s < d->exemplar_count; s++) {
    space_to_point(&deformer->coordinates, d->centres + handle * width + s * d->dimension, centre);
    for (size_t a = 0; a < 3; a++) {
      dense_axpy(3, centre[a], from + (1 + 3 * s + a) * 3, point);
    }
  }
}

/** A vertex where the coefficients are positions. */
static void vertex_position(const amrap_deformer *deformer, const double *coefficients, size_t v, double point[3])
{
  const dictionary *d = &deformer->atoms;
  space_to_point(&deformer->coordinates, coefficients + v * d->dimension, point);
  for (size_t i = d->weight_offsets[v]; d->dimension == 2 && i < d->weight_offsets[v + 1]; i++) {
    dense_axpy(3, d->weight_values[i] * deformer->heights[d->weight_handles[i]] * deformer->coordinates.unit,
               deformer->coordinates.axes[2], point);
  }
}

/** Largest distance of a held handle's centre from its target, measured on what positions are made from. */
static double residual(const amrap_deformer *deformer, const double *targets)
{
  double worst = 0;
  for (size_t i = 0; i < deformer->held.row_count; i++) {
    const constraint_row *row = &deformer->held.rows[i];
    double centre[3] = {0}, point[3], square = 0;
    if (row->is_frame) {
      continue;
    }
    if (deformer->solver.reduced.carriers) {
      for (size_t t = 0; t < row->term_count; t++) {
        vertex_position(deformer, deformer->coefficients, row->vertices[t], point);
        dense_axpy(3, row->weights[t], point, centre);
      }
    } else {
      skinned_centre(deformer, row->handle, centre);
    }
    for (int k = 0; k < 3; k++) {
      double const miss = centre[k] - targets[row->handle * 12 + (size_t)k * 4 + 3];
      square += miss * miss;
    }
    worst = fmax(worst, sqrt(square));
  }
  return worst;
}

exm_status amrap_deformer_solve(amrap_deformer *deformer, const double *targets, const amrap_options *options,
                                exm_solve_report *report)
{
  amrap *solver = &deformer->solver;
  double const unit = deformer->coordinates.unit;
  constraints_targets(&deformer->held, &deformer->coordinates, targets, deformer->targets);
  amrap_set_targets(solver, deformer->targets);
  TRY(amrap_alternate(solver, options, report));
  lift(deformer, targets);
  reduced_coefficients(&solver->reduced, solver->u, solver->c, deformer->scratch, deformer->coefficients);
  if (!solver->reduced.carriers) {
    dictionary_affine(&deformer->atoms, &deformer->coordinates, deformer->coefficients, deformer->heights,
                      deformer->scratch, deformer->affine);
  }
  deformer->base.has_result = 1;
  report->constraint_residual = residual(deformer, targets);
  report->objective *= unit;
  report->optimality_gap *= unit;
  report->elastic_energy *= unit * unit;
  for (size_t i = 0; i < report->history_count; i++) {
    report->history[i] *= unit;
  }
  return EXM_OK;
}

exm_status amrap_deformer_exemplar_positions(const amrap_deformer *deformer, size_t exemplar, double *positions)
{
  const reduced_mesh *r = &deformer->solver.reduced;
  size_t const d = r->dimension, S = r->exemplar_count, width = S * d;
  size_t const widest = reduced_scratch(r) > 1 + width ? reduced_scratch(r) : 1 + width;
  arena scratch = {0};
  double *u = ARENA_NEW(&scratch, double, r->rank *d);
  double *X = ARENA_NEW(&scratch, double, r->shape_rows *d);
  double *room = ARENA_NEW(&scratch, double, widest *d);
  double *T = ARENA_NEW(&scratch, double, r->atom_count *d);
  double *affine = ARENA_NEW(&scratch, double, deformer->base.info.handle_count *(1 + 3 * S) * 3);
  exm_status status = u && X && room && T && affine ? EXM_OK : status_no_memory("an exemplar's solution");
  if (status == EXM_OK) {
    amrap_exemplar_pose(&deformer->solver, exemplar, X, u);
    reduced_coefficients(r, u, deformer->solver.c, room, T);
    if (r->carriers) {
      for (size_t v = 0; v < r->atom_count; v++) {
        vertex_position(deformer, T, v, positions + 3 * v);
      }
    } else {
      dictionary_affine(&deformer->atoms, &deformer->coordinates, T, deformer->heights, room, affine);
      skinning_apply_f64(deformer->skin, affine, positions);
    }
  }
  arena_release(&scratch);
  return status;
}

void amrap_deformer_exemplar_energies(const amrap_deformer *deformer, double *energies)
{
  const reduced_mesh *r = &deformer->solver.reduced;
  double const unit = deformer->coordinates.unit;
  for (size_t i = 0; i < r->group_count * r->exemplar_count; i++) {
    energies[i] = deformer->solver.D[i] * unit * unit;
  }
}

void amrap_deformer_rotations(const amrap_deformer *deformer, double *rotations)
{
  const reduced_mesh *r = &deformer->solver.reduced;
  size_t const d = r->dimension;
  double turned[9], linear[3][3];
  for (size_t i = 0; i < r->group_count * r->exemplar_count; i++) {
    for (size_t a = 0; a < d; a++) {
      for (size_t b = 0; b < d; b++) {
        turned[a * d + b] = deformer->solver.rotations[(i * d + b) * d + a];
      }
    }
    space_to_linear(&deformer->coordinates, turned, linear);
    memcpy(rotations + 9 * i, linear, sizeof linear);
  }
}

static const amrap_deformer *const_of(const exm_deformer *deformer)
{
  return (const amrap_deformer *)deformer;
}

static void handle_pose(const exm_deformer *base, size_t exemplar, double *targets)
{
  const amrap_deformer *deformer = const_of(base);
  const dictionary *atoms = &deformer->atoms;
  size_t const d = atoms->dimension, width = atoms->exemplar_count * d;
  const double *images = deformer->solver.reduced.exemplar_targets + exemplar * d;
  double point[3], in_caller[3][3];
  for (size_t h = 0; h < atoms->handle_count; h++) {
    double linear[9] = {0};
    constraints_frame(&deformer->held, d, h, images, width, linear);
    space_to_linear(&deformer->coordinates, linear, in_caller);
    space_to_point(&deformer->coordinates, atoms->centres + h * width + exemplar * d, point);
    for (size_t k = 0; k < 3; k++) {
      memcpy(targets + h * 12 + k * 4, in_caller[k], 3 * sizeof(double));
      targets[h * 12 + k * 4 + 3] = point[k];
    }
  }
}

static void positions(const exm_deformer *base, int thread_count, float *out)
{
  const amrap_deformer *deformer = const_of(base);
  double point[3];
  if (deformer->skin) {
    skinning_apply(deformer->skin, deformer->affine, thread_count, out);
    return;
  }
  for (size_t v = 0; v < base->info.vertex_count; v++) {
    vertex_position(deformer, deformer->coefficients, v, point);
    for (size_t k = 0; k < 3; k++) {
      out[3 * v + k] = (float)point[k];
    }
  }
}

static void positions_f64(const exm_deformer *base, double *out)
{
  const amrap_deformer *deformer = const_of(base);
  if (deformer->skin) {
    skinning_apply_f64(deformer->skin, deformer->affine, out);
    return;
  }
  for (size_t v = 0; v < base->info.vertex_count; v++) {
    vertex_position(deformer, deformer->coefficients, v, out + 3 * v);
  }
}

static void release(exm_deformer *base)
{
  amrap_deformer *deformer = (amrap_deformer *)base;
  reduced_release(&deformer->solver.reduced);
  skinning_destroy(deformer->skin);
}

const deformer_methods amrap_methods = {
    .handle_pose = handle_pose, .positions = positions, .positions_f64 = positions_f64, .release = release};
