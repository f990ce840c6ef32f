/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/constraints.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Second moments below this share of the largest count as flat: fitting a map along them would amplify their noise by a
 * factor of 30 and more. */
static double const FLAT = 1e-3;
/* A handle of one vertex grows by rings until it spans a plane (a line in two dimensions does not). */
enum { RINGS_MAXIMUM = 10 };

/** The vertices that a handle's frame is fitted to: its own, or with rings around them. */
typedef struct support {
  uint32_t *vertices;
  size_t count;
  unsigned char *is_inside; /* [V] */
} support;

static void grow(const mesh *reference, support *area)
{
  size_t const before = area->count;
  for (size_t i = 0; i < before; i++) {
    uint32_t const v = area->vertices[i];
    for (uint32_t j = reference->neighbor_offsets[v]; j < reference->neighbor_offsets[v + 1]; j++) {
      uint32_t const u = reference->neighbors[j];
      if (!area->is_inside[u]) {
        area->is_inside[u] = 1;
        area->vertices[area->count++] = u;
      }
    }
  }
}

/** Mean and second moments of the support, by eigenvectors: rows of axes, falling moments. */
static exm_status moments(const mesh *reference, const space *s, const support *area, double mean[3], double axes[3][3],
                          double values[3])
{
  size_t const d = s->dimension;
  double covariance[9] = {0}, rising[3], x[3];
  memset(mean, 0, 3 * sizeof(double));
  for (size_t i = 0; i < area->count; i++) {
    space_from_point(s, reference->positions[area->vertices[i]], x);
    dense_axpy(d, 1.0 / (double)area->count, x, mean);
  }
  for (size_t i = 0; i < area->count; i++) {
    space_from_point(s, reference->positions[area->vertices[i]], x);
    for (size_t a = 0; a < d; a++) {
      for (size_t b = 0; b < d; b++) {
        covariance[a * d + b] += (x[a] - mean[a]) * (x[b] - mean[b]);
      }
    }
  }
  TRY(dense_eigen(d, covariance, rising));
  for (size_t a = 0; a < d; a++) {
    values[a] = rising[d - 1 - a];
    memcpy(axes[a], covariance + (d - 1 - a) * d, d * sizeof(double));
  }
  return EXM_OK;
}

static size_t spanned(size_t dimension, const double values[3])
{
  size_t rank = 0;
  while (rank < dimension && values[rank] > FLAT * values[0] && values[rank] > 0) {
    rank++;
  }
  return rank;
}

/** Room for one row's terms; the caller fills the weights. */
static exm_status add_row(arena *owner, constraints *c, constraint_row row, const uint32_t *vertices, double **weights)
{
  uint32_t *copy = ARENA_NEW(owner, uint32_t, row.term_count);
  *weights = ARENA_NEW(owner, double, row.term_count);
  if (!copy || !*weights) {
    return status_no_memory("the handle constraints");
  }
  memcpy(copy, vertices, row.term_count * sizeof *copy);
  row.vertices = copy;
  row.weights = *weights;
  c->rows[c->row_count++] = row;
  return EXM_OK;
}

static exm_status frame_rows(arena *owner, const mesh *reference, const space *s, size_t handle, support *area,
                             constraints *c)
{
  double mean[3] = {0}, axes[3][3] = {{0}}, values[3] = {0}, x[3] = {0};
  TRY(moments(reference, s, area, mean, axes, values));
  for (int ring = 0; ring < RINGS_MAXIMUM && spanned(s->dimension, values) < 2; ring++) {
    grow(reference, area);
    TRY(moments(reference, s, area, mean, axes, values));
  }
  size_t const rank = spanned(s->dimension, values);
  for (size_t j = 0; j < rank; j++) {
    constraint_row row = {.handle = handle, .is_frame = 1, .term_count = area->count};
    double *weights;
    memcpy(row.direction, axes[j], s->dimension * sizeof(double));
    TRY(add_row(owner, c, row, area->vertices, &weights));
    for (size_t i = 0; i < area->count; i++) {
      space_from_point(s, reference->positions[area->vertices[i]], x);
      for (size_t k = 0; k < s->dimension; k++) {
        weights[i] += (x[k] - mean[k]) * axes[j][k] / values[j];
      }
    }
  }
  return EXM_OK;
}

static exm_status position_row(arena *owner, size_t handle, const support *area, constraints *c)
{
  double *weights;
  TRY(add_row(owner, c, (constraint_row){.handle = handle, .term_count = area->count}, area->vertices, &weights));
  for (size_t i = 0; i < area->count; i++) {
    weights[i] = 1.0 / (double)area->count;
  }
  return EXM_OK;
}

static void own_vertices(const mesh *reference, const exm_handles *handles, size_t handle, support *area)
{
  memset(area->is_inside, 0, reference->vertex_count);
  area->count = 0;
  for (size_t i = handles->vertex_offsets[handle]; i < handles->vertex_offsets[handle + 1]; i++) {
    area->vertices[area->count++] = handles->vertices[i];
    area->is_inside[handles->vertices[i]] = 1;
  }
}

