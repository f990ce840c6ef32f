/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What every kind of deformer shares: a mesh bound to handles, a result, and what can be asked of both. A kind embeds
 * exm_deformer as its first member and fills in its methods; its folder here holds the rest. */
#ifndef EXM_DEFORM_DEFORMER_H
#define EXM_DEFORM_DEFORMER_H

#include "base/memory.h"
#include "base/status.h"
#include "mesh/mesh.h"

typedef struct deformer_methods {
  /** Where exemplar s (below info.exemplar_count) has the handles, [H][3][4]. */
  void (*handle_pose)(const exm_deformer *deformer, size_t exemplar, double *targets);
  /** The solved positions, [V][3]; called only where there is a result. thread_count 0: chosen. */
  void (*positions)(const exm_deformer *deformer, int thread_count, float *positions);
  void (*positions_f64)(const exm_deformer *deformer, double *positions);
  /** What the kind holds outside of `memory`. Also called for a deformer whose bind failed half-way. NULL: nothing. */
  void (*release)(exm_deformer *deformer);
} deformer_methods;

struct exm_deformer {
  const deformer_methods *methods;
  arena memory;
  exm_deformer_info info;
  int32_t *handle_kinds; /* [H] */
  float *weights;        /* [H][V]; NULL for kinds that have none */
  float *reference;      /* [V][3] what is shown before the first result */
  int has_result;
};

/**
 * Begin a bind: `size` zeroed bytes whose first member is an exm_deformer with its methods, its counts, handle kinds
 * and reference filled in, from handles that were checked.
 */
exm_status deformer_begin(size_t size, const deformer_methods *methods, exm_deformer_kind kind, const mesh *reference,
                          const exm_handles *handles, exm_deformer **out);

/** Every connected part needs a handle that says where it is: free ones do not. EXM_ERROR_UNCONSTRAINED. */
exm_status deformer_check_held(const mesh *reference, const exm_handles *handles);

void deformer_destroy(exm_deformer *deformer);

#endif
