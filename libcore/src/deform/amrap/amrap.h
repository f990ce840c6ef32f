/* SPDX-License-Identifier: GPL-3.0-or-later */
/* As-multi-rigid-as-possible deformation [AMRAP], on the reduced mesh.
 *
 * An iteration never touches vertices, coefficients or constraints. With Z_gs = shapes_gs R_gs' the proxies of exemplar
 * s turned by its local rotation, and X_g = sum_s B_gs Z_gs their blend, eq. 9 with the pose eliminated is
 *
 *     E_d(B) = 1/2 |X|^2 - 1/2 X'G X - <X, Fx c> + 1/2 |F c|^2,
 *
 * quadratic in B; eq. 20 becomes the cone program of numeric/cone.h, and the proxies that the next rotations are fitted
 * to are y = G X + Fx c. */
#ifndef EXM_DEFORM_AMRAP_AMRAP_H
#define EXM_DEFORM_AMRAP_AMRAP_H

#include "numeric/anderson.h"
#include "numeric/cone.h"
#include "subspace/reduced.h"

/* Up to this many exemplars the cone program holds every blend weight; above, a working set of a few a group, since few
 * are in use at an optimum: that many a group, or more where all groups have no more than AMRAP_COLUMNS. */
enum { AMRAP_ALL_SHAPES = 3, AMRAP_COLUMNS_PER_GROUP = 8, AMRAP_COLUMNS = 256 };

/** Unknowns of the cone program (group g, exemplar s) that have been worked out for the pose that a search starts at,
 * the anchor, each in a slot: rounds that want other unknowns keep what they share. */
typedef struct amrap_columns {
  size_t limit;
  size_t *group, *shape; /* [limit] what a slot holds */
  size_t *slot_of;       /* [G][S], or SIZE_MAX */
  size_t *vacant;        /* [limit] slots that hold nothing, a stack */
  size_t vacant_count;
  size_t *order; /* [limit] slots of the current program's unknowns */
  size_t row_stride, carrier_stride;
  double *turned;   /* [limit][row_stride] Z - X of the anchor, [rows of its group][d] */
  double *carried;  /* [limit][carrier_stride] with carriers: the forces of that on them */
  double *slope;    /* [limit] <Z - X, y - X> */
  double *Q;        /* [limit][limit] <Z_i - X, (1 - G / (1 + mu)) (Z_j - X)> */
  double *response; /* [columns per group d][shape_rows or V] G (Z - X) of one group's new slots, a coordinate a row */
  double *felt;     /* that where another group's columns feel it */
  double *anchor;   /* [shape_rows][d] X */
  double *misfit;   /* [shape_rows][d] y - X */
  unsigned char *is_new; /* [limit] */
  /* With carriers: P P' with vertices sorted by the last group that they carry for, so that a group and those after it
   * are a suffix. NULL where that is too large. */
  double *green;             /* [V][V] */
  size_t *green_starts;      /* [G] where the suffix of each group begins */
  uint32_t *green_places;    /* [carriers] of each group's carriers in that order */
  double *forces, *forces_u; /* without green: [V][columns per group d], [rank][columns per group d] */
} amrap_columns;

/** ARAP of all exemplars at once where all positions are free, exemplars side by side: [..][S]. */
typedef struct amrap_whole {
  double *pulls;         /* [carriers][d][S] forces of the exemplars on the carriers at rest */
  double *shapes;        /* [shape_rows][d][S] */
  double *turns;         /* [G][d][d][S] rotations, transposed */
  double *fits, *before; /* [G][d][d][S] what they are fitted to */
  double *points;        /* [V][d][S] */
  double *forces;        /* [V][d][S] */
  double *u;             /* [rank][d][S] */
  double *held;          /* [V][d] positions of least energy under the handles alone */
} amrap_whole;

typedef struct amrap {
  reduced_mesh reduced;
  /* Single-exemplar ARAP: with rotations stacked as Rt [G d][d], the matrices to fit are Gs Rt + Fs c. */
  double *Gs;           /* [S][G d][G d] */
  double *Fs;           /* [S][G d][constraints] */
  double *D_roots;      /* [G][S][packed triangle]: D_gs = 1/2 |root (Rt over c)|^2; NULL where rows are fewer work */
  amrap_whole whole;    /* with carriers, instead of all that */
  double *group_shares; /* [G] of the surface */
  /* What depends on the handles alone. */
  double *c, *Fxc;          /* [constraints][d], [shape_rows][d] */
  double *single_rotations; /* [S][G][d][d], transposed */
  double *D;                /* [G][S] */
  /* The solution. */
  double *rotations; /* [G][S][d][d], transposed: those the blend was solved with */
  double *B;         /* [G][S] */
  double *u;         /* [rank][d] */
  double *y;         /* [shape_rows][d] */
  double *X;         /* [shape_rows][d] */
  int has_solution;
  int has_energies; /* D belongs to c and to rotations as they were asked for */
  int energies_had_rotations;
  /* Scratch. */
  double *fit;          /* [2][S][G][d][d] matrices to fit, and what they are fitted from */
  double *moments;      /* [d][S d] of one group */
  double *fit_image;    /* [G][d][d] */
  double *fit_fallback; /* [G][d][d] */
  anderson single_mixing, mixing;
  double *carried;                   /* scratch of the reduced operators, up to S d columns */
  double *single_blend;              /* [shape_rows][S d] */
  double *single_shapes;             /* [shape_rows][S d] */
  double *single_rest;               /* [rest_rows][S d] */
  double *stacked;                   /* [G d + constraints][d], a coordinate a row */
  double *turned_G;                  /* [shape_rows][d] */
  double *mixed_u;                   /* [rank][d] where the rotations were fitted */
  double *damped_u;                  /* [rank][d] */
  double *global_u;                  /* [rank][S d] */
  double *saved_u, *saved_B, *slope; /* [rank][d], [G][S], [rank][d] */
  unsigned char *wanted;             /* [G][S] */
  /* The cone program of the current round. */
  amrap_columns columns;
  size_t columns_per_group;
  double *slopes; /* [S] */
  size_t *block_offsets;
  double *Q, *p, *l, *unknown;
  cone_workspace cone;
} amrap;

