/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The reduced mesh: what is left of a mesh, its exemplars and its handles once vertices, coefficients and constraints
 * have been eliminated.
 *
 * Coefficients that meet the handles c are T = N u + Y c with u free. The basis N is orthonormal in the elastic energy,
 * so that the energy of a pose against a target e of proxy edges is
 *
 *     E = 1/2 |U u + F c - e|^2,    U'U = 1,  U'F = 0,    minimal at  u = U' e.
 *
 * Rows of U and F are proxy edges, sorted by edge group. In each group they are turned so that the exemplars live in
 * the first rows only (e = 0 in the others): those are kept apart as Ux, Fx, the rest as Ur, Fr. All that an iteration
 * needs is then G = Ux Ux' and Fx c: proxies of the best pose for a target e are G e + Fx c. */
#ifndef EXM_SUBSPACE_REDUCED_H
#define EXM_SUBSPACE_REDUCED_H

#include "base/progress.h"
#include "subspace/constraints.h"
#include "subspace/dictionary.h"
#include "subspace/group_factor.h"
#include "subspace/vertices.h"

/** Where all positions are free, proxies are combinations of vertices near by, the carriers of each group. */
typedef struct reduced_carriers {
  vertex_space space;
  size_t *offsets;   /* [G + 1] */
  uint32_t *indices; /* vertices of each group */
  double **shapes;   /* [G] shape rows from carriers, [rows of g][carriers of g] */
  double **rest;     /* [G] and the rest */
} reduced_carriers;

typedef struct reduced_mesh {
  size_t dimension, group_count, exemplar_count;
  size_t rank;                 /* free coefficients a dimension */
  size_t constraint_count;     /* rows of c */
  size_t shape_rows;           /* proxies that the exemplars live in */
  size_t rest_rows;            /* the others */
  size_t *shape_offsets;       /* [G + 1] rows of each group */
  size_t *rest_offsets;        /* [G + 1] */
  double *shapes;              /* [shape_rows][S d] the exemplars' proxies, side by side */
  reduced_carriers *carriers;  /* NULL for poses in the span of a dictionary, which alone have what follows */
  double *Ux, *Fx;             /* [shape_rows][rank], [shape_rows][constraint_count] */
  double *Ur, *Fr;             /* [rest_rows][rank], [rest_rows][constraint_count] */
  double *G;                   /* [shape_rows][shape_rows] */
  size_t rest_root_rows;       /* the rest's energy is 1/2 |rest_root (u over c)|^2 */
  double *rest_root;           /* [rest_root_rows][rank + constraint_count] */
  double *exemplar_targets;    /* [constraint_count][S d] c of the exemplars' own handles */
  unsigned char *is_frame_row; /* [constraint_count] 0 for rows that are positions */
  double size;                 /* root of the energy of the exemplars' proxies: what "small" is relative to */
  /* T = basis (u - shift c) on the atoms `kept`; on the atoms `bound`, one a constraint, follow c - rest T_kept.
   * Without a dictionary T are the positions themselves. */
  size_t atom_count;
  size_t *kept, *bound;
  double *basis;      /* [kept][rank] */
  double *shift;      /* [rank][constraint_count] */
  double *bound_to_c; /* [constraint_count][constraint_count] */
  double *bound_rest; /* [constraint_count][kept] */
} reduced_mesh;

exm_status reduced_create(arena *owner, const dictionary *d, const constraints *c, const group_factor *factors,
                          size_t group_count, const progress *report, reduced_mesh *out);

/**
 * The same with all positions free, in which case handles' weights have no say but in the edge groups. exemplars
 * [V][S d] as in a dictionary; roots from group_roots_create. Needs reduced_release, also after a failure.
 */
exm_status reduced_create_whole(arena *owner, const mesh *reference, const dictionary *d, const constraints *c,
                                const group_factor *roots, size_t group_count, const progress *report,
                                reduced_mesh *out);

/** What does not come from the arena. */
void reduced_release(reduced_mesh *r);

/** Doubles a column that the functions below need for scratch. */
size_t reduced_scratch(const reduced_mesh *r);

/** u [rank][width] = Ux' X for X [shape_rows][width]. */
void reduced_to_basis(const reduced_mesh *r, size_t width, const double *X, double *scratch, double *u);

/** y [shape_rows][width] = Ux u. */
void reduced_to_shapes(const reduced_mesh *r, size_t width, const double *u, double *scratch, double *y);

/** held [shape_rows][d] = Fx c. */
void reduced_hold(const reduced_mesh *r, const double *c, double *scratch, double *held);

/** Energy of the pose u under c in the rows where no exemplar lives, as a sum of squares: exact near zero, where the
 *  difference of totals is not. */
double reduced_rest_energy(const reduced_mesh *r, const double *u, const double *c, double *scratch);

/** Positions of the carriers [V][width] as proxies: shapes [shape_rows][width], and rest [rest_rows][width] or NULL. */
void reduced_from_carriers(const reduced_mesh *r, size_t width, const double *points, double *shapes, double *rest);

/** Scatter one group's proxies x [rows of g][width] to its carriers, out [carriers of g][width]. */
void reduced_carry(const reduced_mesh *r, size_t group, size_t width, const double *x, double *out);

/** Coefficients [atom_count][d] of the pose u [rank][d] under the constraints c [constraint_count][d]. */
void reduced_coefficients(const reduced_mesh *r, const double *u, const double *c, double *scratch, double *T);

#endif
