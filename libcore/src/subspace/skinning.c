/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Vertices are taken sixteen at a time, a SIMD lane each: a block of neighbours has its exemplars' coordinates as rows
 * of sixteen, and for each handle that has a say in it a row of sixteen weights.
 *
 * Coefficients may be large and cancel: exemplars that nearly agree leave their difference open. In single precision
 * the sum over exemplars is therefore rewritten with q_0 = p_0 - c_0 and q_s = (p_s - c_s) - (p_0 - c_0), c_s the
 * block's centre in exemplar s, and with matrices A_hs (T_h's rows 1 + 3 s + j):
 *
 *   T_h0 + sum_s A_hs p_s  =  (T_h0 + sum_s A_hs c_s)  +  (sum_s A_hs) q_0  +  sum_(s > 0) A_hs q_s
 *
 * where both brackets are summed in double precision, so that what is left to cancel is as small as the block is, or
 * the exemplars' differences in it are. How much that is can be bounded beforehand, block by block. */
#include "subspace/skinning.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/simd.h"
#include "numeric/spatial_order.h"

enum { LANES = 16 };

/* Largest intermediate values, in sizes of the exemplars, at which single precision is accurate enough: its roundings
 * of 6e-8 add up to a few times that. */
static double const LARGEST_AMPLITUDE = 8;

/* Multiplications below which waking threads costs more than it brings, some 0.3 ms of one. */
static double const WORTH_THREADS = 4e6;
/* One thread that begins late or is interrupted leaves the rest of its pieces to the others. */
enum { PIECES_PER_THREAD = 4, MOST_PIECES = 64 };

/* Weights whose sums are all within this of 1 are meant to have that sum: roundings of single precision over a few
 * hundred handles. */
static double const PARTITION_TOLERANCE = 1e-4;

struct skinning {
  arena memory;
  size_t vertex_count, handle_count, exemplar_count, block_count;
  int is_partition;            /* every vertex's weights are meant to sum to 1 */
  uint32_t *order;             /* [blocks][LANES] vertices; the last block's missing ones repeat the last vertex */
  size_t *offsets;             /* [blocks + 1] into what follows */
  uint32_t *handles;           /* [entries] */
  float (*weights)[LANES];     /* [entries] */
  float *heaviest;             /* [entries] the largest of those in magnitude */
  double (*sums)[LANES];       /* [blocks] of a vertex's weights */
  float (*exemplars)[LANES];   /* [blocks][3 S] p_s */
  float (*differences)[LANES]; /* [blocks][3 S] q_s */
  double *centres;             /* [blocks][3 S] */
  float *radii;                /* [blocks][S] largest |q_s| */
  double size;                 /* of the exemplars */
  /* Coefficients of the last call: T_h0 and A_h a coordinate a row, matrices of q, and norms of those. */
  double *planes;      /* [H][3][1 + 3 S] */
  float *narrow;       /* [H][3 S][3] */
  float *norms;        /* [H][S] */
  double (*images)[3]; /* [MOST_PIECES][H] scratch */
};

/* Lanes are worked on in pieces of the width of a vector type; where there are none, one by one. The expressions are
 * the same. 32 bytes: of wider types than its registers are, GCC makes a detour over the stack at every operation. */
#if defined(__GNUC__)
typedef float floats __attribute__((vector_size(32), may_alias));
typedef double doubles __attribute__((vector_size(32), may_alias));
typedef float half_floats __attribute__((vector_size(16), may_alias));
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
  const uint32_t *order = s->order + block * LANES;
  size_t count = 0;
  for (size_t h = 0; h < s->handle_count; h++) {
    const float *from = weights + h * s->vertex_count;
    int is_used = 0;
    for (size_t lane = 0; lane < LANES; lane++) {
      is_used |= from[order[lane]] != 0;
    }
    for (size_t lane = 0; is_used && rows && lane < LANES; lane++) {
      rows[count][lane] = from[order[lane]];
    }
    if (is_used && rows) {
      handles[count] = (uint32_t)h;
    }
    count += (size_t)is_used;
  }
  return count;
}

