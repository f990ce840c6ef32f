/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/icp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "linalg/dense.h"
#include "linalg/rotation.h"

/* What all of the scan's points weigh, beside the elastic energy in units of the mesh's diagonal: at first no more than
 * a few landmarks, in the end as much as they can without bending the mesh to noise. */
static double const STRENGTH_FIRST = 100, STRENGTH_LAST = 30000;
/* Local and global steps between two rounds of correspondences. */
enum { INNER = 1 };
/* The preconditioner is made anew every so many rounds. */
enum { FACTOR_EVERY = 3 };
/* The reach follows the residuals of the round before, robustly: so many medians. */
static double const MEDIANS = 4;
/* Rounds that move the median residual by less than this share have settled. */
static double const SETTLED = 2e-3;

static exm_status choose_scan_samples(arena *owner, icp *fit)
{
  const scan *target = fit->request->target;
  size_t const wanted = fit->request->settings.sample_count;
  size_t const count = wanted < target->point_count ? wanted : target->point_count;
  fit->scan_samples = ARENA_NEW(owner, uint32_t, count);
  if (!fit->scan_samples) {
    return status_no_memory("the fit");
  }
  /* Leaves of the tree lie side by side in space: every so many-th point is an even choice. */
  size_t const places = target->tree.leaf_count * 8;
  for (size_t i = 0, made = 0, passed = 0; i < places && made < count; i++) {
    uint32_t const point = target->tree.indices[i];
    if (point != NEAREST_NONE && passed++ * count / target->point_count >= made) {
      fit->scan_samples[made++] = point;
      fit->scan_sample_count = made;
    }
  }
  for (size_t i = 0; i < target->point_count; i++) {
    fit->scan_area += target->areas[i];
  }
  return EXM_OK;
}

exm_status icp_create(arena *owner, registration *r, const fit_request *request, const landmark_rows *landmarks,
                      shape *surface, icp *out)
{
  const blended_basis *basis = registration_basis(r);
  const blended *b = &r->deformer->solver;
  size_t const wanted = request->settings.sample_count;
  size_t const stacked = b->exemplar_count * b->group_count * 9;
  *out = (icp){.r = r, .request = request, .landmarks = landmarks, .surface = surface};
  out->sample_count = wanted < r->sample_count ? wanted : r->sample_count;
  TRY(choose_scan_samples(owner, out));
  size_t const most = out->sample_count > out->scan_sample_count ? out->sample_count : out->scan_sample_count;
  size_t const capacity = out->sample_count + out->scan_sample_count + landmarks->count;
  out->queries = arena_array(owner, most, sizeof *out->queries);
  out->directions = arena_array(owner, most, sizeof *out->directions);
  out->found = ARENA_NEW(owner, uint32_t, most);
  out->squared = ARENA_NEW(owner, double, most);
  out->feet = ARENA_NEW(owner, foot, most);
  out->distances = ARENA_NEW(owner, double, capacity);
  out->rotations = ARENA_NEW(owner, double, stacked);
  out->fits = ARENA_NEW(owner, double, stacked);
  out->elastic = ARENA_NEW(owner, double, basis->rank * 3);
  out->landmark_basis = ARENA_NEW(owner, double, landmarks->count * basis->rank);
  if (!out->queries || !out->directions || !out->found || !out->squared || !out->feet || !out->distances ||
      !out->rotations || !out->fits || !out->elastic || !out->landmark_basis) {
    return status_no_memory("the fit");
  }
  for (size_t i = 0; i < landmarks->count; i++) {
    size_t const first = landmarks->offsets[i];
    TRY(registration_rows(r, 1, landmarks->offsets[i + 1] - first, landmarks->vertices + first,
                          landmarks->coefficients + first, out->landmark_basis + i * basis->rank));
  }
  return pulls_create(owner, r, capacity, &out->pulls);
}

/** Best rotations of exemplar s for the pose, and its energy [Blended, eq. 7] over the scale, which counts growth and
 *  shrinking alike: at its least over alpha, alpha is a ratio of sizes, where eq. 16 comes out small wherever rotations
 *  do not explain the pose. size: tr V~'L V~. */
