/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/dictionary.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Below this many columns a handle's atoms are kept as they are. */
enum { MIXTURE_MINIMUM = 24 };
/* Mixtures drop directions below this share of the largest, squared: a displacement of 1e-7 of the mesh's size, which
 * is float32's own rounding. */
static double const MIXTURE_TOLERANCE = 1e-14;

static exm_status keep_weights(arena *owner, const dictionary_source *source, dictionary *d)
{
  const float *weights = source->weights;
  size_t count = 0;
  for (size_t i = 0; i < d->handle_count * d->vertex_count; i++) {
    count += weights[i] != 0;
  }
  d->weight_offsets = ARENA_NEW(owner, size_t, d->vertex_count + 1);
  d->weight_handles = ARENA_NEW(owner, uint32_t, count);
  d->weight_values = ARENA_NEW(owner, double, count);
  if (!d->weight_offsets || !d->weight_handles || !d->weight_values) {
    return status_no_memory("the skinning weights");
  }
  size_t next = 0;
  for (size_t v = 0; v < d->vertex_count; v++) {
    double sum = 0;
    size_t const first = next;
    for (size_t h = 0; h < d->handle_count; h++) {
      float const weight = weights[h * d->vertex_count + v];
      if (weight != 0) {
        d->weight_handles[next] = (uint32_t)h;
        d->weight_values[next++] = (double)weight;
        sum += (double)weight;
      }
    }
    /* float32 columns sum to one only nearly; the exemplars are in the dictionary's span only if they do exactly. */
    for (size_t i = first; i < next && source->handles; i++) {
      d->weight_values[i] /= sum;
    }
    d->weight_offsets[v + 1] = next;
  }
  return EXM_OK;
}

static exm_status keep_exemplars(arena *owner, const float *poses, const space *s, dictionary *d)
{
  size_t const width = d->exemplar_count * d->dimension;
  d->exemplars = ARENA_NEW(owner, double, d->vertex_count *width);
  if (!d->exemplars) {
    return status_no_memory("the exemplars");
  }
  for (size_t e = 0; e < d->exemplar_count; e++) {
    for (size_t v = 0; v < d->vertex_count; v++) {
      const float *from = poses + (e * d->vertex_count + v) * 3;
      double const point[3] = {(double)from[0], (double)from[1], (double)from[2]};
      space_from_point(s, point, d->exemplars + v * width + e * d->dimension);
    }
  }
  return EXM_OK;
}

/** Every function's atoms are centred on the exemplars' centroids. */
static void find_centroids(const mesh *reference, dictionary *d)
{
  size_t const width = d->exemplar_count * d->dimension;
  double total = 0;
  for (size_t v = 0; v < d->vertex_count; v++) {
    dense_axpy(width, reference->masses[v], d->exemplars + v * width, d->centres);
    total += reference->masses[v];
  }
  for (size_t k = 0; k < width; k++) {
    d->centres[k] /= total;
  }
  for (size_t h = 1; h < d->handle_count; h++) {
    memcpy(d->centres + h * width, d->centres, width * sizeof(double));
  }
}

static exm_status find_centres(arena *owner, const mesh *reference, const exm_handles *handles, dictionary *d)
{
  size_t const width = d->exemplar_count * d->dimension;
  d->centres = ARENA_NEW(owner, double, d->handle_count *width);
  if (!d->centres) {
    return status_no_memory("the dictionary");
  }
  if (!handles) {
    find_centroids(reference, d);
    return EXM_OK;
  }
  for (size_t h = 0; h < d->handle_count; h++) {
    size_t const first = handles->vertex_offsets[h], last = handles->vertex_offsets[h + 1];
    for (size_t i = first; i < last; i++) {
      dense_axpy(width, 1.0 / (double)(last - first), d->exemplars + handles->vertices[i] * width,
                 d->centres + h * width);
    }
  }
  return EXM_OK;
}