static void sum_weights(skinning *s, size_t block)
{
  double *sums = s->sums[block];
  for (size_t e = s->offsets[block]; e < s->offsets[block + 1]; e++) {
    for (size_t lane = 0; lane < LANES; lane++) {
      sums[lane] += (double)s->weights[e][lane];
      s->heaviest[e] = fmaxf(s->heaviest[e], fabsf(s->weights[e][lane]));
    }
  }
  for (size_t lane = 0; lane < LANES; lane++) {
    s->is_partition &= fabs(sums[lane] - 1) <= PARTITION_TOLERANCE;
  }
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
  s->heaviest = ARENA_NEW(&s->memory, float, entries);
  s->sums = arena_array(&s->memory, s->block_count, sizeof *s->sums);
  if (!s->offsets || !s->handles || !s->weights || !s->heaviest || !s->sums) {
    return status_no_memory("skinning");
  }
  s->is_partition = 1;
  for (size_t b = 0; b < s->block_count; b++) {
    size_t const at = s->offsets[b];
    s->offsets[b + 1] = at + block_handles(s, b, weights, s->handles + at, s->weights + at);
    sum_weights(s, b);
  }
  return EXM_OK;
}

static exm_status order_vertices(skinning *s, const float *exemplars)
{
  s->order = ARENA_NEW(&s->memory, uint32_t, s->block_count * LANES);
  if (!s->order) {
    return status_no_memory("skinning");
  }
  spatial_order(s->vertex_count, exemplars, LANES, s->order);
  for (size_t i = s->vertex_count; i < s->block_count * LANES; i++) {
    s->order[i] = s->order[s->vertex_count - 1];
  }
  return EXM_OK;
}

/* The size: the diagonal of the largest exemplar's bounding box. */
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
      diagonal2 += (high - low) * (high - low);
    }
    s->size = fmax(s->size, sqrt(diagonal2));
  }
}

/* One block's coordinates about their mean, exemplar by exemplar. */
static void lay_block(skinning *s, size_t b, const float *exemplars)
{
  size_t const S = s->exemplar_count;
  double *centres = s->centres + b * 3 * S;
  for (size_t lane = 0; lane < LANES; lane++) {
    for (size_t row = 0; row < 3 * S; row++) {
      float const p = exemplars[(row / 3 * s->vertex_count + s->order[b * LANES + lane]) * 3 + row % 3];
      s->exemplars[b * 3 * S + row][lane] = p;
      centres[row] += (double)p / LANES;
    }
  }
  for (size_t lane = 0; lane < LANES; lane++) {
    double first[3] = {0};
    for (size_t e = 0; e < S; e++) {
      double square = 0;
      for (size_t k = 0; k < 3; k++) {
        size_t const row = 3 * e + k;
        double const offset = (double)s->exemplars[b * 3 * S + row][lane] - centres[row];
        double const q = e == 0 ? offset : offset - first[k];
        first[k] = e == 0 ? offset : first[k];
        s->differences[b * 3 * S + row][lane] = (float)q;
        square += q * q;
      }
      s->radii[b * S + e] = fmaxf(s->radii[b * S + e], (float)sqrt(square));
    }
  }
}

