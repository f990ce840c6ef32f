/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "deform/rigidity/spokes.h"

#include <math.h>
#include <string.h>

/* Corners of a degenerate triangle hold together with at least this, a hundredth of an equilateral triangle's: two that
 * coincide have no weight but to each other, and the rest of a mesh could come off. */
static double const WEAKEST = 0.003;

static double *weight_between(const spokes *s, uint32_t i, uint32_t j)
{
  uint32_t low = s->around.offsets[i], high = s->around.offsets[i + 1];
  while (low + 1 < high) { /* rings are sorted */
    uint32_t const middle = low + (high - low) / 2;
    if (s->around.neighbors[middle] <= j) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return &s->weights[low];
}

/* Eq. 2. Negative cotangents count as zero, corner by corner, as they do in other implementations of
 * as-rigid-as-possible deformation: spokes of one triangle are weighed by different numbers of neighbourhoods, so that
 * the other two sides do not make up for a negative one, and a triangle keeps at least two positive sides. */
static void add_weights(const mesh *m, spokes *s)
{
  const uint32_t *flat = m->degenerate_faces;
  const uint32_t *const flat_end = flat + m->report.degenerate_face_count;
  for (size_t f = 0; f < m->triangle_count; f++) {
    const uint32_t *t = m->triangles[f];
    int const is_flat = flat < flat_end && *flat == f;
    flat += is_flat;
    for (int c = 0; c < 3; c++) {
      double const weight = fmax(m->cotangents[f][c], is_flat ? WEAKEST : 0);
      *weight_between(s, t[(c + 1) % 3], t[(c + 2) % 3]) += weight;
      *weight_between(s, t[(c + 2) % 3], t[(c + 1) % 3]) += weight;
    }
  }
}

static void find_arms(const mesh *m, spokes *s)
{
  for (size_t i = 0; i < s->around.vertex_count; i++) {
    for (uint32_t e = s->around.offsets[i]; e < s->around.offsets[i + 1]; e++) {
      double arm[4] = {0};
      for (int k = 0; k < 3; k++) {
        double const length = m->positions[i][k] - m->positions[s->around.neighbors[e]][k];
        arm[k] = s->weights[e] * length;
        s->rest[i] += arm[k] * length;
      }
      memcpy(&s->arms[e], arm, sizeof arm);
    }
  }
}

exm_status spokes_create(arena *owner, const mesh *m, spokes *out)
{
  size_t const V = m->vertex_count, ends = m->neighbor_offsets[V];
  spokes s = {.around = {.vertex_count = V, .offsets = m->neighbor_offsets, .neighbors = m->neighbors},
              .weights = ARENA_NEW(owner, double, ends),
              .arms = ARENA_NEW(owner, four, ends),
              .rest = ARENA_NEW(owner, double, V)};
  if (!s.weights || !s.arms || !s.rest) {
    return status_no_memory("the edges of a deformer");
  }
  add_weights(m, &s);
  find_arms(m, &s);
  *out = s;
  return EXM_OK;
}

INLINE double moments(const spokes *s, size_t begin, size_t end, const double *positions, const double *multiplicity,
                      row12 *out)
{
  double stretch = 0;
  for (size_t i = begin; i < end; i++) {
    const double *own = positions + 3 * i;
    row12 sum = {0};
    double around = 0;
    for (uint32_t e = s->around.offsets[i]; e < s->around.offsets[i + 1]; e++) {
      const double *other = positions + 3 * (size_t)s->around.neighbors[e];
      double const x = own[0] - other[0], y = own[1] - other[1], z = own[2] - other[2];
      four_axpy(&sum.part[0], x, &s->arms[e]);
      four_axpy(&sum.part[1], y, &s->arms[e]);
      four_axpy(&sum.part[2], z, &s->arms[e]);
      around += s->weights[e] * (x * x + y * y + z * z);
    }
    out[i] = sum;
    stretch += multiplicity[i] * around;
  }
  return stretch;
}

SIMD_CLONES double spokes_moments(const spokes *s, size_t begin, size_t end, const double *positions,
                                  const double *multiplicity, row12 *out)
{
  return moments(s, begin, end, positions, multiplicity, out);
}

SIMD_CLONES void spokes_forces(const spokes *s, size_t begin, size_t end, const row12 *sums, double *out)
{
  for (size_t i = begin; i < end; i++) {
    four total = {0};
    for (uint32_t e = s->around.offsets[i]; e < s->around.offsets[i + 1]; e++) {
      const row12 *other = &sums[s->around.neighbors[e]];
      double arm[4];
      memcpy(arm, &s->arms[e], sizeof arm);
      for (int k = 0; k < 3; k++) {
        four_axpy(&total, arm[k], &sums[i].part[k]);
        four_axpy(&total, arm[k], &other->part[k]);
      }
    }
    memcpy(out + 3 * i, &total, 3 * sizeof(double));
  }
}
