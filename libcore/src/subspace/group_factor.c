/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/group_factor.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/** The triangles of one group, their corners renumbered, and the dictionary's values there. */
typedef struct patch {
  size_t triangle_count, vertex_count, column_count;
  const uint32_t *triangles; /* of the mesh, ascending */
  const double *shares;      /* of their corners that are in the group */
  uint32_t *vertices;        /* [vertex_count] of the mesh */
  uint32_t *local;           /* [V] where a vertex of the mesh is among them */
  size_t *columns;
  double *atoms; /* [vertex_count][column_count] */
} patch;

/** Triangles by group: one that touches two groups is listed in both. */
typedef struct incidence {
  size_t *offsets; /* [groups + 1] */
  uint32_t *triangles;
  double *shares;
} incidence;

/** The groups of a triangle's corners without repetition, with the share of each. */
static int corner_groups(const uint32_t triangle[3], const uint32_t *labels, uint32_t groups[3], double shares[3])
{
  int count = 0;
  for (int i = 0; i < 3; i++) {
    uint32_t const g = labels[triangle[i]];
    int at = 0;
    while (at < count && groups[at] != g) {
      at++;
    }
    if (at == count) {
      groups[count] = g;
      shares[count++] = 0;
    }
    shares[at] += 1.0 / 3;
  }
  return count;
}

static exm_status sort_triangles(arena *owner, const mesh *reference, const uint32_t *labels, size_t group_count,
                                 incidence *out)
{
  uint32_t groups[3];
  double shares[3];
  incidence in = {.offsets = ARENA_NEW(owner, size_t, group_count + 2),
                  .triangles = ARENA_NEW(owner, uint32_t, 3 * reference->triangle_count),
                  .shares = ARENA_NEW(owner, double, 3 * reference->triangle_count)};
  if (!in.offsets || !in.triangles || !in.shares) {
    return status_no_memory("the edge groups");
  }
  for (size_t t = 0; t < reference->triangle_count; t++) {
    for (int i = corner_groups(reference->triangles[t], labels, groups, shares); i-- > 0;) {
      in.offsets[groups[i] + 2]++;
    }
  }
  for (size_t g = 0; g < group_count; g++) {
    in.offsets[g + 2] += in.offsets[g + 1];
  }
  for (size_t t = 0; t < reference->triangle_count; t++) {
    for (int i = corner_groups(reference->triangles[t], labels, groups, shares); i-- > 0;) {
      size_t const at = in.offsets[groups[i] + 1]++;
      in.triangles[at] = (uint32_t)t;
      in.shares[at] = shares[i];
    }
  }
  *out = in;
  return EXM_OK;
}

static void find_vertices(const mesh *reference, patch *area)
{
  area->vertex_count = 0;
  for (size_t t = 0; t < area->triangle_count; t++) {
    for (int i = 0; i < 3; i++) {
      uint32_t const v = reference->triangles[area->triangles[t]][i];
      if (area->local[v] == UINT32_MAX) {
        area->local[v] = (uint32_t)area->vertex_count;
        area->vertices[area->vertex_count++] = v;
      }
    }
  }
}

/** The atoms of the handles that have weight on the patch, and their values there. */
static exm_status find_atoms(arena *owner, arena *scratch, const dictionary *d, patch *area)
{
  size_t *first_column = ARENA_NEW(scratch, size_t, d->handle_count);
  if (!first_column) {
    return status_no_memory("the edge groups");
  }
  for (size_t i = 0; i < area->vertex_count; i++) {
    size_t const v = area->vertices[i];
    for (size_t k = d->weight_offsets[v]; k < d->weight_offsets[v + 1]; k++) {
      first_column[d->weight_handles[k]] = 1;
    }
  }
  area->column_count = 0;
  for (size_t h = 0; h < d->handle_count; h++) {
    area->column_count += first_column[h] ? d->atom_offsets[h + 1] - d->atom_offsets[h] : 0;
  }
  area->columns = ARENA_NEW(owner, size_t, area->column_count);
  area->atoms = ARENA_NEW(scratch, double, area->vertex_count * area->column_count);
  if (!area->columns || !area->atoms) {
    return status_no_memory("the edge groups");
  }
  size_t next = 0;
  for (size_t h = 0; h < d->handle_count; h++) {
    if (first_column[h]) {
      first_column[h] = next;
      for (size_t a = d->atom_offsets[h]; a < d->atom_offsets[h + 1]; a++) {
        area->columns[next++] = a;
      }
    }
  }
  for (size_t i = 0; i < area->vertex_count; i++) {
    size_t const v = area->vertices[i];
    for (size_t k = d->weight_offsets[v]; k < d->weight_offsets[v + 1]; k++) {
      size_t const h = d->weight_handles[k];
      dictionary_atoms(d, h, v, d->weight_values[k], area->atoms + i * area->column_count + first_column[h]);
    }
  }
  return EXM_OK;
}

/** Two combinations of a triangle's edges a = f1 - f0, b = f2 - f0 whose squares sum to its Dirichlet energy
 *  c2 a^2 + c1 b^2 + c0 (a - b)^2: the Cholesky factor of that form, (x0 a + x1 b)^2 + (x2 b)^2. */
static void dirichlet_root(const double cotangents[3], double share, double root[3])
{
  double const aa = share * (cotangents[2] + cotangents[0]), ab = -share * cotangents[0],
               bb = share * (cotangents[1] + cotangents[0]);
  root[0] = aa > 0 ? sqrt(aa) : 0;
  root[1] = root[0] > 0 ? ab / root[0] : 0;
  root[2] = sqrt(fmax(bb - root[1] * root[1], 0));
}

