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

/** Largest distance of a held handle's centre from its target, measured on the skinning coefficients themselves. */
static double residual(const amrap_deformer *deformer, const double *targets, const double *affine)
{
  const dictionary *d = &deformer->atoms;
  size_t const width = d->exemplar_count * d->dimension, rows = 1 + 3 * d->exemplar_count;
  double worst = 0, centre[3];
  for (size_t h = 0; h < d->handle_count; h++) {
    if (deformer->base.handle_kinds[h] == EXM_HANDLE_FREE) {
      continue;
    }
    const double *from = affine + h * rows * 3;
    double point[3] = {from[0], from[1], from[2]}, square = 0;
    for (size_t s = 0; s < d->exemplar_count; s++) {
      space_to_point(&deformer->coordinates, d->centres + h * width + s * d->dimension, centre);
      for (size_t a = 0; a < 3; a++) {
        dense_axpy(3, centre[a], from + (1 + 3 * s + a) * 3, point);
      }
    }
    for (int k = 0; k < 3; k++) {
      double const miss = point[k] - targets[h * 12 + (size_t)k * 4 + 3];
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
  dictionary_affine(&deformer->atoms, &deformer->coordinates, deformer->coefficients, deformer->heights,
                    deformer->scratch, deformer->affine);
  deformer->base.has_result = 1;
  report->constraint_residual = residual(deformer, targets, deformer->affine);
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
  arena scratch = {0};
  double *u = ARENA_NEW(&scratch, double, r->rank *d);
  double *X = ARENA_NEW(&scratch, double, r->shape_rows *d);
  double *room = ARENA_NEW(&scratch, double, (r->rank + 1 + width) * d);
  double *T = ARENA_NEW(&scratch, double, r->atom_count *d);
  double *affine = ARENA_NEW(&scratch, double, deformer->base.info.handle_count *(1 + 3 * S) * 3);
  exm_status status = u && X && room && T && affine ? EXM_OK : status_no_memory("an exemplar's solution");
  if (status == EXM_OK) {
    amrap_exemplar_pose(&deformer->solver, exemplar, X, u);
    reduced_coefficients(r, u, deformer->solver.c, room, T);
    dictionary_affine(&deformer->atoms, &deformer->coordinates, T, deformer->heights, room, affine);
    skinning_apply_f64(deformer->skin, affine, positions);
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

static void positions(const exm_deformer *deformer, int thread_count, float *out)
{
  skinning_apply(const_of(deformer)->skin, const_of(deformer)->affine, thread_count, out);
}

static void positions_f64(const exm_deformer *deformer, double *out)
{
  skinning_apply_f64(const_of(deformer)->skin, const_of(deformer)->affine, out);
}

static void release(exm_deformer *deformer)
{
  skinning_destroy(((amrap_deformer *)deformer)->skin);
}

const deformer_methods amrap_methods = {
    .handle_pose = handle_pose, .positions = positions, .positions_f64 = positions_f64, .release = release};
