/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "deform/amrap/amrap.h"
#include "linalg/dense.h"

/* Steps that the accelerations remember. */
enum { SINGLE_DEPTH = 6, DEPTH = 8 };

/** Shapes of exemplar s alone, [shape_rows][d]. */
static void exemplar_shapes(const reduced_mesh *r, size_t s, double *out)
{
  for (size_t i = 0; i < r->shape_rows; i++) {
    memcpy(out + i * r->dimension, r->shapes + (i * r->exemplar_count + s) * r->dimension,
           r->dimension * sizeof(double));
  }
}

/** out [G d][n] += shapes_s' M of each group's rows, M [shape_rows][n]. */
static void contract(const reduced_mesh *r, const double *shapes, const double *M, size_t n, double *out)
{
  size_t const d = r->dimension;
  memset(out, 0, r->group_count * d * n * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
      for (size_t k = 0; k < d; k++) {
        dense_axpy(n, shapes[i * d + k], M + i * n, out + (g * d + k) * n);
      }
    }
  }
}

static exm_status single_operators(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, stacked = r->group_count * d, rows = r->shape_rows, bound = r->constraint_count;
  arena scratch = {0};
  exm_status status = EXM_OK;
  double *shapes = ARENA_NEW(&scratch, double, rows *d);
  double *half = ARENA_NEW(&scratch, double, stacked *rows);
  double *turned = ARENA_NEW(&scratch, double, stacked *rows);
  double *G = ARENA_NEW(&scratch, double, rows *rows);
  double *carried = ARENA_NEW(&scratch, double, r->carrier_count *rows);
  a->Gs = ARENA_NEW(owner, double, r->exemplar_count *stacked *stacked);
  a->Fs = ARENA_NEW(owner, double, r->exemplar_count *stacked *bound);
  a->FF = ARENA_NEW(owner, double, bound *bound);
  if (!shapes || !half || !turned || !G || !carried || !a->Gs || !a->Fs || !a->FF) {
    status = status_no_memory("the deformer");
    goto done;
  }
  reduced_green(r, carried, G);
  for (size_t s = 0; s < r->exemplar_count; s++) {
    exemplar_shapes(r, s, shapes);
    contract(r, shapes, G, rows, half);
    dense_transpose(stacked, rows, half, turned);
    contract(r, shapes, turned, stacked, a->Gs + s * stacked * stacked);
    contract(r, shapes, r->Fx, bound, a->Fs + s * stacked * bound);
  }
  dense_multiply(1, 0, bound, bound, r->shape_rows, 1, r->Fx, r->Fx, 0, a->FF);
  dense_multiply(1, 0, bound, bound, r->rest_rows, 1, r->Fr, r->Fr, 1, a->FF);
done:
  arena_release(&scratch);
  return status;
}

static exm_status state(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, G = r->group_count, rows = r->shape_rows;
  a->c = ARENA_NEW(owner, double, r->constraint_count *d);
  a->Fxc = ARENA_NEW(owner, double, rows *d);
  a->single_rotations = ARENA_NEW(owner, double, S *G *d *d);
  a->carried = ARENA_NEW(owner, double, (2 * r->carrier_count + r->rank) * S * d);
  a->D = ARENA_NEW(owner, double, G *S);
  a->rotations = ARENA_NEW(owner, double, G *S *d *d);
  a->B = ARENA_NEW(owner, double, G *S);
  a->u = ARENA_NEW(owner, double, r->rank *d);
  a->y = ARENA_NEW(owner, double, rows *d);
  a->X = ARENA_NEW(owner, double, rows *d);
  a->fit = ARENA_NEW(owner, double, 2 * S * G * d * d);
  a->single_blend = ARENA_NEW(owner, double, rows *S *d);
  a->single_shapes = ARENA_NEW(owner, double, rows *S *d);
  a->single_rest = ARENA_NEW(owner, double, r->rest_rows *S *d);

  a->turned_G = ARENA_NEW(owner, double, rows *d);
  a->misfit = ARENA_NEW(owner, double, rows *d);
  a->rest_scratch = ARENA_NEW(owner, double, 2 * (r->rank + r->constraint_count) * d);
  a->damped_u = ARENA_NEW(owner, double, r->rank *d);
  a->global_u = ARENA_NEW(owner, double, r->rank *S *d);
  a->saved_u = ARENA_NEW(owner, double, r->rank *d);
  a->slope = ARENA_NEW(owner, double, r->rank *d);
  a->saved_B = ARENA_NEW(owner, double, G *S);
  a->fit_image = ARENA_NEW(owner, double, G *d *d);
  a->fit_fallback = ARENA_NEW(owner, double, G *d *d);
  a->mixed_u = ARENA_NEW(owner, double, r->rank *d);
  a->wanted = ARENA_NEW(owner, unsigned char, G *S);
  if (!a->c || !a->Fxc || !a->single_rotations || !a->carried || !a->D || !a->rotations || !a->B || !a->u || !a->y ||
      !a->X || !a->fit || !a->single_blend || !a->single_shapes || !a->single_rest || !a->turned_G || !a->misfit ||
      !a->rest_scratch || !a->damped_u || !a->global_u || !a->saved_u || !a->slope || !a->saved_B || !a->fit_image ||
      !a->fit_fallback || !a->mixed_u || !a->wanted) {
    return status_no_memory("the deformer");
  }
  TRY(anderson_create(owner, G * d * d, SINGLE_DEPTH, &a->single_mixing));
  return anderson_create(owner, r->rank * d, DEPTH, &a->mixing);
}

