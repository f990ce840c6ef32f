/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bounded biharmonic weights [Jacobson et al. 2011, eq. 3], all handles at once.
 *
 * With Q = L M^-1 L and the handles' vertices held,
 *
 *   minimise  sum_h 1/2 w_h' Q w_h   subject to  w >= 0 and sum_h w_hp = 1 at every vertex p.
 *
 * Both constraints together say that each vertex's row of weights lies in a simplex. The alternating direction method
 * of multipliers (Boyd et al. 2011, section 5.2) splits that from the energy: a linear solve with Q + rho M for all
 * handles, a projection of every row onto the simplex, and a running sum of what they disagree on. The solve keeps the
 * rows' sums by itself, since constants cost no energy.
 *
 * At a fixed rho this is slow, thousands of steps, because Q spans many orders of magnitude: where it is small beside
 * rho the free parts creep, where it is large the bounds do. A few steps each at rising rho take the scales one after
 * another, coarse ones first, as a multigrid would. The coarsest two are gone through twice: they decide where the
 * bounds are met. Six steps at each rho, and a factorisation for each, come within a few parts in a thousand of the
 * optimal energy. (The weights themselves are then within a few hundredths of the optimal ones where those hardly
 * matter to the energy, far from handles, and much closer elsewhere.)
 *
 * What is returned are the projected weights: exact zeros, exact sums. The projection of slightly negative weights has
 * kinks, which a fourth-order energy punishes: when the energy is nearly the same before and after it, or no longer
 * changes with rho, that is as good as it gets. */
#include "weights/bounded_biharmonic.h"

#include <math.h>
#include <string.h>

#include "linalg/cholesky.h"
#include "weights/handles.h"

/* rho, in units of the lowest eigenvalue of Q against M, which makes it independent of the scale of mesh and energy.
 * The last ones are for the finest meshes. */
static double const RHOS[] = {10, 300, 10, 300, 3e4, 3e6, 3e8, 3e10, 3e12, 3e14};
enum { LEVELS = sizeof RHOS / sizeof *RHOS, FEWEST_LEVELS = 6, STEPS = 6, EIGENVALUE_STEPS = 4 };

/* Over-relaxation [Boyd et al., section 3.4.3]. */
static double const RELAXATION = 1.6;

/* Relative differences of energy: what the projection may cost, or how little another rho may change, to stop at; and a
 * cost that is worth a warning. */
static double const CONVERGED = 2e-3, STEADY = 5e-4, FAILED = 2e-2;

/* Bounds that are violated by no more than this are not. */
static double const FEASIBLE = 1e-7;

/* Taken off all weights of a vertex before they are scaled to sum to 1 again: that leaves out the handles that hardly
 * count, a third to a half of those that are not zero, and leaves no jump. It costs a ten-thousandth of the energy; ten
 * times as much would leave one more handle in five out, at a cost of half a hundredth. */
static double const NEGLIGIBLE = 1e-5;

/* Where rounding leaves a matrix of slivers indefinite, its diagonal is raised by these shares. */
static double const RAISES[] = {0, 1e-13, 1e-11, 1e-9};
enum { RAISE_COUNT = sizeof RAISES / sizeof *RAISES };

#define NONE UINT32_MAX

typedef struct problem {
  size_t vertex_count, handle_count, free_count;
  uint32_t *owners;       /* [V] the handle that holds a vertex, or NONE */
  uint32_t *places;       /* [V] where a free vertex is in what follows, or NONE */
  sparse laplacian;       /* [V] whole */
  double *inverse_masses; /* [V] in units of the mean */
  double *masses;         /* [free] */
  sparse energy, shifted; /* [free] lower: Q, and Q + rho M */
  double *linear;         /* [free][H] of the held vertices: the gradient is Q w + linear */
  double *solution;       /* [free][H] w after the solve */
  double *projected;      /* [free][H] w after the projection */
  double *split;          /* [free][H] w less the scaled multipliers: what is projected */
  cholesky *factor;
} problem;

/* ----------------------------------------------------------------------------------------------------------- set-up */

static exm_status number_vertices(arena *memory, const exm_handles *handles, problem *p)
{
  p->owners = ARENA_NEW(memory, uint32_t, p->vertex_count);
  p->places = ARENA_NEW(memory, uint32_t, p->vertex_count);
  if (!p->owners || !p->places) {
    return status_no_memory("skinning weights");
  }
  for (size_t v = 0; v < p->vertex_count; v++) {
    p->owners[v] = NONE;
  }
  for (size_t h = 0; h < handles->count; h++) {
    for (size_t i = handles->vertex_offsets[h]; i < handles->vertex_offsets[h + 1]; i++) {
      p->owners[handles->vertices[i]] = (uint32_t)h;
    }
  }
  for (size_t v = 0; v < p->vertex_count; v++) {
    p->places[v] = p->owners[v] == NONE ? (uint32_t)p->free_count++ : NONE;
  }
  return EXM_OK;
}