/** grams [H][width][width]: second moments of the centred exemplars under each handle's weight. */
static void second_moments(const mesh *reference, const dictionary *d, size_t width, double *offset, double *grams)
{
  for (size_t v = 0; v < d->vertex_count; v++) {
    for (size_t i = d->weight_offsets[v]; i < d->weight_offsets[v + 1]; i++) {
      size_t const h = d->weight_handles[i];
      double const weight = d->weight_values[i] * d->weight_values[i] * reference->masses[v];
      for (size_t k = 0; k < width; k++) {
        offset[k] = d->exemplars[v * width + k] - d->centres[h * width + k];
      }
      for (size_t k = 0; k < width; k++) {
        dense_axpy(width, weight * offset[k], offset, grams + (h * width + k) * width);
      }
    }
  }
}

static exm_status mix_atoms(arena *owner, const mesh *reference, dictionary *d)
{
  size_t const width = d->exemplar_count * d->dimension;
  arena scratch = {0};
  exm_status status = EXM_OK;
  double *grams = ARENA_NEW(&scratch, double, d->handle_count *width *width);
  double *values = ARENA_NEW(&scratch, double, 2 * width);
  if (!grams || !values) {
    status = status_no_memory("the dictionary");
    goto done;
  }
  second_moments(reference, d, width, values + width, grams);
  for (size_t h = 0; h < d->handle_count && status == EXM_OK; h++) {
    double *gram = grams + h * width * width;
    status = dense_eigen(width, gram, values);
    size_t first = 0;
    while (first + 1 < width && values[first] <= MIXTURE_TOLERANCE * values[width - 1]) {
      first++;
    }
    d->mixtures[h] = ARENA_NEW(owner, double, (width - first) * width);
    if (!d->mixtures[h]) {
      status = status_no_memory("the dictionary");
      goto done;
    }
    memcpy(d->mixtures[h], gram + first * width, (width - first) * width * sizeof(double));
    d->atom_offsets[h + 1] = 1 + width - first;
  }
done:
  arena_release(&scratch);
  return status;
}

exm_status dictionary_create(arena *owner, const mesh *reference, const dictionary_source *source, const space *s,
                             dictionary *out)
{
  dictionary d = {.vertex_count = reference->vertex_count,
                  .handle_count = source->weight_count,
                  .exemplar_count = source->exemplar_count,
                  .dimension = s->dimension};
  size_t const width = d.exemplar_count * s->dimension;
  d.atom_offsets = ARENA_NEW(owner, size_t, d.handle_count + 1);
  d.mixtures = ARENA_NEW(owner, double *, d.handle_count);
  if (!d.atom_offsets || !d.mixtures) {
    return status_no_memory("the dictionary");
  }
  TRY(keep_weights(owner, source, &d));
  TRY(keep_exemplars(owner, source->poses, s, &d));
  TRY(find_centres(owner, reference, source->handles, &d));
  for (size_t h = 0; h < d.handle_count; h++) {
    d.atom_offsets[h + 1] = (h + 1) * (1 + width);
  }
  d.atom_count = d.atom_offsets[d.handle_count];
  *out = d;
  return EXM_OK;
}

exm_status dictionary_mix(arena *owner, const mesh *reference, dictionary *d)
{
  if (d->exemplar_count * d->dimension < MIXTURE_MINIMUM) {
    return EXM_OK;
  }
  TRY(mix_atoms(owner, reference, d));
  for (size_t h = 0; h < d->handle_count; h++) {
    d->atom_offsets[h + 1] += d->atom_offsets[h];
  }
  d->atom_count = d->atom_offsets[d->handle_count];
  return EXM_OK;
}