static void gradient_rows(const mesh *reference, const patch *area, size_t t, double *out)
{
  const uint32_t *corners = reference->triangles[area->triangles[t]];
  double root[3];
  dirichlet_root(reference->cotangents[area->triangles[t]], area->shares[t], root);
  size_t const n = area->column_count;
  const double *f0 = area->atoms + area->local[corners[0]] * n, *f1 = area->atoms + area->local[corners[1]] * n,
               *f2 = area->atoms + area->local[corners[2]] * n;
  for (size_t j = 0; j < n; j++) {
    double const a = f1[j] - f0[j], b = f2[j] - f0[j];
    out[j] = root[0] * a + root[1] * b;
    out[n + j] = root[2] * b;
  }
}

/** Many triangles: QR of their gradients, a batch at a time under the triangle found so far. */
static exm_status factor_by_gradients(arena *owner, arena *scratch, const mesh *reference, const patch *area,
                                      group_factor *out)
{
  size_t const n = area->column_count, batch = 2 * (n > 32 ? n : 32);
  double *stack = ARENA_NEW(scratch, double, (n + 2 * batch) * n);
  out->rows = ARENA_NEW(owner, double, n *n);
  if (!stack || !out->rows) {
    return status_no_memory("the edge groups");
  }
  size_t kept = 0;
  for (size_t t = 0; t < area->triangle_count; t += batch) {
    size_t rows = kept;
    for (size_t i = t; i < t + batch && i < area->triangle_count; i++, rows += 2) {
      gradient_rows(reference, area, i, stack + rows * n);
    }
    TRY(dense_qr_factor(rows, n, stack));
    kept = rows < n ? rows : n;
  }
  memcpy(out->rows, stack, kept * n * sizeof(double));
  out->row_count = kept;
  return EXM_OK;
}

static void patch_laplacian(const mesh *reference, const patch *area, double *laplacian)
{
  size_t const n = area->vertex_count;
  for (size_t t = 0; t < area->triangle_count; t++) {
    const uint32_t *corners = reference->triangles[area->triangles[t]];
    for (int i = 0; i < 3; i++) {
      size_t const a = area->local[corners[(i + 1) % 3]], b = area->local[corners[(i + 2) % 3]];
      double const weight = area->shares[t] * reference->cotangents[area->triangles[t]][i];
      laplacian[a * n + a] += weight;
      laplacian[b * n + b] += weight;
      laplacian[a * n + b] -= weight;
      laplacian[b * n + a] -= weight;
    }
  }
}

/** Few vertices: the root of the patch's own Laplacian has fewer rows than there are atoms. */
static exm_status factor_by_vertices(arena *owner, arena *scratch, const mesh *reference, const patch *area,
                                     group_factor *out)
{
  size_t const n = area->vertex_count;
  double *laplacian = ARENA_NEW(scratch, double, n *n);
  double *values = ARENA_NEW(scratch, double, n);
  out->rows = ARENA_NEW(owner, double, n * area->column_count);
  out->root = ARENA_NEW(owner, double, n *n);
  out->vertices = ARENA_NEW(owner, uint32_t, n);
  if (!laplacian || !values || !out->rows || !out->root || !out->vertices) {
    return status_no_memory("the edge groups");
  }
  patch_laplacian(reference, area, laplacian);
  TRY(dense_eigen(n, laplacian, values));
  out->row_count = 0;
  for (size_t i = n; i-- > 0 && values[i] > 1e-13 * values[n - 1]; out->row_count++) {
    double *root = out->root + out->row_count * n;
    dense_axpy(n, sqrt(values[i]), laplacian + i * n, root);
    dense_times_transposed(n, area->column_count, 1, area->atoms, area->column_count, root,
                           out->rows + out->row_count * area->column_count);
  }
  out->vertex_count = n;
  memcpy(out->vertices, area->vertices, n * sizeof *out->vertices);
  return EXM_OK;
}

exm_status group_factors_create(arena *owner, const mesh *reference, const dictionary *d, const uint32_t *labels,
                                size_t group_count, const progress *report, group_factor *factors)
{
  arena scratch = {0};
  incidence in = {0};
  patch area = {.vertices = ARENA_NEW(&scratch, uint32_t, reference->vertex_count),
                .local = ARENA_NEW(&scratch, uint32_t, reference->vertex_count)};
  exm_status status = area.vertices && area.local ? EXM_OK : status_no_memory("the edge groups");
  if (status == EXM_OK) {
    status = sort_triangles(&scratch, reference, labels, group_count, &in);
  }
  for (size_t g = 0; g < group_count && status == EXM_OK; g++) {
    arena local = {0};
    area.triangle_count = in.offsets[g + 1] - in.offsets[g];
    area.triangles = in.triangles + in.offsets[g];
    area.shares = in.shares + in.offsets[g];
    memset(area.local, 0xff, reference->vertex_count * sizeof *area.local);
    find_vertices(reference, &area);
    status = find_atoms(owner, &local, d, &area);
    if (status == EXM_OK) {
      factors[g] = (group_factor){.column_count = area.column_count, .columns = area.columns};
      status = area.vertex_count > area.column_count ? factor_by_gradients(owner, &local, reference, &area, &factors[g])
                                                     : factor_by_vertices(owner, &local, reference, &area, &factors[g]);
    }
    arena_release(&local);
    if (status == EXM_OK) {
      status = progress_report(report, (double)(g + 1) / (double)group_count, "measuring the edge groups");
    }
  }
  arena_release(&scratch);
  return status;
}