static exm_status allocate(arena *memory, const mesh *reference, problem *p)
{
  double total = 0;
  size_t const entries = p->free_count * p->handle_count;
  p->inverse_masses = ARENA_NEW(memory, double, p->vertex_count);
  p->masses = ARENA_NEW(memory, double, p->free_count);
  p->linear = ARENA_NEW(memory, double, entries);
  p->solution = ARENA_NEW(memory, double, entries);
  p->projected = ARENA_NEW(memory, double, entries);
  p->split = ARENA_NEW(memory, double, entries);
  if (!p->inverse_masses || !p->masses || !p->linear || !p->solution || !p->projected || !p->split ||
      entries / p->handle_count != p->free_count) {
    return status_no_memory("skinning weights");
  }
  for (size_t v = 0; v < p->vertex_count; v++) {
    total += reference->masses[v];
  }
  for (size_t v = 0; v < p->vertex_count; v++) {
    double const mass = reference->masses[v] / total * (double)p->vertex_count;
    p->inverse_masses[v] = 1 / mass;
    if (p->places[v] != NONE) {
      p->masses[p->places[v]] = mass;
    }
  }
  return EXM_OK;
}

/* Q restricted to free vertices, and its columns of held ones summed into the linear term. Numbering keeps the order of
 * vertices, and so rows stay sorted. */
static exm_status restrict_energy(arena *memory, const sparse *whole_energy, problem *p)
{
  size_t const entries = (size_t)whole_energy->starts[p->vertex_count], H = p->handle_count;
  sparse *q = &p->energy;
  q->size = p->free_count;
  q->starts = ARENA_NEW(memory, int32_t, p->free_count + 1);
  q->rows = ARENA_NEW(memory, int32_t, entries);
  q->values = ARENA_NEW(memory, double, entries);
  double *shifted = ARENA_NEW(memory, double, entries);
  if (!q->starts || !q->rows || !q->values || !shifted) {
    return status_no_memory("skinning weights");
  }
  int32_t kept = 0;
  for (size_t j = 0; j < p->vertex_count; j++) {
    for (int32_t e = whole_energy->starts[j]; e < whole_energy->starts[j + 1]; e++) {
      size_t const i = (size_t)whole_energy->rows[e];
      double const value = whole_energy->values[e];
      if (p->places[i] != NONE && p->places[j] != NONE) {
        q->rows[kept] = (int32_t)p->places[i];
        q->values[kept++] = value;
      } else if (p->places[i] != NONE) {
        p->linear[p->places[i] * H + p->owners[j]] += value;
      } else if (p->places[j] != NONE) {
        p->linear[p->places[j] * H + p->owners[i]] += value;
      }
    }
    if (p->places[j] != NONE) {
      q->starts[p->places[j] + 1] = kept;
    }
  }
  p->shifted = *q;
  p->shifted.values = shifted;
  return EXM_OK;
}

static exm_status set_up(arena *memory, const mesh *reference, const exm_handles *handles, problem *p)
{
  arena scratch = {0};
  sparse lower, whole_energy;
  p->vertex_count = reference->vertex_count;
  p->handle_count = handles->count;
  TRY(number_vertices(memory, handles, p));
  TRY(allocate(memory, reference, p));
  exm_status status =
      sparse_laplacian(&scratch, reference->vertex_count, reference->triangle_count,
                       (const uint32_t(*)[3])reference->triangles, (const double(*)[3])reference->cotangents, &lower);
  if (status < 0 || (status = sparse_whole(memory, &lower, &p->laplacian)) < 0 ||
      (status = sparse_square(&scratch, &p->laplacian, p->inverse_masses, &whole_energy)) < 0) {
    goto done;
  }
  status = restrict_energy(memory, &whole_energy, p);
done:
  arena_release(&scratch);
  return status;
}

/* ------------------------------------------------------------------------------------------------------------ steps */