static size_t columns_per_group(const reduced_mesh *r)
{
  size_t const share = AMRAP_COLUMNS / r->group_count;
  size_t const most = share > AMRAP_COLUMNS_PER_GROUP ? share : AMRAP_COLUMNS_PER_GROUP;
  return r->exemplar_count < most ? r->exemplar_count : most;
}

static exm_status blend_program(arena *owner, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const S = r->exemplar_count;
  a->columns_per_group = columns_per_group(r);
  a->slopes = ARENA_NEW(owner, double, S);
  size_t const local = r->group_count * a->columns_per_group;
  size_t const limit = local > S ? local : S; /* or one global blend */
  size_t turned = 0, carried = 0, longest = 0;
  for (size_t g = 0; g < r->group_count; g++) {
    size_t const carriers = r->carrier_count ? r->carrier_offsets[g + 1] - r->carrier_offsets[g] : 0;
    turned += (r->shape_offsets[g + 1] - r->shape_offsets[g]) * a->columns_per_group * r->dimension;
    carried += carriers * a->columns_per_group * r->dimension;
    longest = carriers > longest ? carriers : longest;
  }
  a->column_limit = limit;
  a->turned = ARENA_NEW(owner, double, turned);
  a->turned_carried = ARENA_NEW(owner, double, carried);
  a->carried_offsets = ARENA_NEW(owner, size_t, limit);
  a->green_rows = ARENA_NEW(owner, double, longest * r->carrier_count);
  a->columns_G = ARENA_NEW(owner, double, (r->carrier_count ? r->carrier_count : r->shape_rows) * r->dimension);
  a->column_group = ARENA_NEW(owner, size_t, limit);
  a->column_shape = ARENA_NEW(owner, size_t, limit);
  a->turned_offsets = ARENA_NEW(owner, size_t, limit);
  a->block_offsets = ARENA_NEW(owner, size_t, r->group_count + 1);
  a->Q = ARENA_NEW(owner, double, limit *limit);
  a->p = ARENA_NEW(owner, double, limit);
  a->l = ARENA_NEW(owner, double, limit);
  a->unknown = ARENA_NEW(owner, double, limit);
  if (!a->turned || !a->turned_carried || !a->carried_offsets || !a->slopes || !a->green_rows || !a->columns_G ||
      !a->column_group || !a->column_shape || !a->turned_offsets || !a->block_offsets || !a->Q || !a->p || !a->l ||
      !a->unknown) {
    return status_no_memory("the deformer");
  }
  return cone_workspace_create(owner, limit, &a->cone);
}

exm_status amrap_prepare(arena *owner, const reduced_mesh *reduced, const double *group_shares, amrap *out)
{
  amrap a = {.reduced = *reduced};
  a.group_shares = ARENA_NEW(owner, double, reduced->group_count);
  if (!a.group_shares) {
    return status_no_memory("the deformer");
  }
  memcpy(a.group_shares, group_shares, reduced->group_count * sizeof(double));
  TRY(single_operators(owner, &a));
  TRY(state(owner, &a));
  TRY(blend_program(owner, &a));
  *out = a;
  return EXM_OK;
}
