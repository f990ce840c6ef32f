/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Vertices are taken sixteen at a time, a SIMD lane each: a block has its exemplars' coordinates as rows of sixteen,
 * and for each handle that has a say in it a row of sixteen weights. Neighbours in a mesh mostly share their handles.
 *
 * Coefficients may be large and cancel: exemplars that nearly agree leave their difference open. In single precision
 * the sum over exemplars is therefore rewritten with q_0 = p_0 - c_0 and q_s = (p_s - c_s) - (p_0 - c_0), c_s the
 * centre of exemplar s, and with matrices A_hs (T_h's rows 1 + 3 s + j):
 *
 *   T_h0 + sum_s A_hs p_s  =  (T_h0 + sum_s A_hs c_s)  +  (sum_s A_hs) q_0  +  sum_(s > 0) A_hs q_s
 *
 * where both brackets are summed in double precision, so that what is left to cancel is as small as the exemplars'
 * differences are. How much that is can be bounded beforehand. */
#include "subspace/skinning.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/simd.h"

enum { LANES = 16 };

/* Largest intermediate values, in sizes of the exemplars, at which single precision is accurate enough: its roundings
 * of 6e-8 add up to a few times that. */
static double const LARGEST_AMPLITUDE = 8;

/* Roundings of single precision over a few hundred handles. */
static double const PARTITION_TOLERANCE = 1e-4;

/* Multiplications below which waking threads costs more than it brings, some 0.3 ms of one. */
static double const WORTH_THREADS = 4e6;
enum { PIECES_PER_THREAD = 4 }; /* one that begins late or is interrupted leaves the rest to the others */

struct skinning {
  arena memory;
  size_t vertex_count, handle_count, exemplar_count, block_count;
  int is_partition;            /* every vertex's weights sum to 1 */
  size_t *offsets;             /* [blocks + 1] into what follows */
  uint32_t *handles;           /* [entries] */
  float (*weights)[LANES];     /* [entries] */
  float (*exemplars)[LANES];   /* [blocks][3 S] p_s */
  float (*differences)[LANES]; /* [blocks][3 S] q_s */
  double *centres;             /* [S][3] */
  double *radii;               /* [S] largest |q_s| */
  double size;                 /* of the exemplars */
  float *narrow;               /* [H][1 + 3 S][3] coefficients of q, of the last call */
};

/* Lanes are worked on in pieces of the width of a vector type; where there are none, one by one. The expressions are
 * the same. */
#if defined(__GNUC__)
typedef float floats __attribute__((vector_size(64), may_alias));
typedef double doubles __attribute__((vector_size(64), may_alias));
typedef float half_floats __attribute__((vector_size(32), may_alias));
#  define WIDEN(values) __builtin_convertvector(values, doubles)
#else
typedef float floats, half_floats;
typedef double doubles;
#  define WIDEN(values) ((doubles)(values))
#endif

enum {
  FLOAT_PIECES = LANES * sizeof(float) / sizeof(floats),
  DOUBLE_PIECES = LANES * sizeof(double) / sizeof(doubles)
};

/* --------------------------------------------------------------------------------------------------------- creation */

/* The handles of a block; fills in their weights where there is room for them. */
static size_t block_handles(const skinning *s, size_t block, const float *weights, uint32_t *handles,
                            float (*rows)[LANES])
{
  size_t const first = block * LANES;
  size_t const some = s->vertex_count - first < LANES ? s->vertex_count - first : LANES;
  size_t count = 0;
  for (size_t h = 0; h < s->handle_count; h++) {
    const float *from = weights + h * s->vertex_count + first;
    int is_used = 0;
    for (size_t lane = 0; lane < some; lane++) {
      is_used |= from[lane] != 0;
    }
    if (is_used && rows) {
      handles[count] = (uint32_t)h;
      memcpy(rows[count], from, some * sizeof *from);
    }
    count += (size_t)is_used;
  }
  return count;
}

static exm_status lay_weights(skinning *s, const float *weights)
{
  size_t entries = 0;
  for (size_t b = 0; b < s->block_count; b++) {
    entries += block_handles(s, b, weights, NULL, NULL);
  }
  s->offsets = ARENA_NEW(&s->memory, size_t, s->block_count + 1);
  s->handles = ARENA_NEW(&s->memory, uint32_t, entries);
  s->weights = arena_array(&s->memory, entries, sizeof *s->weights);
  if (!s->offsets || !s->handles || !s->weights) {
    return status_no_memory("skinning");
  }
  for (size_t b = 0; b < s->block_count; b++) {
    size_t const at = s->offsets[b];
    s->offsets[b + 1] = at + block_handles(s, b, weights, s->handles + at, s->weights + at);
  }
  return EXM_OK;
}

/* Centres, and the size: the diagonal of the largest exemplar's bounding box. */
static void measure(skinning *s, const float *exemplars)
{
  for (size_t e = 0; e < s->exemplar_count; e++) {
    double diagonal2 = 0;
    for (size_t k = 0; k < 3; k++) {
      const float *from = exemplars + e * s->vertex_count * 3 + k;
      double low = INFINITY, high = -INFINITY;
      for (size_t v = 0; v < s->vertex_count; v++) {
        low = fmin(low, (double)from[3 * v]);
        high = fmax(high, (double)from[3 * v]);
      }
      s->centres[3 * e + k] = 0.5 * low + 0.5 * high;
      diagonal2 += (high - low) * (high - low);
    }
    s->size = fmax(s->size, sqrt(diagonal2));
  }
}

static exm_status lay_exemplars(skinning *s, const float *exemplars)
{
  size_t const S = s->exemplar_count, V = s->vertex_count;
  s->exemplars = arena_array(&s->memory, s->block_count * 3 * S, sizeof *s->exemplars);
  s->differences = arena_array(&s->memory, s->block_count * 3 * S, sizeof *s->differences);
  s->centres = ARENA_NEW(&s->memory, double, 3 * S);
  s->radii = ARENA_NEW(&s->memory, double, S);
  s->narrow = ARENA_NEW(&s->memory, float, s->handle_count *(1 + 3 * S) * 3);
  if (!s->exemplars || !s->differences || !s->centres || !s->radii || !s->narrow) {
    return status_no_memory("skinning");
  }
  measure(s, exemplars);
  for (size_t e = 0; e < S; e++) {
    for (size_t v = 0; v < V; v++) {
      const float *p = exemplars + (e * V + v) * 3, *first = exemplars + v * 3;
      double square = 0;
      for (size_t k = 0; k < 3; k++) {
        size_t const row = v / LANES * 3 * S + 3 * e + k;
        double const q0 = (double)first[k] - s->centres[k];
        double const q = e == 0 ? q0 : (double)p[k] - s->centres[3 * e + k] - q0;
        s->exemplars[row][v % LANES] = p[k];
        s->differences[row][v % LANES] = (float)q;
        square += q * q;
      }
      s->radii[e] = fmax(s->radii[e], sqrt(square));
    }
  }
  return EXM_OK;
}

static int sum_to_one(size_t vertex_count, size_t handle_count, const float *weights)
{
  for (size_t v = 0; v < vertex_count; v++) {
    double sum = 0;
    for (size_t h = 0; h < handle_count; h++) {
      sum += (double)weights[h * vertex_count + v];
    }
    if (fabs(sum - 1) > PARTITION_TOLERANCE) {
      return 0;
    }
  }
  return 1;
}

exm_status skinning_create(size_t vertex_count, size_t handle_count, size_t exemplar_count, const float *weights,
                           const float *exemplars, skinning **out)
{
  *out = NULL;
  skinning *s = calloc(1, sizeof *s);
  if (!s) {
    return status_no_memory("skinning");
  }
  s->vertex_count = vertex_count;
  s->handle_count = handle_count;
  s->exemplar_count = exemplar_count;
  s->block_count = (vertex_count + LANES - 1) / LANES;
  s->is_partition = sum_to_one(vertex_count, handle_count, weights);
  exm_status status = lay_weights(s, weights);
  if (status == EXM_OK) {
    status = lay_exemplars(s, exemplars);
  }
  if (status < 0) {
    skinning_destroy(s);
    return status;
  }
  *out = s;
  return EXM_OK;
}

void skinning_destroy(skinning *s)
{
  if (s) {
    arena_release(&s->memory);
    free(s);
  }
}

/* ------------------------------------------------------------------------------------------------- single precision */

/* T_h0 + sum_s A_hs c_s: where handle h takes the exemplars' centres. */
static void centre_image(const skinning *s, const double *coefficients, size_t handle, double image[3])
{
  const double *from = coefficients + handle * (1 + 3 * s->exemplar_count) * 3;
  for (size_t k = 0; k < 3; k++) {
    image[k] = from[k];
    for (size_t i = 0; i < 3 * s->exemplar_count; i++) {
      image[k] += from[(1 + i) * 3 + k] * s->centres[i];
    }
  }
}

/* The mean of the handles' images of the centres. Far from the origin it is most of the result, and is added last:
 * once, which is right where weights sum to 1. Eigenfunctions do not, and have none. */
static void find_offset(const skinning *s, const double *coefficients, float offset[3])
{
  double sum[3] = {0}, image[3];
  for (size_t h = 0; s->is_partition && h < s->handle_count; h++) {
    centre_image(s, coefficients, h, image);
    for (size_t k = 0; k < 3; k++) {
      sum[k] += image[k];
    }
  }
  for (size_t k = 0; k < 3; k++) {
    offset[k] = (float)(sum[k] / (double)s->handle_count);
  }
}

/* One handle's coefficients of q; returns how large intermediate values can get. */
static double narrow_handle(const skinning *s, const double *coefficients, size_t handle, const float offset[3])
{
  size_t const S = s->exemplar_count;
  const double *from = coefficients + handle * (1 + 3 * S) * 3;
  float *to = s->narrow + handle * (1 + 3 * S) * 3;
  double image[3], total[9] = {0}, square = 0;
  centre_image(s, coefficients, handle, image);
  for (size_t k = 0; k < 3; k++) {
    double const constant = image[k] - (double)offset[k];
    to[k] = (float)constant;
    square += constant * constant;
  }
  double amplitude = sqrt(square);
  for (size_t i = 0; i < 9 * S; i++) {
    total[i % 9] += from[3 + i];
  }
  for (size_t e = 0; e < S; e++) {
    const double *matrix = e == 0 ? total : from + 3 + 9 * e;
    square = 0;
    for (size_t i = 0; i < 9; i++) {
      to[3 + 9 * e + i] = (float)matrix[i];
      square += matrix[i] * matrix[i];
    }
    amplitude += sqrt(square) * s->radii[e];
  }
  return amplitude;
}

/* The coefficients of q in single precision; is that accurate enough? */
static int narrow(const skinning *s, const double *coefficients, float offset[3])
{
  double largest = 0;
  find_offset(s, coefficients, offset);
  for (size_t h = 0; h < s->handle_count; h++) {
    double const amplitude = narrow_handle(s, coefficients, h, offset);
    largest = amplitude <= largest ? largest : amplitude; /* keeps NaN */
  }
  return largest <= LARGEST_AMPLITUDE * s->size;
}

SIMD_CLONES static void apply_blocks(const skinning *s, const float offset[3], size_t begin, size_t end,
                                     float *positions)
{
  size_t const rows = 3 * s->exemplar_count;
  for (size_t b = begin; b < end; b++) {
    _Alignas(64) float block[3][LANES];
    for (size_t piece = 0; piece < FLOAT_PIECES; piece++) {
      const floats *q = (const floats *)s->differences[b * rows] + piece;
      floats x = (floats){0} + offset[0], y = (floats){0} + offset[1], z = (floats){0} + offset[2];
      for (size_t e = s->offsets[b]; e < s->offsets[b + 1]; e++) {
        const float *t = s->narrow + s->handles[e] * (1 + rows) * 3;
        floats const w = *((const floats *)s->weights[e] + piece);
        floats u = (floats){0} + t[0], v = (floats){0} + t[1], o = (floats){0} + t[2];
        for (size_t row = 0; row < rows; row++) {
          floats const coordinate = q[row * FLOAT_PIECES];
          u += coordinate * t[3 + 3 * row];
          v += coordinate * t[4 + 3 * row];
          o += coordinate * t[5 + 3 * row];
        }
        x += w * u;
        y += w * v;
        z += w * o;
      }
      ((floats *)block[0])[piece] = x;
      ((floats *)block[1])[piece] = y;
      ((floats *)block[2])[piece] = z;
    }
    size_t const first = b * LANES, some = s->vertex_count - first < LANES ? s->vertex_count - first : LANES;
    for (size_t lane = 0; lane < some; lane++) {
      for (size_t k = 0; k < 3; k++) {
        positions[(first + lane) * 3 + k] = block[k][lane];
      }
    }
  }
}

/* ------------------------------------------------------------------------------------------------- double precision */

/* One block, [3][LANES]. */
INLINE void apply_wide_block(const skinning *s, const double *coefficients, size_t b, double (*block)[LANES])
{
  size_t const rows = 3 * s->exemplar_count;
  for (size_t piece = 0; piece < DOUBLE_PIECES; piece++) {
    const half_floats *p = (const half_floats *)s->exemplars[b * rows] + piece;
    doubles x = (doubles){0}, y = (doubles){0}, z = (doubles){0};
    for (size_t e = s->offsets[b]; e < s->offsets[b + 1]; e++) {
      const double *t = coefficients + s->handles[e] * (1 + rows) * 3;
      doubles const w = WIDEN(*((const half_floats *)s->weights[e] + piece));
      doubles u = (doubles){0} + t[0], v = (doubles){0} + t[1], o = (doubles){0} + t[2];
      for (size_t row = 0; row < rows; row++) {
        doubles const coordinate = WIDEN(p[row * DOUBLE_PIECES]);
        u += coordinate * t[3 + 3 * row];
        v += coordinate * t[4 + 3 * row];
        o += coordinate * t[5 + 3 * row];
      }
      x += w * u;
      y += w * v;
      z += w * o;
    }
    ((doubles *)block[0])[piece] = x;
    ((doubles *)block[1])[piece] = y;
    ((doubles *)block[2])[piece] = z;
  }
}

/* Into one of the two; the other is NULL. */
SIMD_CLONES static void apply_wide_blocks(const skinning *s, const double *coefficients, size_t begin, size_t end,
                                          float *single, double *twice)
{
  for (size_t b = begin; b < end; b++) {
    _Alignas(64) double block[3][LANES];
    apply_wide_block(s, coefficients, b, block);
    size_t const first = b * LANES, some = s->vertex_count - first < LANES ? s->vertex_count - first : LANES;
    for (size_t lane = 0; lane < some; lane++) {
      for (size_t k = 0; k < 3; k++) {
        if (single) {
          single[(first + lane) * 3 + k] = (float)block[k][lane];
        } else {
          twice[(first + lane) * 3 + k] = block[k][lane];
        }
      }
    }
  }
}

/* -------------------------------------------------------------------------------------------------------- the whole */

typedef struct application {
  const skinning *skin;
  const double *coefficients;
  float offset[3];
  int is_narrow;
  size_t pieces;
  float *positions;
} application;

static void apply_piece(void *context, size_t piece)
{
  const application *a = context;
  size_t const begin = a->skin->block_count * piece / a->pieces, end = a->skin->block_count * (piece + 1) / a->pieces;
  if (a->is_narrow) {
    apply_blocks(a->skin, a->offset, begin, end, a->positions);
  } else {
    apply_wide_blocks(a->skin, a->coefficients, begin, end, a->positions, NULL);
  }
}

void skinning_apply(const skinning *s, const double *coefficients, int thread_count, float *positions)
{
  double const work = (double)s->offsets[s->block_count] * (double)(9 * s->exemplar_count + 6) * LANES;
  int const threads = thread_count == 0 && work < WORTH_THREADS ? 1 : parallel_threads(thread_count);
  size_t const pieces = threads == 1 ? 1 : (size_t)threads * PIECES_PER_THREAD;
  application a = {
      .skin = s, .coefficients = coefficients, .pieces = pieces < s->block_count ? pieces : s->block_count};
  a.positions = positions;
  a.is_narrow = narrow(s, coefficients, a.offset);
  parallel_for(a.pieces, threads, apply_piece, &a);
}

void skinning_apply_f64(const skinning *s, const double *coefficients, double *positions)
{
  apply_wide_blocks(s, coefficients, 0, s->block_count, NULL, positions);
}
