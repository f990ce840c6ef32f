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

typedef struct reduced_mesh {
  size_t dimension, group_count, exemplar_count;
  size_t rank;                 /* free coefficients a dimension */
  size_t constraint_count;     /* rows of c */
  size_t shape_rows;           /* proxies that the exemplars live in */
  size_t rest_rows;            /* the others */
  size_t *shape_offsets;       /* [G + 1] rows of each group */
  size_t *rest_offsets;        /* [G + 1] */
  double *shapes;              /* [shape_rows][S d] the exemplars' proxies, side by side */
  double *Ux, *Fx;             /* [shape_rows][rank], [shape_rows][constraint_count]; Ux NULL with carriers */
  double *Ur, *Fr;             /* [rest_rows][rank], [rest_rows][constraint_count]; Ur NULL with carriers */
  double *G;                   /* [shape_rows][shape_rows]; NULL with carriers */
  size_t rest_root_rows;       /* the rest's energy is 1/2 |rest_root (u over c)|^2 */
  double *rest_root;           /* [rest_root_rows][rank + constraint_count] */
  size_t carrier_count;        /* 0: none */
  size_t *carrier_offsets;     /* [G + 1] */
  uint32_t *carriers;          /* vertices of each group */
  double **carried_shapes;     /* [G] A_g for its shape rows, [rows of g][carriers of g] */
  double **carried_rest;       /* [G] and for the rest */
  double *P;                   /* [carrier_count][rank] */
  double *PP;                  /* [carrier_count][carrier_count] */
  double *exemplar_targets;    /* [constraint_count][S d] c of the exemplars' own handles */
  unsigned char *is_frame_row; /* [constraint_count] 0 for rows that are positions */
  double size;                 /* root of the energy of the exemplars' proxies: what "small" is relative to */
  /* T = basis (u - shift c) on the atoms `kept`; on the atoms `bound`, one a constraint, follow c - rest T_kept. */
  size_t atom_count;
  size_t *kept, *bound;
  double *basis;      /* [kept][rank] */
  double *shift;      /* [rank][constraint_count] */
  double *bound_to_c; /* [constraint_count][constraint_count] */
  double *bound_rest; /* [constraint_count][kept] */
} reduced_mesh;

exm_status reduced_create(arena *owner, const dictionary *d, const constraints *c, const group_factor *factors,
                          size_t group_count, const progress *report, reduced_mesh *out);

/** u [rank][width] = Ux' X for X [shape_rows][width]. scratch [carrier_count][width]. */
void reduced_to_basis(const reduced_mesh *r, size_t width, const double *X, double *scratch, double *u);

/** y [shape_rows][width] = Ux u. scratch [carrier_count][width]. */
void reduced_to_shapes(const reduced_mesh *r, size_t width, const double *u, double *scratch, double *y);

/** shapes [shape_rows][width] = Ux Ux' X and rest [rest_rows][width] = Ur Ux' X. scratch [2 carrier_count +
 * rank][width]. */
void reduced_respond(const reduced_mesh *r, size_t width, const double *X, double *scratch, double *shapes,
                     double *rest);

/** Energy of the pose u under c in the rows where no exemplar lives, as a sum of squares: exact near zero, where the
 *  difference of totals is not. scratch [2 (rank + constraints)][d]. */
double reduced_rest_energy(const reduced_mesh *r, const double *u, const double *c, double *scratch);

/** G [shape_rows][shape_rows], with carriers or without. scratch [carrier_count][shape_rows]. */
void reduced_green(const reduced_mesh *r, double *scratch, double *G);

/** Scatter one group's proxies x [rows of g][width] to its carriers, out [carriers of g][width] = A_g' x. */
void reduced_carry(const reduced_mesh *r, size_t group, size_t width, const double *x, double *out);

/** Coefficients [atom_count][d] of the pose u [rank][d] under the constraints c [constraint_count][d]. scratch: as many
 *  doubles as rank d. */
void reduced_coefficients(const reduced_mesh *r, const double *u, const double *c, double *scratch, double *T);

#endif
