/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Blend weights and pose with rotations held [AMRAP, eq. 20], as a cone program in the blend weights alone. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "deform/amrap/amrap.h"
#include "linalg/dense.h"

/* Gap of the cone program relative to its natural size. */
static double const CONE_TOLERANCE = 1e-9;
/* How strongly, relative to the energy, blends are drawn to the first exemplar where lambda leaves them undetermined.
 */
static double const TIE_BREAK = 1e-6;
/* Rounds of adding exemplars to the working set; the next iteration goes on where these were not enough, and the gap
 * that is reported says so. */
enum { WORKING_SET_ROUNDS = 12, WORKING_SET_ROUNDS_LARGE = 2, WORKING_SET_ROUNDS_ONLY = 60 };

void amrap_turn(const amrap *a, size_t row, size_t g, size_t s, double *out)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count;
  const double *rotation = a->rotations + (g * S + s) * d * d, *shape = r->shapes + (row * S + s) * d;
  for (size_t k = 0; k < d; k++) {
    out[k] = 0;
    for (size_t j = 0; j < d; j++) {
      out[k] += shape[j] * rotation[j * d + k];
    }
  }
}

void amrap_blend_shapes(amrap *a)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count;
  double turned[3];
  memset(a->X, 0, r->shape_rows * d * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t s = 0; s < S; s++) {
      double const weight = a->B[g * S + s];
      for (size_t i = r->shape_offsets[g]; weight != 0 && i < r->shape_offsets[g + 1]; i++) {
        amrap_turn(a, i, g, s, turned);
        for (size_t k = 0; k < d; k++) {
          a->X[i * d + k] += weight * turned[k];
        }
      }
    }
  }
}

static int is_damped(const amrap_damping *damping)
{
  return damping->mu > 0 && damping->u0 && damping->B0 && damping->slope;
}

/** The pose of blended proxies X: u = (Ux'X + mu u0 - slope) / (1 + mu), y = Ux u + Fx c. */
static void pose_of(amrap *a, const amrap_damping *damping, const double *X, double *u, double *y)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension;
  reduced_to_basis(r, d, X, a->carried, u);
  for (size_t i = 0; i < r->rank * d && is_damped(damping); i++) {
    u[i] = (u[i] + damping->mu * damping->u0[i] - damping->slope[i]) / (1 + damping->mu);
  }
  reduced_to_shapes(r, d, u, a->carried, y);
  dense_axpy(r->shape_rows * d, 1, a->Fxc, y);
}

/** X, u and y of the blend weights as they are. */
static void pose(amrap *a, const amrap_damping *damping)
{
  amrap_blend_shapes(a);
  pose_of(a, damping, a->X, a->u, a->y);
}

/** The program's constant: what is minimised, at the pose that the search starts at. The linear part is <Z_i, X - y>.
 */
static double start(amrap *a, const amrap_damping *damping)
{
  double energy = amrap_elastic_energy(a, a->u, a->y, a->X);
  const double *u0 = damping->u0, *slope = damping->slope;
  for (size_t i = 0; i < a->reduced.rank * a->reduced.dimension && u0 && slope; i++) {
    double const step = a->u[i] - u0[i];
    energy += (slope[i] * step + damping->mu * step * step / 2) * (damping->mu > 0);
  }
  return fmax(energy, 0);
}

/** Draw one unknown, whose own energy is `weight`, to `from`; returns what that adds to the constant. */
static double draw_unknown(double weight, double from, double *Q, double *p)
{
  *Q += weight;
  *p += weight * from;
  return weight * from * from / 2;
}

/** What the unknown B_gs is drawn to: the damping's blend; and without lambda, faintly, to the first exemplar, because
 * many blends are then equally good, and the ones that change least from one exemplar vary smoothly [AMRAP, figure 2
 * d]. */
static double draw(const amrap *a, const amrap_options *options, const amrap_damping *damping, size_t g, size_t s,
                   double *Q, double *p)
{
  double const weight = a->reduced.size * a->reduced.size / (double)(options->is_global ? 1 : a->reduced.group_count);
  double constant = 0;
  if (is_damped(damping) && damping->B0) {
    constant += draw_unknown(damping->mu * weight, damping->B0[g * a->reduced.exemplar_count + s], Q, p);
  }
  if (options->lambda == 0) {
    constant += draw_unknown(TIE_BREAK * weight, s == 0 ? 1 : 0, Q, p);
  }
  return constant;
}

/** Q, p, l of the cone program for the columns chosen: Q = Z'Z - Z'G Z / (1 + mu), p = <Z, y - X>, both from the
 * anchor. constant: that of the anchor. Returns the program's. */
static double assemble_local(amrap *a, const amrap_options *options, const amrap_damping *damping, size_t count,
                             double constant)
{
  const amrap_columns *m = &a->columns;
  size_t const S = a->reduced.exemplar_count;
  for (size_t i = 0; i < count; i++) {
    size_t const slot = m->order[i], g = m->group[slot], s = m->shape[slot];
    const double *row = m->Q + slot * m->limit;
    for (size_t j = 0; j < count; j++) {
      a->Q[i * count + j] = row[m->order[j]];
    }
    a->p[i] = m->slope[slot];
    a->l[i] = options->lambda * sqrt(a->D[g * S + s]);
    constant += draw(a, options, damping, g, s, &a->Q[i * count + i], &a->p[i]);
  }
  return constant;
}

