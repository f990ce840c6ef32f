/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/group_factor.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "subspace/patch.h"

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

/** A root of the patch's own Laplacian, [row_count][vertex_count]. */
static exm_status factor_vertices(arena *owner, arena *scratch, const mesh *reference, const patch *area,
                                  group_factor *out)
{
  size_t const n = area->vertex_count;
  double *laplacian = ARENA_NEW(scratch, double, n *n);
  double *values = ARENA_NEW(scratch, double, n);
  out->root = ARENA_NEW(owner, double, n *n);
  out->vertices = ARENA_NEW(owner, uint32_t, n);
  if (!laplacian || !values || !out->root || !out->vertices) {
    return status_no_memory("the edge groups");
  }
  patch_laplacian(reference, area, laplacian);
  TRY(dense_eigen(n, laplacian, values));
  out->row_count = 0;
  for (size_t i = n; i-- > 0 && values[i] > 1e-13 * values[n - 1]; out->row_count++) {
    dense_axpy(n, sqrt(values[i]), laplacian + i * n, out->root + out->row_count * n);
  }
  out->vertex_count = n;
  memcpy(out->vertices, area->vertices, n * sizeof *out->vertices);
  return EXM_OK;
}

/** Few vertices: that root has fewer rows than there are atoms. */
static exm_status factor_by_vertices(arena *owner, arena *scratch, const mesh *reference, const patch *area,
                                     group_factor *out)
{
  group_factor whole = {0};
  TRY(factor_vertices(scratch, scratch, reference, area, &whole));
  out->row_count = whole.row_count;
  out->rows = ARENA_NEW(owner, double, whole.row_count * area->column_count);
  if (!out->rows) {
    return status_no_memory("the edge groups");
  }
  dense_multiply(0, 0, whole.row_count, area->column_count, whole.vertex_count, 1, whole.root, area->atoms, 0,
                 out->rows);
  return EXM_OK;
}

static exm_status factor_over_atoms(arena *owner, arena *scratch, const mesh *reference, const patch *area,
                                    group_factor *out)
{
  *out = (group_factor){.column_count = area->column_count, .columns = area->columns};
  return area->vertex_count > area->column_count ? factor_by_gradients(owner, scratch, reference, area, out)
                                                 : factor_by_vertices(owner, scratch, reference, area, out);
}

/** d NULL: over vertices. */
static exm_status factor_groups(arena *owner, const mesh *reference, const dictionary *d, const uint32_t *labels,
                                size_t group_count, const progress *report, group_factor *factors)
{
  arena scratch = {0};
  incidence in = {0};
  patch area;
  exm_status status = patch_create(&scratch, reference, &area);
  if (status == EXM_OK) {
    status = incidence_create(&scratch, reference, labels, group_count, &in);
  }
  for (size_t g = 0; g < group_count && status == EXM_OK; g++) {
    arena local = {0};
    status = patch_begin(owner, &local, reference, d, &in, g, &area);
    factors[g] = (group_factor){0};
    if (status == EXM_OK) {
      status = d ? factor_over_atoms(owner, &local, reference, &area, &factors[g])
                 : factor_vertices(owner, &local, reference, &area, &factors[g]);
    }
    arena_release(&local);
    if (status == EXM_OK) {
      status = progress_report(report, (double)(g + 1) / (double)group_count, "measuring the edge groups");
    }
  }
  arena_release(&scratch);
  return status;
}

exm_status group_factors_create(arena *owner, const mesh *reference, const dictionary *d, const uint32_t *labels,
                                size_t group_count, const progress *report, group_factor *factors)
{
  return factor_groups(owner, reference, d, labels, group_count, report, factors);
}

exm_status group_roots_create(arena *owner, const mesh *reference, const uint32_t *labels, size_t group_count,
                              const progress *report, group_factor *factors)
{
  return factor_groups(owner, reference, NULL, labels, group_count, report, factors);
}
