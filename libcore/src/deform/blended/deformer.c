/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/blended/deformer.h"

#include <math.h>
#include <string.h>

#include "deform/blended/warnings.h"
#include "linalg/dense.h"

/** Coefficients in the space's own frame: rows turned and scaled, the shift on the constant's translation. */
void blended_deformer_place(blended_deformer *deformer, double mean_height)
{
  const blended *b = &deformer->solver;
  size_t const d = b->dimension;
  for (size_t j = 0; j < b->joint_count; j++) {
    double *to = deformer->placed + j * d;
    dense_times(d, d, 1, b->frame.turn, b->coefficients + j * d, to);
    for (size_t k = 0; k < d; k++) {
      to[k] *= b->frame.scale;
    }
  }
  dense_axpy(d, 1, b->frame.shift, deformer->placed);
  memset(deformer->heights, 0, deformer->atoms.handle_count * sizeof(double));
  deformer->heights[0] = mean_height;
  dictionary_affine(&deformer->atoms, &deformer->coordinates, deformer->placed, deformer->heights, deformer->scratch,
                    deformer->affine);
  /* Skinning adds up functions: only the constant's translation is a place, the others' are displacements. */
  double origin[3];
  double const zero[3] = {0};
  space_to_point(&deformer->coordinates, zero, origin);
  for (size_t f = 1; f < deformer->atoms.handle_count; f++) {
    dense_axpy(3, -1, origin, deformer->affine + f * (1 + 3 * b->exemplar_count) * 3);
  }
  deformer->base.has_result = 1;
}

/** Row i's value on the placed pose, in the space. */
static void row_value(const blended_deformer *deformer, size_t row, double *out)
{
  const blended *b = &deformer->solver;
  dense_times(1, b->joint_count, b->dimension, b->held.joint + row * b->joint_count, deformer->placed, out);
}

/** Largest distance of rows that count from their targets; directions are not distances. */
static double residual(const blended_deformer *deformer)
{
  const blended_constraints *c = &deformer->solver.held;
  size_t const d = deformer->solver.dimension;
  double worst = 0, value[3];
  for (size_t r = 0; r < c->row_count; r++) {
    if (c->weights[r] > 0 && !c->rows[r].is_frame) {
      row_value(deformer, r, value);
      dense_axpy(d, -1, c->targets + r * d, value);
      worst = fmax(worst, sqrt(dense_dot(d, value, value)));
    }
  }
  return worst * deformer->coordinates.unit;
}

/** Mean height of the handles that count over the plane of a two-dimensional space. */
static double mean_height(const blended_deformer *deformer, const double *targets)
{
  double sum = 0, count = 0;
  for (size_t h = 0; h < deformer->base.info.handle_count; h++) {
    double const point[3] = {targets[12 * h + 3], targets[12 * h + 7], targets[12 * h + 11]};
    if (deformer->base.handle_kinds[h] != EXM_HANDLE_FREE && deformer->handle_weights[h] > 0) {
      sum += deformer->handle_weights[h] * space_height(&deformer->coordinates, point);
      count += deformer->handle_weights[h];
    }
  }
  return count > 0 ? sum / count : 0;
}

/** Targets of added rows in the space: points where coefficients sum to one, in general sum times a point. */
static void set_row_targets(blended_deformer *deformer, const double *row_targets)
{
  blended_constraints *c = &deformer->solver.held;
  const space *s = &deformer->coordinates;
  for (size_t r = c->handle_row_count; r < c->row_count; r++) {
    const double *from = row_targets + 3 * (r - c->handle_row_count);
    double const sum = c->sums[r];
    for (size_t i = 0; i < s->dimension; i++) {
      double value = 0;
      for (size_t k = 0; k < 3; k++) {
        value += s->axes[i][k] * (from[k] - sum * s->origin[k]);
      }
      c->targets[r * s->dimension + i] = value / s->unit;
    }
  }
}

static exm_status check_held(const blended_deformer *deformer)
{
  const blended_constraints *c = &deformer->solver.held;
  for (size_t r = 0; r < c->row_count; r++) {
    if (c->weights[r] > 0 && c->sums[r] != 0) {
      return EXM_OK;
    }
  }
  return status_set(EXM_ERROR_UNCONSTRAINED, "no handle or row that says where the mesh is has a weight above 0");
}

exm_status blended_deformer_solve(blended_deformer *deformer, const double *targets, const double *row_targets,
                                  const blended_options *options, exm_solve_report *report)
{
  blended *b = &deformer->solver;
  exm_blended_outcome outcome = deformer->outcome;
  TRY(check_held(deformer));
  constraints_targets(&deformer->held, &deformer->coordinates, targets, b->held.targets);
  set_row_targets(deformer, row_targets);
  TRY(blended_solve(b, options, report, &outcome));
  blended_deformer_place(deformer, mean_height(deformer, targets));
  double const unit = deformer->coordinates.unit, unit2 = unit * unit * b->frame.scale * b->frame.scale;
  outcome.average_energy *= unit2;
  outcome.minimal_energy *= unit2;
  outcome.final_energy *= unit2;
  report->objective = outcome.final_energy;
  report->elastic_energy *= unit2;
  for (size_t i = 0; i < report->history_count; i++) {
    report->history[i] *= unit2;
  }
  report->constraint_residual = residual(deformer);
  deformer->outcome = outcome;
  exm_status const status = blended_warn_contradiction(b);
  return status == EXM_OK ? blended_warn_spread(b, b->held.targets, b->dimension) : status;
}