typedef struct amrap_options {
  double lambda;
  int is_global, has_rotations, is_warm;
  exm_descent descent;
  int32_t iterations;
  double tolerance;
} amrap_options;

/** The damping of appendix A: the step minimises E_d + <slope, u - u0> + mu/2 |(u, B) - (u0, B0)|^2 under the root,
 * which for each mu is the trust-region step of some radius. mu = 0 and no slope: section 5.3. */
typedef struct amrap_damping {
  double mu;
  const double *u0, *B0; /* [rank][d], [G][S] */
  const double *slope;   /* [rank][d] */
} amrap_damping;

/** All that a solver needs besides its reduced mesh, a->reduced, from `owner`. group_shares [G] is copied. */
exm_status amrap_prepare(arena *owner, const double *group_shares, amrap *a);

/** New handles: c [constraints][d]. Forgets D. */
void amrap_set_targets(amrap *a, const double *c);

/** Room for those parts, from `owner`. */
exm_status amrap_columns_create(arena *owner, amrap *a);
exm_status amrap_whole_create(arena *owner, amrap *a);
/** D's roots, where they are less work than the rows. */
exm_status amrap_roots_create(arena *owner, amrap *a);
void amrap_measure_by_roots(amrap *a);

/** Anchor the columns at the pose as it is, X and y, and forget those of another. */
void amrap_columns_anchor(amrap *a);
/** Make the unknowns wanted [G][S] (NULL: all), and no others, the program's: a->columns.order group by group, with
 * a->block_offsets. Returns how many there are. */
size_t amrap_columns_choose(amrap *a, const unsigned char *wanted, double mu);

/** Proxies of exemplar s at a row of group g, turned by its rotation. */
void amrap_turn(const amrap *a, size_t row, size_t g, size_t s, double *out);

/** Moments of one group's exemplars with other proxies Y [shape_rows][d]: shapes' Y, out [d][S d]. */
void amrap_moments(const amrap *a, size_t g, const double *Y, double *out);

/** single_rotations of exemplar s at the start of its ARAP. */
void amrap_rigid_start(amrap *a, size_t s);

/** amrap_solve_exemplars where all positions are free. From scratch, single_rotations are where it starts. */
void amrap_whole_solve(amrap *a, const amrap_options *options, int from_scratch);

/** D of eq. 10: every exemplar on its own brought to the handles by ARAP. */
void amrap_solve_exemplars(amrap *a, const amrap_options *options, int from_scratch);

/** The pose u [rank][d] of exemplar s's own solution. scratch [shape_rows][d]. */
void amrap_exemplar_pose(const amrap *a, size_t s, double *scratch, double *u);

/** The blend and pose for the rotations held, eq. 20. B is where the search starts and what it finds. */
void amrap_solve_blend(amrap *a, const amrap_options *options, const amrap_damping *damping, cone_result *result);

/** Rotations fitted to the pose, eq. 21-22. */
void amrap_fit_rotations(amrap *a);

/** E_d of the pose u, whose proxies are y, against blended proxies X: a sum of squares [eq. 9]. */
double amrap_elastic_energy(const amrap *a, const double *u, const double *y, const double *X);

/** sqrt(E_d) + lambda sum B sqrt(D) for the pose, blend and rotations held; E_d apart where asked for. */
double amrap_objective(const amrap *a, const amrap_options *options, double *elastic);

/** Blend weights averaged over the groups by their share of the surface, [S]. */
void amrap_blend_average(const amrap *a, double *average);

/** X from B and rotations. */
void amrap_blend_shapes(amrap *a);

/** The whole alternation. report has history, if any; energies come in units of the space. */
exm_status amrap_alternate(amrap *a, const amrap_options *options, exm_solve_report *report);

/** Derivative by u of 1/2 |X|^2 through the rotations, which follow the pose [eq. 25-30]; slope [rank][d]. The
 * rotations must be those last fitted. */
void amrap_rotation_slope(amrap *a, double *slope);

/** One guarded iteration [appendix A]: 1 where it lowered the objective, 0 at a stationary point. *objective in and
 * out: that of the current state with rotations fitted to its own pose. */
int amrap_guarded_step(amrap *a, const amrap_options *options, double *mu, double *objective, cone_result *result);

#endif
