/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Fast blended transformations [Blended, section 4], reduced so that an iteration is rotations only.
 *
 * With Gamma = D'LD + beta_lc X'X + beta_sm Lambda of eq. 18 and any root W W' = Gamma^-1, poses are T = W z with
 *
 *     z = W'X' beta_lc Y + alpha U'R,    U = K W,
 *
 * R the stacked transposed rotations; the matrices that rotations are fitted to are K T = U z. For one exemplar that is
 * y + alpha G R with y = U W'X' beta_lc Y and G = U U', a few dozen rows square, and its energy is
 *
 *     2 E = beta_lc |Y|^2 - |W'X' beta_lc Y|^2 - 2 alpha <R, y> + alpha^2 (tr V'LV - <R, G R>),
 *
 * so that the scale step (eq. 16) and the global step (eq. 19) are taken together, at the minimum over both: the
 * printed alternation of the two creeps, because each holds on to what the other found last. */
#ifndef EXM_DEFORM_BLENDED_BLENDED_H
#define EXM_DEFORM_BLENDED_BLENDED_H

#include "subspace/constraints.h"
#include "subspace/edge_energy.h"

/** A dictionary of a stage, as it is whatever the constraints are. Atoms are columns of the joint dictionary. */
typedef struct blended_basis {
  size_t atom_count, rank;
  size_t *atoms;   /* [atom_count] of the joint dictionary, rising */
  double *basis;   /* [atom_count][rank] T = basis u; orthonormal in the elastic energy, the masses and a trace of the
                      bending */
  double *elastic; /* [rank][rank] D'L D */
  double *bending; /* [rank][rank] Lambda of eq. 6 */
  double *proxies; /* [S][G d][rank] K */
} blended_basis;

/** What follows from the constraints' rows and weights. */
typedef struct blended_factor {
  double *rows;      /* [rows][rank] X */
  double *root;      /* [rank][rank] W */
  double *responses; /* [S][G d][rank] U */
  double *green;     /* [S][G d][G d] */
  double *held;      /* [rows][rank] X W */
  /* For the targets of the current solve. */
  double *z;   /* [rank][d] W'X' beta_lc Y */
  double *y;   /* [S][G d][d] U z */
  double lost; /* beta_lc |Y|^2 - |z|^2 */
} blended_factor;

/* Rows up to this many are compared with each other. */
enum { BLENDED_COMPARED = 128 };
enum { BLENDED_FIRST = 0, BLENDED_LAST = 1, BLENDED_STAGES = 2 };

/** Rows of which the second is a multiple of the first on everything that the dictionary can show. */
typedef struct parallel_rows {
  size_t first, second;
  double factor;
} parallel_rows;

/** The rows X of all constraints, and both stages' factors: made anew, as a whole, when constraints change. */
typedef struct blended_constraints {
  arena memory;
  size_t row_count, handle_row_count; /* those of handles come first */
  constraint_row *rows;
  double *weights;      /* [rows] without beta_lc */
  double *sums;         /* [rows] of a row's coefficients: 1 for positions, 0 for directions and differences */
  double *joint;        /* [rows][joint atoms] H D */
  double *on_exemplars; /* [rows][S d] H V_s */
  blended_factor factors[BLENDED_STAGES];
  double *free_root; /* [rank][rank] a root as in blended_factor, of the last stage without constraints */
  double *net_gram;  /* [first stage's atoms][] beta_lc X'X, for the elastic net */
  /* Scratch of a solve. */
  double *targets, *framed; /* [rows][d] Y as given, and in the frame of the best exemplar */
  double *weighted;         /* [rows][d] */
  size_t pair_count;        /* of parallel rows, among the first BLENDED_COMPARED */
  parallel_rows *pairs;
  size_t updates; /* of the roots since they were made from scratch */
} blended_constraints;

/** The similarity that takes an exemplar's constraints to the targets best: y = scale turn v + shift. */
typedef struct blended_frame {
  double turn[9], shift[3], scale;
  double residual;
} blended_frame;

typedef struct blended {
  size_t dimension, group_count, exemplar_count;
  size_t compared_count; /* exemplars whose rigidity counts */
  size_t joint_count;    /* atoms of the joint dictionary */
  const edge_energy *energy;
  blended_basis bases[BLENDED_STAGES];
  double *first_proxies; /* [S][G d][first stage's atoms] K of its raw atoms, for its beginning */
  double *first_bending; /* [first stage's atoms] diagonal of Lambda */
  double beta_lc, beta_sm;
  blended_constraints held;
  /* The solution. */
  blended_frame frame;
  blended_frame *frames; /* [S] of all exemplars */
  double *rotations;     /* [S][G d][d] transposed, of the stage at work */
  double *fits;          /* [S][G d][d] what they are fitted to */
  double *turned;        /* [S][G d][d] G R, or scratch */
  double *started;       /* [S][G d][d] rotations that the minimal stage starts from */
  double *best;          /* [S][G d][d] and its results */
  double *reached;       /* [rank][d] U'R */
  double *z, *u;         /* [rank][d] */
  double *coefficients;  /* [joint atoms][d] T */
  double *net_x, *net_product, *net_scratch, *net_lasso, *net_ridge;
  double scale;    /* alpha in the frame */
  size_t exemplar; /* of least energy */
  int has_solution;
} blended;

typedef struct blended_options {
  double sparsity, tolerance;
  int is_plain, is_warm;
  int scale; /* exm_scale */
  int32_t average_iterations, minimal_iterations, final_iterations;
} blended_options;

/** Bases of both stages from the joint dictionary's energies. bending [joint][joint]. */
exm_status blended_basis_create(arena *owner, const edge_energy *energy, const double *bending, size_t atom_count,
                                const size_t *atoms, blended_basis *out);

/** Scratch and solution, once the bases are there. */
exm_status blended_allocate(arena *owner, blended *b);

/* ----------------------------------------------------------------------------------------------------- constraints */

/** Rows of the handles, at weight 1, and the factors. `held` is copied. */
exm_status blended_constraints_begin(blended *b, const dictionary *d, const constraints *held);

/** Behind the rows that are there. Both leave everything as it was on failure. */
exm_status blended_constraints_add(blended *b, const dictionary *d, size_t count, const constraint_row *rows,
                                   const double *weights);
exm_status blended_constraints_remove(blended *b, size_t first, size_t count);

/** New weights [row_count] for all rows. */
exm_status blended_constraints_weigh(blended *b, const double *weights);

exm_status blended_set_energies(blended *b, double beta_lc, double beta_sm);

/* ------------------------------------------------------------------------------------------------------- the solve */

/** targets [rows][d] are in b->held.targets. Finds the frames of all exemplars, the best one's among them, and puts the
 *  constraints there. */
void blended_set_frame(blended *b, int has_scale);
/** The constraints in the frame that is set, and what they do to the proxies of exemplars [first, last). */
void blended_hold(blended *b, int stage, size_t first, size_t last);

/** The beginning, eq. 22 or 23: rotations of all exemplars into b->rotations. *used: the number of atoms in use. */
exm_status blended_begin(blended *b, const blended_options *options, size_t *used);

/** Average ARAP, eq. 9-11, from b->rotations; energies of the iterations into the report's history. Returns the last.
 */
double blended_average(blended *b, const blended_options *options, exm_solve_report *report);

/** Minimal ARAP for exemplar s in a stage's dictionary, eq. 13, from b->rotations of s. Returns its energy. */
double blended_minimal(blended *b, int stage, size_t s, int32_t iterations, const blended_options *options,
                       exm_solve_report *report);

/** The whole schedule; energies in units of the frame. */
exm_status blended_solve(blended *b, const blended_options *options, exm_solve_report *report,
                         exm_blended_outcome *outcome);

/** The pose of exemplar s's rotations as they are: b->coefficients, in the frame. */
void blended_pose(blended *b, int stage, size_t s);

#endif