exm_status constraints_create(arena *owner, const mesh *reference, const exm_handles *handles, const space *s,
                              constraints *out)
{
  constraints c = {0};
  arena scratch = {0};
  exm_status status = EXM_OK;
  support area = {.vertices = ARENA_NEW(&scratch, uint32_t, reference->vertex_count),
                  .is_inside = ARENA_NEW(&scratch, unsigned char, reference->vertex_count)};
  c.rows = ARENA_NEW(owner, constraint_row, handles->count * (1 + s->dimension));
  if (!area.vertices || !area.is_inside || !c.rows) {
    status = status_no_memory("the handle constraints");
    goto done;
  }
  for (size_t h = 0; h < handles->count && status == EXM_OK; h++) {
    if (handles->kinds[h] == EXM_HANDLE_FREE) {
      continue;
    }
    own_vertices(reference, handles, h, &area);
    status = position_row(owner, h, &area, &c);
    if (status == EXM_OK && handles->kinds[h] == EXM_HANDLE_ORIENTED) {
      status = frame_rows(owner, reference, s, h, &area, &c);
    }
  }
  *out = c;
done:
  arena_release(&scratch);
  return status;
}

void constraints_targets(const constraints *c, const space *s, const double *targets, double *out)
{
  size_t const d = s->dimension;
  for (size_t i = 0; i < c->row_count; i++) {
    const constraint_row *row = &c->rows[i];
    const double *target = targets + row->handle * 12;
    if (!row->is_frame) {
      double const point[3] = {target[3], target[7], target[11]};
      space_from_point(s, point, out + i * d);
      continue;
    }
    double const linear[3][3] = {
        {target[0], target[1], target[2]}, {target[4], target[5], target[6]}, {target[8], target[9], target[10]}};
    double in_space[9];
    space_from_linear(s, linear, in_space);
    dense_times(d, d, 1, in_space, row->direction, out + i * d);
  }
}

void constraints_on_exemplars(const constraints *c, const dictionary *d, double *out)
{
  size_t const width = d->exemplar_count * d->dimension;
  memset(out, 0, c->row_count * width * sizeof(double));
  for (size_t i = 0; i < c->row_count; i++) {
    const constraint_row *row = &c->rows[i];
    for (size_t t = 0; t < row->term_count; t++) {
      dense_axpy(width, row->weights[t], d->exemplars + row->vertices[t] * width, out + i * width);
    }
  }
}

void constraints_on_pose(const constraints *c, const space *s, const float *pose, double *out)
{
  double x[3];
  memset(out, 0, c->row_count * s->dimension * sizeof(double));
  for (size_t i = 0; i < c->row_count; i++) {
    const constraint_row *row = &c->rows[i];
    for (size_t t = 0; t < row->term_count; t++) {
      const float *from = pose + 3 * (size_t)row->vertices[t];
      double const point[3] = {(double)from[0], (double)from[1], (double)from[2]};
      space_from_point(s, point, x);
      dense_axpy(s->dimension, row->weights[t], x, out + i * s->dimension);
    }
  }
}

void constraints_matrix(const constraints *c, const dictionary *d, double *scratch, double *out)
{
  memset(out, 0, c->row_count * d->atom_count * sizeof(double));
  for (size_t i = 0; i < c->row_count; i++) {
    const constraint_row *row = &c->rows[i];
    for (size_t t = 0; t < row->term_count; t++) {
      size_t const v = row->vertices[t];
      for (size_t k = d->weight_offsets[v]; k < d->weight_offsets[v + 1]; k++) {
        size_t const h = d->weight_handles[k], first = d->atom_offsets[h];
        dictionary_atoms(d, h, v, d->weight_values[k], scratch);
        dense_axpy(d->atom_offsets[h + 1] - first, row->weights[t], scratch, out + i * d->atom_count + first);
      }
    }
  }
}

void constraints_frame(const constraints *c, size_t d, size_t handle, const double *images, size_t stride,
                       double *linear)
{
  double directions[3][3] = {{0}}, image[3][3] = {{0}};
  size_t count = 0;
  for (size_t i = 0; i < c->row_count; i++) {
    const constraint_row *row = &c->rows[i];
    if (row->handle == handle && row->is_frame && count < 3) {
      memcpy(directions[count], row->direction, d * sizeof(double));
      memcpy(image[count++], images + i * stride, d * sizeof(double));
    }
  }
  if (d == 3 && count == 2) {
    double length = 0;
    for (int k = 0; k < 3; k++) {
      int const i = (k + 1) % 3, j = (k + 2) % 3;
      directions[2][k] = directions[0][i] * directions[1][j] - directions[0][j] * directions[1][i];
      image[2][k] = image[0][i] * image[1][j] - image[0][j] * image[1][i];
      length += image[2][k] * image[2][k];
    }
    for (int k = 0; k < 3 && length > 0; k++) {
      image[2][k] /= sqrt(length);
    }
    count = 3;
  }
  if (count < d) {
    for (size_t i = 0; i < d; i++) {
      for (size_t j = 0; j < d; j++) {
        linear[i * d + j] = (i == j) + (image[0][i] - directions[0][i]) * directions[0][j];
      }
    }
    return;
  }
  for (size_t a = 0; a < d; a++) {
    for (size_t b = 0; b < d; b++) {
      for (size_t j = 0; j < d; j++) {
        linear[a * d + b] += image[j][a] * directions[j][b];
      }
    }
  }
}
