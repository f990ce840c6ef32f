/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The reduced mesh where all positions are free. */
#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "subspace/reduced.h"

/* As in reduced.c. */
static double const SHAPE_TOLERANCE = 1e-11;

/** The exemplars' proxies E = root x positions of one group, and the root itself to be turned with them. */
static exm_status gather_group(arena *scratch, const dictionary *d, const group_factor *root, double **E, double **A)
{
  size_t const width = d->exemplar_count * d->dimension, n = root->vertex_count;
  *E = ARENA_NEW(scratch, double, root->row_count *width);
  *A = ARENA_NEW(scratch, double, root->row_count *n);
  if (!*E || !*A) {
    return status_no_memory("the reduced operators");
  }
  memcpy(*A, root->root, root->row_count * n * sizeof(double));
  for (size_t i = 0; i < root->row_count; i++) {
    for (size_t k = 0; k < n; k++) {
      dense_axpy(width, root->root[i * n + k], d->exemplars + root->vertices[k] * width, *E + i * width);
    }
  }
  return EXM_OK;
}

static exm_status append_group(arena *owner, const group_factor *root, size_t g, size_t shape_rank, const double *E,
                               const double *A, reduced_mesh *r)
{
  size_t const n = root->vertex_count, width = r->exemplar_count * r->dimension, rest = root->row_count - shape_rank;
  reduced_carriers *c = r->carriers;
  c->shapes[g] = ARENA_NEW(owner, double, shape_rank *n);
  c->rest[g] = ARENA_NEW(owner, double, rest *n);
  if (!c->shapes[g] || !c->rest[g]) {
    return status_no_memory("the reduced operators");
  }
  memcpy(c->shapes[g], A, shape_rank * n * sizeof(double));
  memcpy(c->rest[g], A + shape_rank * n, rest * n * sizeof(double));
  memcpy(r->shapes + r->shape_offsets[g] * width, E, shape_rank * width * sizeof(double));
  if (n > 0) {
    memcpy(c->indices + c->offsets[g], root->vertices, n * sizeof *c->indices);
  }
  c->offsets[g + 1] = c->offsets[g] + n;
  r->shape_offsets[g + 1] = r->shape_offsets[g] + shape_rank;
  r->rest_offsets[g + 1] = r->rest_offsets[g] + rest;
  return EXM_OK;
}

static exm_status allocate(arena *owner, const group_factor *roots, reduced_mesh *r)
{
  size_t const width = r->exemplar_count * r->dimension, G = r->group_count;
  size_t shape_bound = 0, carriers = 0;
  for (size_t g = 0; g < G; g++) {
    shape_bound += roots[g].row_count < width ? roots[g].row_count : width;
    carriers += roots[g].vertex_count;
  }
  reduced_carriers *c = r->carriers;
  r->shape_offsets = ARENA_NEW(owner, size_t, G + 1);
  r->rest_offsets = ARENA_NEW(owner, size_t, G + 1);
  r->shapes = ARENA_NEW(owner, double, shape_bound *width);
  c->offsets = ARENA_NEW(owner, size_t, G + 1);
  c->indices = ARENA_NEW(owner, uint32_t, carriers);
  c->shapes = ARENA_NEW(owner, double *, G);
  c->rest = ARENA_NEW(owner, double *, G);
  r->exemplar_targets = ARENA_NEW(owner, double, r->constraint_count *width);
  r->is_frame_row = ARENA_NEW(owner, unsigned char, r->constraint_count);
  if (!r->shape_offsets || !r->rest_offsets || !r->shapes || !c->offsets || !c->indices || !c->shapes || !c->rest ||
      !r->exemplar_targets || !r->is_frame_row) {
    return status_no_memory("the reduced operators");
  }
  return EXM_OK;
}

static exm_status turn_groups(arena *owner, const dictionary *d, const group_factor *roots, reduced_mesh *r)
{
  size_t const width = r->exemplar_count * r->dimension;
  exm_status status = EXM_OK;
  for (size_t g = 0; g < r->group_count && status == EXM_OK; g++) {
    arena scratch = {0};
    double *E = NULL, *A = NULL;
    size_t shape_rank = 0;
    if ((status = gather_group(&scratch, d, &roots[g], &E, &A)) == EXM_OK &&
        (status = dense_rotate_rows(roots[g].row_count, width, E, roots[g].vertex_count, A, SHAPE_TOLERANCE,
                                    &shape_rank)) == EXM_OK) {
      status = append_group(owner, &roots[g], g, shape_rank, E, A, r);
    }
    arena_release(&scratch);
  }
  r->shape_rows = r->shape_offsets[r->group_count];
  r->rest_rows = r->rest_offsets[r->group_count];
  r->size = sqrt(dense_dot(r->shape_rows * width, r->shapes, r->shapes) / (double)r->exemplar_count);
  return status;
}

exm_status reduced_create_whole(arena *owner, const mesh *reference, const dictionary *d, const constraints *c,
                                const group_factor *roots, size_t group_count, const progress *report,
                                reduced_mesh *out)
{
  *out = (reduced_mesh){.dimension = d->dimension,
                        .group_count = group_count,
                        .exemplar_count = d->exemplar_count,
                        .constraint_count = c->row_count,
                        .atom_count = reference->vertex_count,
                        .carriers = ARENA_NEW(owner, reduced_carriers, 1)};
  if (!out->carriers) {
    return status_no_memory("the reduced operators");
  }
  TRY(allocate(owner, roots, out));
  constraints_on_exemplars(c, d, out->exemplar_targets);
  for (size_t i = 0; i < c->row_count; i++) {
    out->is_frame_row[i] = c->rows[i].is_frame != 0;
  }
  TRY(vertices_create(owner, reference, c, &out->carriers->space));
  out->rank = out->carriers->space.kept_count;
  TRY(progress_report(report, 0.5, "reducing the mesh"));
  return turn_groups(owner, d, roots, out);
}

void reduced_release(reduced_mesh *r)
{
  if (r->carriers) {
    vertices_destroy(&r->carriers->space);
  }
}