/* Factor Q + rho M. */
static exm_status factor(problem *p, double rho)
{
  exm_status status = EXM_ERROR_NUMERIC;
  for (size_t attempt = 0; attempt < RAISE_COUNT && status == EXM_ERROR_NUMERIC; attempt++) {
    for (size_t j = 0; j < p->free_count; j++) {
      size_t const begin = (size_t)p->energy.starts[j], end = (size_t)p->energy.starts[j + 1];
      memcpy(p->shifted.values + begin, p->energy.values + begin, (end - begin) * sizeof(double));
      p->shifted.values[begin] += RAISES[attempt] * p->energy.values[begin] + rho * p->masses[j];
    }
    status = p->factor ? cholesky_refactor(p->factor, &p->shifted) : cholesky_create(&p->shifted, &p->factor);
  }
  return status;
}

/* The weights that minimise the energy without bounds; they sum to 1 by themselves. */
static exm_status solve_unbounded(problem *p)
{
  TRY(factor(p, 0));
  for (size_t i = 0; i < p->free_count * p->handle_count; i++) {
    p->solution[i] = -p->linear[i];
  }
  return cholesky_solve_rows(p->factor, p->handle_count, p->solution);
}

/* The point of the simplex {z >= 0, sum z = 1} closest to v: z = max(v - t, 0), t found by leaving out what it makes
 * negative until nothing is (Michelot 1986). */
static void project(size_t count, const double *v, double *z)
{
  double threshold = -INFINITY;
  size_t kept = count + 1, before;
  do {
    double sum = 0;
    before = kept;
    kept = 0;
    for (size_t h = 0; h < count; h++) {
      int const counts = v[h] > threshold;
      sum += counts ? v[h] : 0;
      kept += (size_t)counts;
    }
    threshold = (sum - 1) / (double)kept;
  } while (kept < before);
  for (size_t h = 0; h < count; h++) {
    z[h] = v[h] > threshold ? v[h] - threshold : 0;
  }
}

/* One iteration but for the factorisation: project, and solve with what was projected. */
static exm_status step(problem *p, double rho)
{
  size_t const H = p->handle_count;
  for (size_t i = 0; i < p->free_count; i++) {
    double *x = p->solution + i * H, *z = p->projected + i * H, *v = p->split + i * H;
    double const weight = rho * p->masses[i];
    project(H, v, z);
    for (size_t h = 0; h < H; h++) {
      x[h] = weight * (2 * z[h] - v[h]) - p->linear[i * H + h];
    }
  }
  TRY(cholesky_solve_rows(p->factor, H, p->solution));
  for (size_t i = 0; i < p->free_count * H; i++) {
    p->split[i] += RELAXATION * (p->solution[i] - p->projected[i]);
  }
  return EXM_OK;
}

/* The multipliers, rho (projected - split), stay as they are when rho changes. */
static void rescale_multipliers(problem *p, double ratio)
{
  size_t const H = p->handle_count;
  for (size_t i = 0; i < p->free_count; i++) {
    double *z = p->projected + i * H, *v = p->split + i * H;
    project(H, v, z);
    for (size_t h = 0; h < H; h++) {
      v[h] = z[h] + (v[h] - z[h]) * ratio;
    }
  }
}

/* ----------------------------------------------------------------------------------------------------- measurements */

/* sum_h 1/2 w_h' L M^-1 L w_h for rows [free][H]: differences first, to keep digits. row [H] is scratch. */
static double energy_of(const problem *p, const double *rows, double *row)
{
  size_t const H = p->handle_count;
  double total = 0;
  for (size_t i = 0; i < p->vertex_count; i++) {
    memset(row, 0, H * sizeof *row);
    for (int32_t e = p->laplacian.starts[i]; e < p->laplacian.starts[i + 1]; e++) {
      size_t const j = (size_t)p->laplacian.rows[e];
      if (p->places[j] == NONE) {
        row[p->owners[j]] += p->laplacian.values[e];
        continue;
      }
      const double *w = rows + p->places[j] * H;
      for (size_t h = 0; h < H; h++) {
        row[h] += p->laplacian.values[e] * w[h];
      }
    }
    for (size_t h = 0; h < H; h++) {
      total += 0.5 * p->inverse_masses[i] * row[h] * row[h];
    }
  }
  return total;
}

/* The lowest eigenvalue of Q x = lambda M x, a few steps of inverse iteration from above: its order of magnitude is
 * what matters. Needs Q factored. */