static exm_status lay_exemplars(skinning *s, const float *exemplars)
{
  size_t const S = s->exemplar_count, H = s->handle_count, blocks = s->block_count;
  s->exemplars = arena_array(&s->memory, blocks * 3 * S, sizeof *s->exemplars);
  s->differences = arena_array(&s->memory, blocks * 3 * S, sizeof *s->differences);
  s->centres = ARENA_NEW(&s->memory, double, blocks * 3 * S);
  s->radii = ARENA_NEW(&s->memory, float, blocks *S);
  s->planes = ARENA_NEW(&s->memory, double, H * 3 * (1 + 3 * S));
  s->narrow = ARENA_NEW(&s->memory, float, H * 3 * S * 3);
  s->norms = ARENA_NEW(&s->memory, float, H *S);
  s->images = arena_array(&s->memory, MOST_PIECES * H, sizeof *s->images);
  if (!s->exemplars || !s->differences || !s->centres || !s->radii || !s->planes || !s->narrow || !s->norms ||
      !s->images) {
    return status_no_memory("skinning");
  }
  measure(s, exemplars);
  for (size_t b = 0; b < blocks; b++) {
    lay_block(s, b, exemplars);
  }
  return EXM_OK;
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
  exm_status status;
  if ((status = order_vertices(s, exemplars)) < 0 || (status = lay_weights(s, weights)) < 0 ||
      (status = lay_exemplars(s, exemplars)) < 0) {
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

/* Coefficients as blocks read them. */
static void lay_coefficients(const skinning *s, const double *coefficients)
{
  size_t const S = s->exemplar_count, rows = 1 + 3 * S;
  for (size_t h = 0; h < s->handle_count; h++) {
    const double *from = coefficients + h * rows * 3;
    double total[9] = {0};
    for (size_t i = 0; i < 3 * rows; i++) {
      s->planes[(h * 3 + i % 3) * rows + i / 3] = from[i];
      total[i % 9] += i < 3 ? 0 : from[i]; /* placed below: 3 + 9 e + i */
    }
    for (size_t e = 0; e < S; e++) {
      double square = 0;
      for (size_t i = 0; i < 9; i++) {
        double const value = e == 0 ? total[(3 + i) % 9] : from[3 + 9 * e + i];
        s->narrow[(h * S + e) * 9 + i] = (float)value;
        square += value * value;
      }
      s->norms[h * S + e] = (float)sqrt(square);
    }
  }
}

/* T_h0 + sum_s A_hs c_s: where a handle takes the block's centres. */
INLINE void centre_image(const skinning *s, size_t handle, const double *centres, double image[3])
{
  size_t const rows = 3 * s->exemplar_count;
  for (size_t k = 0; k < 3; k++) {
    const double *plane = s->planes + (handle * 3 + k) * (1 + rows);
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t i = 0; i < rows; i++) {
      sum += plane[1 + i] * centres[i];
    }
    image[k] = plane[0] + sum;
  }
}

/* What a block's vertices are added to: where their handles take its centre, by weights; far from the origin it is most
 * of the result, and is added last. Returns how large intermediate values can get. */
INLINE double find_images(const skinning *s, size_t b, double (*images)[3], double offset[3])
{
  size_t const S = s->exemplar_count, first = s->offsets[b], last = s->offsets[b + 1];
  double total = 0, amplitude = 0;
  memset(offset, 0, 3 * sizeof *offset);
  for (size_t e = first; e < last; e++) {
    centre_image(s, s->handles[e], s->centres + b * 3 * S, images[e - first]);
    for (size_t k = 0; k < 3; k++) {
      offset[k] += (double)s->heaviest[e] * images[e - first][k];
    }
    total += (double)s->heaviest[e];
  }
  for (size_t k = 0; k < 3; k++) {
    offset[k] /= total > 0 ? total : 1;
  }
  for (size_t e = first; e < last; e++) {
    double square = 0;
    float reach = 0;
    for (size_t k = 0; k < 3; k++) {
      images[e - first][k] -= offset[k];
      square += images[e - first][k] * images[e - first][k];
    }
    for (size_t i = 0; i < S; i++) {
      reach += s->norms[s->handles[e] * S + i] * s->radii[b * S + i];
    }
    amplitude += (double)s->heaviest[e] * (sqrt(square) + (double)reach);
  }
  return amplitude;
}

/* sum_h w_h (image_h + A_h q), [3][LANES]. */
INLINE void apply_narrow_block(const skinning *s, size_t b, double (*images)[3], float (*block)[LANES])
{
  size_t const rows = 3 * s->exemplar_count, first = s->offsets[b];
  for (size_t piece = 0; piece < FLOAT_PIECES; piece++) {
    const floats *q = (const floats *)s->differences[b * rows] + piece;
    floats x = (floats){0}, y = (floats){0}, z = (floats){0};
    for (size_t e = first; e < s->offsets[b + 1]; e++) {
      const float *t = s->narrow + s->handles[e] * rows * 3;
      floats const w = *((const floats *)s->weights[e] + piece);
      floats u = (floats){0} + (float)images[e - first][0], v = (floats){0} + (float)images[e - first][1],
             o = (floats){0} + (float)images[e - first][2];
      for (size_t row = 0; row < rows; row++) {
        floats const coordinate = q[row * FLOAT_PIECES];
        u += coordinate * t[3 * row];
        v += coordinate * t[3 * row + 1];
        o += coordinate * t[3 * row + 2];
      }
      x += w * u;
      y += w * v;
      z += w * o;
    }
    ((floats *)block[0])[piece] = x;
    ((floats *)block[1])[piece] = y;
    ((floats *)block[2])[piece] = z;
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

/* One vertex a lane, weights scaled to the sum that was meant. */
INLINE void write_wide(const skinning *s, size_t b, double (*block)[LANES], float *single, double *twice)
{
  for (size_t lane = 0; lane < LANES; lane++) {
    size_t const v = s->order[b * LANES + lane];
    double const scale = s->is_partition ? 1 / s->sums[b][lane] : 1;
    for (size_t k = 0; k < 3; k++) {
      if (single) {
        single[v * 3 + k] = (float)(scale * block[k][lane]);
      } else {
        twice[v * 3 + k] = scale * block[k][lane];
      }
    }
  }
}

/* images [H][3] is scratch. */
SIMD_CLONES static void apply_blocks(const skinning *s, const double *coefficients, size_t begin, size_t end,
                                     double (*images)[3], float *positions)
{
  for (size_t b = begin; b < end; b++) {
    _Alignas(64) double wide[3][LANES];
    _Alignas(64) float block[3][LANES];
    double offset[3];
    if (!(find_images(s, b, images, offset) <= LARGEST_AMPLITUDE * s->size)) { /* NaN is not */
      apply_wide_block(s, coefficients, b, wide);
      write_wide(s, b, wide, positions, NULL);
      continue;
    }
    apply_narrow_block(s, b, images, block);
    for (size_t lane = 0; lane < LANES; lane++) {
      size_t const v = s->order[b * LANES + lane];
      double const sum = s->is_partition ? 1 : s->sums[b][lane];
      for (size_t k = 0; k < 3; k++) {
        positions[v * 3 + k] = (float)(sum * offset[k] + (double)block[k][lane]);
      }
    }
  }
}

SIMD_CLONES static void apply_wide_blocks(const skinning *s, const double *coefficients, double *positions)
{
  for (size_t b = 0; b < s->block_count; b++) {
    _Alignas(64) double block[3][LANES];
    apply_wide_block(s, coefficients, b, block);
    write_wide(s, b, block, NULL, positions);
  }
}

/* -------------------------------------------------------------------------------------------------------- the whole */

typedef struct application {
  const skinning *skin;
  const double *coefficients;
  size_t pieces;
  float *positions;
} application;

static void apply_piece(void *context, size_t piece)
{
  const application *a = context;
  const skinning *s = a->skin;
  size_t const begin = s->block_count * piece / a->pieces, end = s->block_count * (piece + 1) / a->pieces;
  apply_blocks(s, a->coefficients, begin, end, s->images + piece * s->handle_count, a->positions);
}

void skinning_apply(const skinning *s, const double *coefficients, int thread_count, float *positions)
{
  double const work = (double)s->offsets[s->block_count] * (double)(9 * s->exemplar_count + 6) * LANES;
  int const threads = thread_count == 0 && work < WORTH_THREADS ? 1 : parallel_threads(thread_count);
  size_t pieces = threads == 1 ? 1 : (size_t)threads * PIECES_PER_THREAD;
  pieces = pieces < MOST_PIECES ? pieces : MOST_PIECES;
  application a = {
      .skin = s, .coefficients = coefficients, .pieces = pieces < s->block_count ? pieces : s->block_count};
  a.positions = positions;
  lay_coefficients(s, coefficients);
  parallel_for(a.pieces, threads, apply_piece, &a);
}

void skinning_apply_f64(const skinning *s, const double *coefficients, double *positions)
{
  apply_wide_blocks(s, coefficients, positions);
}