static double fit_exemplar(icp *fit, size_t s, double size, double *scale)
{
  const blended *b = &fit->r->deformer->solver;
  const blended_basis *basis = fit->pulls.basis;
  size_t const rows = b->group_count * 3, rank = basis->rank;
  double *R = fit->rotations + s * rows * 3, *fits = fit->fits + s * rows * 3;
  double const own = b->energy->own[s];
  dense_times(rows, rank, 3, basis->proxies + s * rows * rank, fit->pose.u, fits);
  rotation_fit(3, b->group_count, fits, R);
  double const along = dense_dot(rows * 3, R, fits);
  *scale = fit->request->settings.scale ? sqrt(size / own) : fit->request->settings.known_scale / fit->pose.frame.scale;
  return (size / *scale - 2 * along + *scale * own) / 2;
}

/** [Blended, eq. 12]: the exemplar that the pose is closest to. */
static void local_step(icp *fit)
{
  const blended *b = &fit->r->deformer->solver;
  size_t const rank = fit->pulls.basis->rank;
  dense_times(rank, rank, 3, fit->pulls.basis->elastic, fit->pose.u, fit->elastic);
  double const size = dense_dot(rank * 3, fit->pose.u, fit->elastic);
  fit->energy = INFINITY;
  for (size_t s = 0; s < b->compared_count; s++) {
    double scale = 1;
    double const energy = fit_exemplar(fit, s, size, &scale);
    if (energy < fit->energy) {
      fit->energy = energy;
      fit->pose.exemplar = s;
      fit->pose.scale = scale;
    }
  }
}

static void global_step(icp *fit)
{
  const blended *b = &fit->r->deformer->solver;
  const blended_basis *basis = fit->pulls.basis;
  size_t const rows = b->group_count * 3, s = fit->pose.exemplar;
  dense_times_transposed(rows, basis->rank, 3, basis->proxies + s * rows * basis->rank, basis->rank,
                         fit->rotations + s * rows * 3, fit->elastic);
  for (size_t i = 0; i < basis->rank * 3; i++) {
    fit->elastic[i] *= fit->pose.scale;
  }
  pulls_solve(&fit->pulls, fit->elastic, fit->pose.u);
}

static int compare(const void *a, const void *b)
{
  double const x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/** Root of the median squared distance; 0 where there are none. */
static double median_distance(icp *fit)
{
  qsort(fit->distances, fit->distance_count, sizeof *fit->distances, compare);
  return fit->distance_count > 0 ? sqrt(fit->distances[fit->distance_count / 2]) : 0;
}

exm_status icp_run(icp *fit, const progress *report)
{
  const exm_registration_fit_settings *settings = &fit->request->settings;
  double const unit = fit->r->size * fit->pose.scale * fit->pose.frame.scale;
  double const least_reach = 3 * fit->request->target->report.spacing;
  double const beta = fit->r->deformer->solver.beta_lc;
  double before = INFINITY;
  fit->scan_area /= unit * unit;
  fit->reach = fmax(settings->reach * unit, least_reach);
  for (int32_t i = 0; i < settings->iterations; i++) {
    double const t = settings->iterations > 1 ? (double)i / (double)(settings->iterations - 1) : 1;
    double const strength = STRENGTH_FIRST * pow(STRENGTH_LAST / STRENGTH_FIRST, t) * settings->tightness;
    TRY(icp_correspond(fit, strength, beta * pow(fmax(settings->landmark_share, 1e-6), t), 0.4 + 0.6 * t));
    if (i % FACTOR_EVERY == 0) {
      TRY(pulls_factor(&fit->pulls));
    }
    for (int k = 0; k < INNER; k++) {
      local_step(fit);
      global_step(fit);
    }
    local_step(fit);
    double const median = median_distance(fit);
    fit->reach = fmin(fit->reach, fmax(MEDIANS * median, least_reach));
    fit->converged = t > 0.99 && fabs(before - median) <= SETTLED * before;
    before = median;
    fit->iterations = i + 1;
    TRY(shape_pose(fit->surface, &fit->pose));
    TRY(progress_report(report, (double)(i + 1) / (double)settings->iterations, "fitting to the scan"));
  }
  return EXM_OK;
}
