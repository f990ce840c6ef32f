/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "subspace/skinning.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

struct skinning {
  size_t vertex_count, handle_count, exemplar_count;
  float *weights, *exemplars;
  arena memory;
};

exm_status skinning_create(size_t vertex_count, size_t handle_count, size_t exemplar_count, const float *weights,
                           const float *exemplars, skinning **out)
{
  skinning *skin = calloc(1, sizeof *skin);
  if (!skin) {
    return status_no_memory("the skinning");
  }
  *skin = (skinning){.vertex_count = vertex_count, .handle_count = handle_count, .exemplar_count = exemplar_count};
  skin->weights = ARENA_NEW(&skin->memory, float, handle_count *vertex_count);
  skin->exemplars = ARENA_NEW(&skin->memory, float, 3 * exemplar_count * vertex_count);
  if (!skin->weights || !skin->exemplars) {
    skinning_destroy(skin);
    return status_no_memory("the skinning");
  }
  memcpy(skin->weights, weights, handle_count * vertex_count * sizeof(float));
  memcpy(skin->exemplars, exemplars, 3 * exemplar_count * vertex_count * sizeof(float));
  *out = skin;
  return EXM_OK;
}

static void pose_vertex(const skinning *skin, const double *coefficients, size_t v, double out[3])
{
  double sum = 0;
  memset(out, 0, 3 * sizeof(double));
  for (size_t h = 0; h < skin->handle_count; h++) {
    double const weight = (double)skin->weights[h * skin->vertex_count + v];
    const double *rows = coefficients + h * (1 + 3 * skin->exemplar_count) * 3;
    for (int k = 0; weight != 0 && k < 3; k++) {
      double value = rows[k];
      for (size_t s = 0; s < skin->exemplar_count; s++) {
        const float *from = skin->exemplars + (s * skin->vertex_count + v) * 3;
        for (size_t j = 0; j < 3; j++) {
          value += rows[(1 + 3 * s + j) * 3 + (size_t)k] * (double)from[j];
        }
      }
      out[k] += weight * value;
    }
    sum += weight;
  }
  for (int k = 0; k < 3; k++) {
    out[k] /= sum;
  }
}

void skinning_apply_f64(const skinning *skin, const double *coefficients, double *positions)
{
  for (size_t v = 0; v < skin->vertex_count; v++) {
    pose_vertex(skin, coefficients, v, positions + 3 * v);
  }
}

void skinning_apply(const skinning *skin, const double *coefficients, int thread_count, float *positions)
{
  double point[3];
  (void)thread_count;
  for (size_t v = 0; v < skin->vertex_count; v++) {
    pose_vertex(skin, coefficients, v, point);
    for (int k = 0; k < 3; k++) {
      positions[3 * v + (size_t)k] = (float)point[k];
    }
  }
}

void skinning_destroy(skinning *skin)
{
  if (skin) {
    arena_release(&skin->memory);
    free(skin);
  }
}
