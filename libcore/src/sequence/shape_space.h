/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Shape spaces [SEQ, section 5]: a mesh's shapes as vectors that may be added and scaled, and back to positions. Their
 * coordinates are scaled so that distances compare with those of positions, all coordinates of all vertices together.
 */
#ifndef EXM_SEQUENCE_SHAPE_SPACE_H
#define EXM_SEQUENCE_SHAPE_SPACE_H

#include "mesh/mesh.h"

typedef struct shape_space shape_space;

/** What a kind of shape space does. encode and decode may use scratch memory in the space: one thread at a time. */
typedef struct shape_space_methods {
  const char *name;
  /** Precompute what depends on the mesh alone; sets dimension and state. */
  exm_status (*prepare)(shape_space *space);
  /** positions [V][3] -> coordinates [d]. `like` [d], may be NULL: where coordinates are not unique (turns by 360
   *  degrees), those that are closest to it. */
  exm_status (*encode)(shape_space *space, const float *positions, const double *like, double *coordinates);
  /** coordinates [d] -> positions [V][3] */
  exm_status (*decode)(shape_space *space, const double *coordinates, double *positions);
  void (*release)(shape_space *space);
} shape_space_methods;

struct shape_space {
  const shape_space_methods *methods; /* NULL: positions themselves, nothing to convert */
  const mesh *reference;
  size_t dimension;
  arena memory; /* of the state */
  void *state;
};

/** kind: exm_shape_space; NULL and a status where there is none of that number. */
exm_status shape_space_create(int32_t kind, const mesh *reference, shape_space *out);
void shape_space_release(shape_space *space);

#endif