static exm_status lowest_eigenvalue(problem *p, arena *memory, double *eigenvalue)
{
  double *x = ARENA_NEW(memory, double, p->free_count), *y = ARENA_NEW(memory, double, p->free_count);
  if (!x || !y) {
    return status_no_memory("skinning weights");
  }
  for (size_t i = 0; i < p->free_count; i++) {
    x[i] = 1;
  }
  for (int step = 0; step < EIGENVALUE_STEPS; step++) {
    double xx = 0, xy = 0, yy = 0;
    for (size_t i = 0; i < p->free_count; i++) {
      y[i] = p->masses[i] * x[i];
    }
    TRY(cholesky_solve(p->factor, 1, y));
    for (size_t i = 0; i < p->free_count; i++) {
      xx += p->masses[i] * x[i] * x[i];
      xy += p->masses[i] * x[i] * y[i];
      yy += p->masses[i] * y[i] * y[i];
    }
    *eigenvalue = xx / xy;
    for (size_t i = 0; i < p->free_count; i++) {
      x[i] = y[i] / sqrt(yy);
    }
  }
  return EXM_OK;
}

static int is_feasible(const problem *p, const double *rows)
{
  double lowest = 0;
  for (size_t i = 0; i < p->free_count * p->handle_count; i++) {
    lowest = fmin(lowest, rows[i]);
  }
  return lowest >= -FEASIBLE;
}

/* The energy of the projected solution, and the share of it that the projection added. */
static double projected_energy(problem *p, double *row, double *cost)
{
  size_t const H = p->handle_count;
  for (size_t i = 0; i < p->free_count; i++) {
    project(H, p->solution + i * H, p->projected + i * H);
  }
  double const energy = energy_of(p, p->projected, row);
  *cost = (energy - energy_of(p, p->solution, row)) / energy;
  return energy;
}

/* -------------------------------------------------------------------------------------------------------- the whole */

static exm_status iterate(problem *p, const progress *report, double unit, double *row)
{
  double cost = INFINITY, energy = INFINITY;
  memcpy(p->split, p->solution, p->free_count * p->handle_count * sizeof *p->split);
  for (int level = 0; level < LEVELS; level++) {
    double const rho = RHOS[level] * unit;
    TRY(progress_report(report, (level + 1.0) / (LEVELS + 1), "computing weights"));
    TRY(factor(p, rho));
    if (level > 0) {
      rescale_multipliers(p, RHOS[level - 1] / RHOS[level]);
    }
    for (int i = 0; i < STEPS; i++) {
      TRY(step(p, rho));
    }
    if (level + 1 < FEWEST_LEVELS) {
      continue;
    }
    double const before = energy;
    energy = projected_energy(p, row, &cost);
    if (cost < CONVERGED || fabs(energy - before) < STEADY * energy) {
      return EXM_OK;
    }
  }
  return cost < FAILED ? EXM_OK
                       : status_set(EXM_WARNING_NOT_CONVERGED,
                                    "skinning weights after %d steps: the bounds still cost %.1f %% of the energy",
                                    LEVELS * STEPS, 100 * cost);
}

static void write_weights(const problem *p, const double *rows, double *row, float *weights)
{
  size_t const H = p->handle_count;
  for (size_t v = 0; v < p->vertex_count; v++) {
    if (p->places[v] == NONE) {
      for (size_t h = 0; h < H; h++) {
        weights[h * p->vertex_count + v] = h == p->owners[v] ? 1 : 0;
      }
      continue;
    }
    project(H, rows + p->places[v] * H, row);
    double sum = 0;
    for (size_t h = 0; h < H; h++) {
      /* No more than a tenth of an even share, or very many handles might leave nothing. */
      row[h] = fmax(0, row[h] - fmin(NEGLIGIBLE, 0.1 / (double)H));
      sum += row[h];
    }
    for (size_t h = 0; h < H; h++) {
      weights[h * p->vertex_count + v] = (float)(row[h] / sum);
    }
  }
}

exm_status weights_bounded_biharmonic(const mesh *reference, const exm_handles *handles, const progress *report,
                                      float *weights)
{
  arena memory = {0};
  problem p = {0};
  TRY(handles_check_coverage(reference, handles));
  TRY(progress_report(report, 0, "computing weights"));
  exm_status status = set_up(&memory, reference, handles, &p);
  double *row = ARENA_NEW(&memory, double, handles->count);
  if (status == EXM_OK && !row) {
    status = status_no_memory("skinning weights");
  }
  if (status == EXM_OK && p.free_count > 0) {
    status = solve_unbounded(&p);
    if (status == EXM_OK && !is_feasible(&p, p.solution)) {
      double unit = 0;
      status = lowest_eigenvalue(&p, &memory, &unit);
      status = status < 0 ? status : iterate(&p, report, unit, row);
    }
  }
  if (status >= 0) {
    exm_status const last = progress_report(report, 1, "computing weights");
    status = last < 0 ? last : status;
  }
  if (status >= 0) {
    write_weights(&p, p.solution, row, weights);
  }
  cholesky_destroy(p.factor);
  arena_release(&memory);
  return status;
}