/** Columns of a global blend: the whole of each exemplar, turned, less X; [shape_rows][S d]. Their costs in l. */
static void turn_exemplars(amrap *a, const amrap_options *options, double *turned)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, width = S * d;
  memset(a->l, 0, S * sizeof(double));
  for (size_t g = 0; g < r->group_count; g++) {
    for (size_t s = 0; s < S; s++) {
      a->l[s] += options->lambda * sqrt(a->D[g * S + s]);
      for (size_t i = r->shape_offsets[g]; i < r->shape_offsets[g + 1]; i++) {
        amrap_turn(a, i, g, s, turned + i * width + s * d);
        dense_axpy(d, -1, a->X + i * d, turned + i * width + s * d);
      }
    }
  }
}

/** The same with one blend for all groups: the unknowns are exemplars, Z_s is the whole of exemplar s. */
static double assemble_global(amrap *a, const amrap_options *options, const amrap_damping *damping)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count, width = S * d;
  double constant = start(a, damping);
  double *turned = a->single_blend, *in_basis = a->global_u;
  memset(a->Q, 0, S * S * sizeof(double));
  memset(a->p, 0, S * sizeof(double));
  turn_exemplars(a, options, turned);
  reduced_to_basis(r, width, turned, a->carried, in_basis);
  amrap_columns_anchor(a);
  for (size_t s = 0; s < S; s++) {
    for (size_t i = 0; i < r->shape_rows; i++) {
      const double *row = turned + i * width;
      a->p[s] += dense_dot(d, row + s * d, a->columns.misfit + i * d);
      for (size_t t = 0; t <= s; t++) {
        a->Q[s * S + t] += dense_dot(d, row + s * d, row + t * d);
      }
    }
    for (size_t i = 0; i < r->rank; i++) {
      for (size_t t = 0; t <= s; t++) {
        a->Q[s * S + t] -= dense_dot(d, in_basis + i * width + s * d, in_basis + i * width + t * d) / (1 + damping->mu);
      }
    }
    for (size_t t = 0; t < s; t++) {
      a->Q[t * S + s] = a->Q[s * S + t];
    }
  }
  for (size_t s = 0; s < S; s++) {
    constant += draw(a, options, damping, 0, s, &a->Q[s * S + s], &a->p[s]);
  }
  return constant;
}

static cone_program program_of(const amrap *a, size_t count, size_t blocks, double constant)
{
  return (cone_program){.count = count,
                        .block_count = blocks,
                        .offsets = a->block_offsets,
                        .Q = a->Q,
                        .p = a->p,
                        .l = a->l,
                        .k = constant,
                        .scale = a->reduced.size};
}

static void solve_global(amrap *a, const amrap_options *options, const amrap_damping *damping, cone_result *result)
{
  size_t const S = a->reduced.exemplar_count;
  double const constant = assemble_global(a, options, damping);
  a->block_offsets[0] = 0;
  a->block_offsets[1] = S;
  cone_program const program = program_of(a, S, 1, constant);
  memcpy(a->unknown, a->B, S * sizeof(double));
  cone_solve(&program, &a->cone, CONE_TOLERANCE, a->unknown, result);
  for (size_t g = 0; g < a->reduced.group_count; g++) {
    memcpy(a->B + g * S, a->unknown, S * sizeof(double));
  }
}

/** From the anchor, whose constant is given. */
static void solve_local(amrap *a, const amrap_options *options, const amrap_damping *damping, double constant,
                        const unsigned char *wanted, cone_result *result)
{
  const amrap_columns *m = &a->columns;
  size_t const S = a->reduced.exemplar_count;
  size_t const count = amrap_columns_choose(a, wanted, damping->mu);
  constant = assemble_local(a, options, damping, count, constant);
  cone_program const program = program_of(a, count, a->reduced.group_count, constant);
  for (size_t i = 0; i < count; i++) {
    a->unknown[i] = a->B[m->group[m->order[i]] * S + m->shape[m->order[i]]];
  }
  cone_solve(&program, &a->cone, CONE_TOLERANCE, a->unknown, result);
  for (size_t i = 0; i < count; i++) {
    a->B[m->group[m->order[i]] * S + m->shape[m->order[i]]] = a->unknown[i];
  }
}

/** Gradient of the objective by B_gs at the pose, [S] of group g: <Z_gs, X_g - y_g> / (2 sqrt(E_d)) + lambda
 * sqrt(D_gs).
 */
