/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "registration/icp.h"

/* Across the normal correspondences hold by this share of what they hold along it: enough to keep samples from
 * sliding about on their own, little enough to let them settle. */
static double const SLIP = 0.05;

static nearest_filter filter_for(const icp *fit, const double (*normals)[3])
{
  return (nearest_filter){.normals = normals,
                          .least_cosine = cos(fit->request->settings.max_angle * M_PI / 180),
                          .is_unsigned = !fit->request->target->report.signed_normals};
}

/** Tukey's biweight: 1 at distance 0, 0 from the reach on. */
static double trust(double squared, double reach)
{
  double const t = 1 - squared / (reach * reach);
  return t > 0 ? t * t : 0;
}

static void add_pull(icp *fit, const double target[3], const double normal[3], double weight)
{
  pull *to = &fit->pulls.list[fit->pulls.count++];
  const space *s = &fit->r->deformer->coordinates;
  int const is_known = normal && (normal[0] != 0 || normal[1] != 0 || normal[2] != 0);
  *to = (pull){.weight = weight, .slip = is_known ? SLIP : 1};
  frame_from_point(s, &fit->pose.frame, target, to->target);
  if (is_known) {
    frame_from_direction(s, &fit->pose.frame, normal, to->normal);
  }
}

/** Samples of the mesh and the scan's points next to them; at the scan's rim the mesh goes on where the scan does not.
 */
static void from_mesh(icp *fit, size_t count, double strength)
{
  const scan *target = fit->request->target;
  size_t const rank = fit->pulls.basis->rank;
  nearest_filter const filter = filter_for(fit, (const double(*)[3])target->normals);
  for (size_t i = 0; i < count; i++) {
    memcpy(fit->queries[i], fit->surface->positions[fit->r->samples[i]], sizeof *fit->queries);
    memcpy(fit->directions[i], fit->surface->normals[fit->r->samples[i]], sizeof *fit->directions);
  }
  nearest_find(&target->tree, (const double(*)[3])fit->queries, count, (const double(*)[3])fit->directions, &filter,
               fit->reach, fit->request->settings.thread_count, fit->found, fit->squared);
  for (size_t i = 0; i < count; i++) {
    uint32_t const point = fit->found[i];
    if (point == NEAREST_NONE || target->boundary[point]) {
      continue;
    }
    double const weight = strength / (double)count * trust(fit->squared[i], fit->reach);
    memcpy(fit->pulls.rows + fit->pulls.count * rank, fit->r->sample_rows + i * rank, rank * sizeof(double));
    add_pull(fit, target->points[point], target->normals[point], weight);
    fit->distances[fit->distance_count++] = fit->squared[i];
  }
}

/** Is the foot at the mesh's own rim, where the scan may go on? */
static int is_at_rim(const icp *fit, const foot *at)
{
  const uint32_t *t = fit->r->reference->triangles[at->triangle];
  for (size_t c = 0; c < 3; c++) {
    if (at->barycentric[c] > 0 && !fit->r->is_rim[t[c]]) {
      return 0;
    }
  }
  return 1;
}

static double foot_coordinate(const icp *fit, const foot *at, size_t axis)
{
  const uint32_t *t = fit->r->reference->triangles[at->triangle];
  double sum = 0;
  for (size_t c = 0; c < 3; c++) {
    sum += at->barycentric[c] * fit->surface->positions[t[c]][axis];
  }
  return sum;
}

/** Samples of the scan and where they lie on the mesh: every point of the scan has its place there. A foot is taken to
 *  move as the sample next to it does, whose row is there already. */
static exm_status from_scan(icp *fit, size_t count, double strength)
{
  const scan *target = fit->request->target;
  size_t const rank = fit->pulls.basis->rank;
  nearest_filter const filter = filter_for(fit, (const double(*)[3])fit->surface->normals);
  size_t const step = fit->scan_sample_count / (count ? count : 1);
  for (size_t i = 0; i < count; i++) {
    uint32_t const point = fit->scan_samples[i * step];
    memcpy(fit->queries[i], target->points[point], sizeof *fit->queries);
    memcpy(fit->directions[i], target->normals[point], sizeof *fit->directions);
  }
  TRY(shape_feet(fit->surface, (const double(*)[3])fit->queries, count, (const double(*)[3])fit->directions, &filter,
                 fit->reach, fit->request->settings.thread_count, fit->feet));
  for (size_t i = 0; i < count; i++) {
    const foot *at = &fit->feet[i];
    if (at->triangle == NEAREST_NONE || is_at_rim(fit, at)) {
      continue;
    }
    uint32_t const sample = fit->r->sample_of[at->vertex];
    const double *carrier = fit->surface->positions[fit->r->samples[sample]];
    double target_of_carrier[3];
    for (size_t k = 0; k < 3; k++) {
      target_of_carrier[k] = fit->queries[i][k] + carrier[k] - foot_coordinate(fit, at, k);
    }
    double const weight = strength / (double)count * trust(at->squared, fit->reach);
    memcpy(fit->pulls.rows + fit->pulls.count * rank, fit->r->sample_rows + sample * rank, rank * sizeof(double));
    add_pull(fit, target_of_carrier, fit->surface->normals[at->vertex], weight);
    fit->distances[fit->distance_count++] = at->squared;
  }
  return EXM_OK;
}

static void from_landmarks(icp *fit, double strength)
{
  size_t const rank = fit->pulls.basis->rank;
  for (size_t i = 0; i < fit->landmarks->count; i++) {
    memcpy(fit->pulls.rows + fit->pulls.count * rank, fit->landmark_basis + i * rank, rank * sizeof(double));
    add_pull(fit, fit->landmarks->targets[i], NULL, strength * fit->landmarks->weights[i]);
  }
}

exm_status icp_correspond(icp *fit, double strength, double landmark_strength, double samples_share)
{
  size_t const own = (size_t)ceil(samples_share * (double)fit->sample_count);
  size_t const theirs = (size_t)ceil(samples_share * (double)fit->scan_sample_count);
  fit->pulls.count = fit->distance_count = 0;
  from_mesh(fit, own, strength / 2);
  TRY(from_scan(fit, theirs, strength / 2 * fmin(fit->scan_area, 1)));
  from_landmarks(fit, landmark_strength);
  return EXM_OK;
}