void dictionary_atoms(const dictionary *d, size_t handle, size_t vertex, double weight, double *out)
{
  size_t const width = d->exemplar_count * d->dimension;
  const double *pose = d->exemplars + vertex * width, *centre = d->centres + handle * width;
  const double *mixture = d->mixtures[handle];
  size_t const atoms = d->atom_offsets[handle + 1] - d->atom_offsets[handle] - 1;
  out[0] = weight;
  for (size_t i = 0; i < atoms; i++) {
    if (!mixture) {
      out[1 + i] = weight * (pose[i] - centre[i]);
      continue;
    }
    double value = 0;
    for (size_t k = 0; k < width; k++) {
      value += mixture[i * width + k] * (pose[k] - centre[k]);
    }
    out[1 + i] = weight * value;
  }
}

void dictionary_exemplar_coefficients(const dictionary *d, double *out)
{
  size_t const width = d->exemplar_count * d->dimension;
  memset(out, 0, d->atom_count * width * sizeof(double));
  for (size_t h = 0; h < d->handle_count; h++) {
    size_t const first = d->atom_offsets[h], atoms = d->atom_offsets[h + 1] - first - 1;
    memcpy(out + first * width, d->centres + h * width, width * sizeof(double));
    for (size_t i = 0; i < atoms; i++) {
      double *row = out + (first + 1 + i) * width;
      if (d->mixtures[h]) {
        memcpy(row, d->mixtures[h] + i * width, width * sizeof(double));
      } else {
        row[i] = 1;
      }
    }
  }
}

/** Undo mixture and centring: uncentred coefficients of one handle, [1 + S d][d] in the coordinates of the space. */
static void uncentred(const dictionary *d, size_t handle, const double *coefficients, double *out)
{
  size_t const width = d->exemplar_count * d->dimension, n = d->dimension;
  size_t const first = d->atom_offsets[handle], atoms = d->atom_offsets[handle + 1] - first - 1;
  const double *mixture = d->mixtures[handle], *centre = d->centres + handle * width;
  memset(out, 0, (1 + width) * n * sizeof(double));
  for (size_t i = 0; i < atoms; i++) {
    const double *from = coefficients + (first + 1 + i) * n;
    for (size_t k = mixture ? 0 : i; k < (mixture ? width : i + 1); k++) {
      dense_axpy(n, mixture ? mixture[i * width + k] : 1, from, out + (1 + k) * n);
    }
  }
  memcpy(out, coefficients + first * n, n * sizeof(double));
  for (size_t k = 0; k < width; k++) {
    dense_axpy(n, -centre[k], out + (1 + k) * n, out);
  }
}

/** One exemplar's linear map, from [dimension][dimension] in the space to rows of the caller's: axes' from axes. */
static void map_to_caller(const space *s, const double *from, double (*out)[3])
{
  size_t const n = s->dimension;
  memset(out, 0, 3 * sizeof *out);
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i < n; i++) {
      for (size_t a = 0; a < 3; a++) {
        dense_axpy(3, s->axes[j][a] * from[j * n + i], s->axes[i], out[a]);
      }
    }
  }
}

/** Coefficients of one handle in the caller's space: positions there are p = origin + unit * axes' x. */
static void to_caller(const dictionary *d, const space *s, const double *from, double height, double (*out)[3])
{
  size_t const n = d->dimension;
  space_to_point(s, from, out[0]);
  if (n == 2) {
    dense_axpy(3, height * s->unit, s->axes[2], out[0]);
  }
  for (size_t e = 0; e < d->exemplar_count; e++) {
    double(*rows)[3] = out + 1 + 3 * e;
    map_to_caller(s, from + (1 + e * n) * n, rows);
    for (size_t a = 0; a < 3; a++) {
      dense_axpy(3, -s->origin[a], rows[a], out[0]);
    }
  }
}

void dictionary_affine(const dictionary *d, const space *s, const double *coefficients, const double *heights,
                       double *scratch, double *out)
{
  size_t const rows = 1 + 3 * d->exemplar_count;
  for (size_t h = 0; h < d->handle_count; h++) {
    uncentred(d, h, coefficients, scratch);
    to_caller(d, s, scratch, heights ? heights[h] : 0, (double(*)[3])(out + h * rows * 3));
  }
}