exm_status blended_deformer_add_rows(blended_deformer *deformer, const exm_rows *rows)
{
  arena scratch = {0};
  constraint_row *list = ARENA_NEW(&scratch, constraint_row, rows->count);
  exm_status status = list ? EXM_OK : status_no_memory("the constraints");
  for (size_t r = 0; r < rows->count && status == EXM_OK; r++) {
    size_t const first = rows->offsets[r];
    list[r] = (constraint_row){.handle = SIZE_MAX,
                               .term_count = rows->offsets[r + 1] - first,
                               .vertices = rows->vertices + first,
                               .weights = rows->coefficients + first};
  }
  if (status == EXM_OK) {
    status = blended_constraints_add(&deformer->solver, &deformer->atoms, rows->count, list, rows->weights);
  }
  arena_release(&scratch);
  return status;
}

/** New weights for all rows, of which `all` was filled in. */
static exm_status weigh(blended_deformer *deformer, const double *handles, size_t first, size_t count,
                        const double *rows)
{
  blended_constraints *c = &deformer->solver.held;
  arena scratch = {0};
  double *all = ARENA_NEW(&scratch, double, c->row_count);
  exm_status status = all ? EXM_OK : status_no_memory("the constraints");
  if (status == EXM_OK) {
    memcpy(all, c->weights, c->row_count * sizeof(double));
    for (size_t r = 0; r < c->handle_row_count && handles; r++) {
      all[r] = handles[c->rows[r].handle];
    }
    for (size_t i = 0; i < count; i++) {
      all[c->handle_row_count + first + i] = rows[i];
    }
    status = blended_constraints_weigh(&deformer->solver, all);
  }
  arena_release(&scratch);
  return status;
}

exm_status blended_deformer_weigh_rows(blended_deformer *deformer, size_t first, size_t count, const double *weights)
{
  return weigh(deformer, NULL, first, count, weights);
}

exm_status blended_deformer_weigh_handles(blended_deformer *deformer, const double *weights)
{
  size_t const H = deformer->base.info.handle_count;
  arena scratch = {0};
  double *own = ARENA_NEW(&scratch, double, H);
  exm_status status = own ? EXM_OK : status_no_memory("the constraints");
  for (size_t h = 0; h < H && own; h++) {
    own[h] = weights ? weights[h] : 1;
  }
  if (status == EXM_OK) {
    status = weigh(deformer, own, 0, 0, NULL);
  }
  if (status == EXM_OK) {
    memcpy(deformer->handle_weights, own, H * sizeof(double));
  }
  arena_release(&scratch);
  return status;
}

void blended_deformer_result_pose(const blended_deformer *deformer, double *targets)
{
  const space *s = &deformer->coordinates;
  size_t const d = s->dimension, joint = deformer->solver.joint_count;
  for (size_t r = 0; r < deformer->held.row_count; r++) {
    row_value(deformer, r, deformer->images + r * d);
  }
  for (size_t h = 0; h < deformer->base.info.handle_count; h++) {
    double linear[9] = {0}, in_caller[3][3], centre[3], point[3], *to = targets + 12 * h;
    constraints_frame(&deformer->held, d, h, deformer->images, d, linear);
    space_to_linear(s, linear, in_caller);
    dense_times(1, joint, d, deformer->centres + h * joint, deformer->placed, centre);
    space_to_point(s, centre, point);
    if (d == 2) {
      dense_axpy(3, deformer->heights[0] * s->unit, s->axes[2], point);
    }
    for (size_t k = 0; k < 3; k++) {
      memcpy(to + 4 * k, in_caller[k], 3 * sizeof(double));
      to[4 * k + 3] = point[k];
    }
  }
}

/* --------------------------------------------------------------------------------------------------------- methods */

static const blended_deformer *const_of(const exm_deformer *deformer)
{
  return (const blended_deformer *)deformer;
}

static void handle_pose(const exm_deformer *base, size_t exemplar, double *targets)
{
  size_t const size = base->info.handle_count * 12;
  memcpy(targets, const_of(base)->poses + exemplar * size, size * sizeof(double));
}

static void positions(const exm_deformer *deformer, int thread_count, float *out)
{
  skinning_apply(const_of(deformer)->skin, const_of(deformer)->affine, thread_count, out);
}

static void positions_f64(const exm_deformer *deformer, double *out)
{
  skinning_apply_f64(const_of(deformer)->skin, const_of(deformer)->affine, out);
}

static void release(exm_deformer *base)
{
  blended_deformer *deformer = (blended_deformer *)base;
  skinning_destroy(deformer->skin);
  arena_release(&deformer->solver.held.memory);
}

const deformer_methods blended_methods = {
    .handle_pose = handle_pose, .positions = positions, .positions_f64 = positions_f64, .release = release};
