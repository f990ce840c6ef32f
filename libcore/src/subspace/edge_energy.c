/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/edge_energy.h"

#include <string.h>

#include "linalg/dense.h"
#include "subspace/patch.h"

/** One group's share of everything. */
typedef struct piece {
  double *stiff;       /* [vertices][columns] L_g D */
  double *poses;       /* [vertices][S d] */
  double *weighted;    /* [vertices][columns] M D of the vertices that are the group's own */
  double *laplacian;   /* [columns][columns] */
  double *masses;      /* [columns][columns] */
  double *proxies;     /* [S d][columns] */
  double *stiff_poses; /* [vertices][S d] */
} piece;

static exm_status piece_create(arena *scratch, const patch *area, size_t width, piece *out)
{
  size_t const n = area->vertex_count, c = area->column_count;
  *out = (piece){.stiff = ARENA_NEW(scratch, double, n *c),
                 .poses = ARENA_NEW(scratch, double, n *width),
                 .weighted = ARENA_NEW(scratch, double, n *c),
                 .laplacian = ARENA_NEW(scratch, double, c *c),
                 .masses = ARENA_NEW(scratch, double, c *c),
                 .proxies = ARENA_NEW(scratch, double, width *c),
                 .stiff_poses = ARENA_NEW(scratch, double, n *width)};
  if (!out->stiff || !out->poses || !out->weighted || !out->laplacian || !out->masses || !out->proxies ||
      !out->stiff_poses) {
    return status_no_memory("the edge groups");
  }
  return EXM_OK;
}

/** y += L_g x for the patch, x and y [vertices][width]. */
static void stiffen(const mesh *reference, const patch *area, size_t width, const double *x, double *y)
{
  for (size_t t = 0; t < area->triangle_count; t++) {
    const uint32_t *corners = reference->triangles[area->triangles[t]];
    for (int i = 0; i < 3; i++) {
      size_t const a = area->local[corners[(i + 1) % 3]], b = area->local[corners[(i + 2) % 3]];
      double const weight = area->shares[t] * reference->cotangents[area->triangles[t]][i];
      for (size_t k = 0; k < width; k++) {
        double const flow = weight * (x[a * width + k] - x[b * width + k]);
        y[a * width + k] += flow;
        y[b * width + k] -= flow;
      }
    }
  }
}

static void measure(const mesh *reference, const dictionary *d, const uint32_t *labels, size_t group, const patch *area,
                    double total, piece *p)
{
  size_t const n = area->vertex_count, c = area->column_count, width = d->exemplar_count * d->dimension;
  for (size_t i = 0; i < n; i++) {
    size_t const v = area->vertices[i];
    memcpy(p->poses + i * width, d->exemplars + v * width, width * sizeof(double));
    if (labels[v] == group) {
      dense_axpy(c, reference->masses[v] / total, area->atoms + i * c, p->weighted + i * c);
    }
  }
  stiffen(reference, area, c, area->atoms, p->stiff);
  stiffen(reference, area, width, p->poses, p->stiff_poses);
  dense_multiply(1, 0, c, c, n, 1, area->atoms, p->stiff, 0, p->laplacian);
  dense_multiply(1, 0, c, c, n, 1, area->atoms, p->weighted, 0, p->masses);
  dense_multiply(1, 0, width, c, n, 1, p->poses, p->stiff, 0, p->proxies);
}

/** Add a group's share where its atoms are among all. */
static void scatter(const patch *area, const piece *p, size_t group, size_t vertices, edge_energy *e)
{
  size_t const b = e->atom_count, c = area->column_count, d = e->dimension, width = e->exemplar_count * d;
  for (size_t i = 0; i < c; i++) {
    for (size_t j = 0; j < c; j++) {
      size_t const at = area->columns[i] * b + area->columns[j];
      e->laplacian[at] += p->laplacian[i * c + j];
      e->masses[at] += p->masses[i * c + j];
    }
  }
  for (size_t k = 0; k < width; k++) {
    double *row = e->proxies + ((k / d * e->group_count + group) * d + k % d) * b;
    for (size_t j = 0; j < c; j++) {
      row[area->columns[j]] = p->proxies[k * c + j];
    }
  }
  for (size_t i = 0; i < vertices; i++) {
    for (size_t k = 0; k < width; k++) {
      e->own[k / d] += p->poses[i * width + k] * p->stiff_poses[i * width + k];
    }
  }
}

static exm_status add_group(const mesh *reference, const dictionary *d, const uint32_t *labels, const incidence *in,
                            size_t group, double total, patch *area, edge_energy *e)
{
  arena scratch = {0};
  piece p;
  exm_status status = patch_begin(&scratch, &scratch, reference, d, in, group, area);
  if (status == EXM_OK) {
    status = piece_create(&scratch, area, d->exemplar_count * d->dimension, &p);
  }
  if (status == EXM_OK) {
    measure(reference, d, labels, group, area, total, &p);
    scatter(area, &p, group, area->vertex_count, e);
  }
  arena_release(&scratch);
  return status;
}

exm_status edge_energy_create(arena *owner, const mesh *reference, const dictionary *d, const uint32_t *labels,
                              size_t group_count, const progress *report, edge_energy *out)
{
  size_t const b = d->atom_count;
  arena scratch = {0};
  incidence in;
  patch area;
  double total = 0;
  edge_energy e = {.atom_count = b,
                   .group_count = group_count,
                   .exemplar_count = d->exemplar_count,
                   .dimension = d->dimension,
                   .laplacian = ARENA_NEW(owner, double, b *b),
                   .masses = ARENA_NEW(owner, double, b *b),
                   .proxies = ARENA_NEW(owner, double, d->exemplar_count *group_count * d->dimension * b),
                   .own = ARENA_NEW(owner, double, d->exemplar_count)};
  exm_status status = patch_create(&scratch, reference, &area);
  if (!e.laplacian || !e.masses || !e.proxies || !e.own) {
    status = status_no_memory("the edge groups");
  }
  if (status == EXM_OK) {
    status = incidence_create(&scratch, reference, labels, group_count, &in);
  }
  for (size_t v = 0; v < reference->vertex_count; v++) {
    total += reference->masses[v];
  }
  for (size_t g = 0; g < group_count && status == EXM_OK; g++) {
    status = add_group(reference, d, labels, &in, g, total, &area, &e);
    if (status == EXM_OK) {
      status = progress_report(report, (double)(g + 1) / (double)group_count, "measuring the edge groups");
    }
  }
  *out = e;
  arena_release(&scratch);
  return status;
}
