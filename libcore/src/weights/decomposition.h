/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Skinning weights and rigid bones out of poses [Le and Deng, "Smooth skinning decomposition with rigid bones", 2012;
 * "Robust and accurate skeletal rigging from mesh sequences", 2014]. See exm_weights_decompose. */
#ifndef EXM_WEIGHTS_DECOMPOSITION_H
#define EXM_WEIGHTS_DECOMPOSITION_H

#include "base/progress.h"
#include "mesh/mesh.h"

enum { DECOMPOSITION_INFLUENCES = 8 }; /* the most that can be asked for */

typedef struct bone_transform {
  double turn[9], shift[3]; /* x -> turn x + shift, turn row-major */
} bone_transform;

typedef struct decomposition {
  const mesh *reference;
  const float *poses; /* [S][V][3] */
  size_t pose_count, bone_count, bone_limit;
  size_t influence_limit;
  double mass;                /* of all vertices */
  bone_transform *transforms; /* [bone_limit][S] */
  uint32_t *labels;           /* [V] the bone of each vertex: of its largest weight */
  /* Influences of vertex v: the first counts[v] of [V][influence_limit]. */
  unsigned char *counts;
  uint32_t *bones;
  double *weights;
} decomposition;

/** Room, from `owner`. */
exm_status decomposition_create(arena *owner, const mesh *reference, const float *poses, size_t pose_count,
                                size_t bone_limit, size_t influence_limit, decomposition *out);

/** Each vertex with one bone: clusters that move rigidly, split where they do so worst. bones: how many are wanted; 0:
 * as many as bring the root mean square distance down to `error`. Fills in labels and transforms. */
exm_status decomposition_cluster(decomposition *d, size_t bones, double error, const progress *report);

/** Convex weights of few bones for each vertex, at fixed transforms [2012, 3.2]. */
exm_status decomposition_weigh(decomposition *d);

/** Rigid transforms, one bone after the other, at fixed weights [2012, 3.3]. */
exm_status decomposition_move(decomposition *d);

/** Root mean square distance of the skinned rest pose from the poses, and the largest distance (NULL: not wanted). */
double decomposition_error(const decomposition *d, double *largest);

/** The alternation, from the clusters: until the error falls by less than a hundredth. *rounds out. */
exm_status decomposition_alternate(decomposition *d, int32_t rounds_most, const progress *report, int32_t *rounds);

/** Best rigid transform of rest positions of `vertices` into pose s, by masses. */
void decomposition_fit(const decomposition *d, const uint32_t *vertices, size_t count, size_t s, bone_transform *out);

/** Squared distance, over all poses, of vertex v moved by a bone from where the poses have it. */
double decomposition_miss(const decomposition *d, size_t bone, size_t v);

#endif