static void gradients(amrap *a, const amrap_options *options, double root, size_t g, double *slopes)
{
  const reduced_mesh *r = &a->reduced;
  size_t const d = r->dimension, S = r->exemplar_count;
  amrap_moments(a, g, a->turned_G, a->moments);
  for (size_t s = 0; s < S; s++) {
    const double *rotation = a->rotations + (g * S + s) * d * d;
    double slope = 0;
    for (size_t j = 0; j < d; j++) {
      for (size_t k = 0; k < d; k++) {
        slope += rotation[j * d + k] * a->moments[k * S * d + s * d + j];
      }
    }
    slopes[s] = slope / (2 * root) + options->lambda * sqrt(a->D[g * S + s]);
  }
}

/** Keep the exemplars in use in group g, and want the two besides whose use would lower the objective most. slopes [S]:
 * the gradient there. Returns how many are new. */
static size_t extend_group(amrap *a, size_t g, const double *slopes)
{
  size_t const S = a->reduced.exemplar_count;
  unsigned char *wanted = a->wanted + g * S;
  double within = DBL_MAX;
  size_t used = 0, added = 0;
  for (size_t s = 0; s < S; s++) {
    within = wanted[s] ? fmin(within, slopes[s]) : within;
    wanted[s] = a->B[g * S + s] > 0;
    used += wanted[s];
  }
  for (; added < 2 && used + added < a->columns_per_group; added++) {
    size_t best = S;
    for (size_t s = 0; s < S; s++) {
      if (!wanted[s] && slopes[s] < within - CONE_TOLERANCE * a->reduced.size &&
          (best == S || slopes[s] < slopes[best])) {
        best = s;
      }
    }
    if (best == S) {
      break;
    }
    wanted[best] = 1;
  }
  return added;
}

/** Extend the working set of every group. *gap: that of the whole program. Returns how many are new. */
static size_t extend(amrap *a, const amrap_options *options, double quadratic, double *gap)
{
  const reduced_mesh *r = &a->reduced;
  size_t const S = r->exemplar_count;
  double const root = fmax(sqrt(quadratic), 1e-9 * r->size);
  double *slopes = a->slopes;
  size_t added = 0;
  *gap = 0;
  for (size_t i = 0; i < r->shape_rows * r->dimension; i++) {
    a->turned_G[i] = a->X[i] - a->y[i];
  }
  for (size_t g = 0; g < r->group_count; g++) {
    double lowest = DBL_MAX;
    gradients(a, options, root, g, slopes);
    for (size_t s = 0; s < S; s++) {
      *gap += a->B[g * S + s] * slopes[s];
      lowest = fmin(lowest, slopes[s]);
    }
    *gap -= lowest;
    added += extend_group(a, g, slopes);
  }
  return added;
}

/** The exemplars in use. A blend of more than there is room for (few ever are at an optimum) gives up its smallest
 * parts. */
static void start_working_set(amrap *a, size_t g)
{
  size_t const S = a->reduced.exemplar_count;
  double *B = a->B + g * S;
  unsigned char *wanted = a->wanted + g * S;
  double sum = 0;
  for (size_t s = 0; s < S; s++) {
    size_t larger = 0;
    for (size_t t = 0; t < S && B[s] > 0; t++) {
      larger += B[t] > B[s] || (B[t] == B[s] && t < s);
    }
    wanted[s] = B[s] > 0 && larger < a->columns_per_group - 1;
    B[s] = wanted[s] ? B[s] : 0;
    sum += B[s];
  }
  for (size_t s = 0; s < S; s++) {
    B[s] /= sum;
  }
}

/** Many unknowns: solve over the exemplars in use and those that would lower the objective, until none would. */
static void solve_working_set(amrap *a, const amrap_options *options, const amrap_damping *damping, cone_result *result)
{
  const reduced_mesh *r = &a->reduced;
  for (size_t g = 0; g < r->group_count; g++) {
    start_working_set(a, g);
  }
  pose(a, damping);
  amrap_columns_anchor(a);
  double const constant = start(a, damping);
  extend(a, options, constant, &result->gap);
  int const rounds = !options->has_rotations           ? WORKING_SET_ROUNDS_ONLY
                     : r->carriers && options->is_warm ? WORKING_SET_ROUNDS_LARGE
                                                       : WORKING_SET_ROUNDS;
  for (int round = 0; round < rounds; round++) {
    solve_local(a, options, damping, constant, a->wanted, result);
    pose(a, damping);
    if (extend(a, options, result->quadratic, &result->gap) == 0) {
      break;
    }
  }
}

void amrap_solve_blend(amrap *a, const amrap_options *options, const amrap_damping *damping, cone_result *result)
{
  static const amrap_damping none = {0};
  const reduced_mesh *r = &a->reduced;
  damping = damping ? damping : &none;
  /* Without rotations this is the only program, and it should be solved outright where there is room. */
  int const has_room = a->columns_per_group == r->exemplar_count;
  int const takes_all = r->exemplar_count <= AMRAP_ALL_SHAPES || (has_room && !options->has_rotations);
  if (!options->is_global && !takes_all) {
    solve_working_set(a, options, damping, result);
    return;
  }
  pose(a, damping);
  if (options->is_global) {
    solve_global(a, options, damping, result);
  } else {
    amrap_columns_anchor(a);
    solve_local(a, options, damping, start(a, damping), NULL, result);
  }
  pose(a, damping);
}
