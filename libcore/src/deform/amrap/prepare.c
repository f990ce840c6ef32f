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
  a->Gs = ARENA_NEW(owner, double, r->exemplar_count *stacked *stacked);
  a->Fs = ARENA_NEW(owner, double, r->exemplar_count *stacked *bound);
  if (!shapes || !half || !turned || !a->Gs || !a->Fs) {
    status = status_no_memory("the deformer");
    goto done;
  }
  for (size_t s = 0; s < r->exemplar_count; s++) {
    exemplar_shapes(r, s, shapes);
    contract(r, shapes, r->G, rows, half);
    dense_transpose(stacked, rows, half, turned);
    contract(r, shapes, turned, stacked, a->Gs + s * stacked * stacked);
    contract(r, shapes, r->Fx, bound, a->Fs + s * stacked * bound);
  }
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
  size_t const scratch = reduced_scratch(r) > r->rank ? reduced_scratch(r) : r->rank;
  a->carried = ARENA_NEW(owner, double, scratch *S *d);
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
  a->damped_u = ARENA_NEW(owner, double, r->rank *d);
  a->global_u = ARENA_NEW(owner, double, r->rank *S *d);
  a->saved_u = ARENA_NEW(owner, double, r->rank *d);
  a->slope = ARENA_NEW(owner, double, r->rank *d);
  a->saved_B = ARENA_NEW(owner, double, G *S);
  a->fit_image = ARENA_NEW(owner, double, G *d *d);
  a->fit_fallback = ARENA_NEW(owner, double, G *d *d);
  a->mixed_u = ARENA_NEW(owner, double, r->rank *d);
  a->wanted = ARENA_NEW(owner, unsigned char, G *S);
  a->moments = ARENA_NEW(owner, double, d *S *d);
  a->stacked = ARENA_NEW(owner, double, (G * d + r->constraint_count) * d);
  if (!a->c || !a->Fxc || !a->single_rotations || !a->carried || !a->D || !a->rotations || !a->B || !a->u || !a->y ||
      !a->X || !a->fit || !a->single_blend || !a->single_shapes || !a->single_rest || !a->turned_G || !a->moments ||
      !a->stacked || !a->damped_u || !a->global_u || !a->saved_u || !a->slope || !a->saved_B || !a->fit_image ||
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
  size_t const local = r->group_count * a->columns_per_group;
  size_t const limit = local > S ? local : S; /* or one global blend */
  a->slopes = ARENA_NEW(owner, double, S);
  a->block_offsets = ARENA_NEW(owner, size_t, r->group_count + 1);
  a->Q = ARENA_NEW(owner, double, limit *limit);
  a->p = ARENA_NEW(owner, double, limit);
  a->l = ARENA_NEW(owner, double, limit);
  a->unknown = ARENA_NEW(owner, double, limit);
  if (!a->slopes || !a->block_offsets || !a->Q || !a->p || !a->l || !a->unknown) {
    return status_no_memory("the deformer");
  }
  TRY(amrap_columns_create(owner, a));
  return cone_workspace_create(owner, limit, &a->cone);
}

exm_status amrap_prepare(arena *owner, const double *group_shares, amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  a->group_shares = ARENA_NEW(owner, double, r->group_count);
  if (!a->group_shares) {
    return status_no_memory("the deformer");
  }
  memcpy(a->group_shares, group_shares, r->group_count * sizeof(double));
  if (r->carriers) {
    TRY(amrap_whole_create(owner, a));
  } else {
    TRY(single_operators(owner, a));
    TRY(amrap_roots_create(owner, a));
  }
  TRY(state(owner, a));
  return blend_program(owner, a);
}
