/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/match.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "linalg/dense.h"
#include "linalg/rotation.h"
#include "registration/assignments.h"
#include "registration/landmarks.h"

/* So many assignments, the most plausible by distances, are solved: all of figure 3's 24. A solve takes milliseconds.
 */
enum { SOLVED_MOST = 120 };
/* Landmarks that a reflection maps onto each other this well, as a share of their spread squared, are mirror images. */
static double const MIRROR = 0.1;

static double between(const double a[3], const double b[3])
{
  double const x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

/** Least and greatest distances of the landmarks' vertices over the exemplars, in the caller's unit. */
static void find_ranges(const registration *r, const exm_landmarks *l, double *low, double *high)
{
  const dictionary *d = &r->deformer->atoms;
  size_t const n = l->count, width = d->exemplar_count * 3;
  for (size_t i = 0; i < n * n; i++) {
    const double *a = d->exemplars + l->vertices[i / n] * width, *b = d->exemplars + l->vertices[i % n] * width;
    low[i] = INFINITY;
    high[i] = 0;
    for (size_t e = 0; e < d->exemplar_count; e++) {
      double const distance = between(a + 3 * e, b + 3 * e) * r->deformer->coordinates.unit;
      low[i] = fmin(low[i], distance);
      high[i] = fmax(high[i], distance);
    }
  }
}

/** Distances of points in the exemplars' scale. An unknown one follows from all distances together, which no change of
 *  places alters. */
static void find_distances(const match_request *request, const double *low, const double *high, double *out)
{
  const exm_landmarks *l = &request->landmarks;
  size_t const n = l->count;
  double sum = 0, expected = 0;
  for (size_t i = 0; i < n * n; i++) {
    out[i] = between(l->points + 3 * (i / n), l->points + 3 * (i % n));
    sum += out[i] * out[i];
    expected += (low[i] + high[i]) * (low[i] + high[i]) / 4;
  }
  double const scale = request->settings.scale ? sqrt(sum / expected) : request->settings.known_scale;
  for (size_t i = 0; i < n * n; i++) {
    out[i] /= scale > 0 ? scale : 1;
  }
}

/** The energy [Blended, eq. 12] of every candidate, and the best two. */
static exm_status solve_all(registration *r, const match_request *request, const assignments *a, landmark_rows *rows,
                            double *energies)
{
  const exm_landmarks *l = &request->landmarks;
  exm_registration_fit_settings const settings = {.scale = request->settings.scale,
                                                  .known_scale = request->settings.known_scale};
  TRY(landmark_hold(r, rows));
  for (size_t c = 0; c < a->count; c++) {
    exm_blended_outcome outcome;
    for (size_t i = 0; i < l->count; i++) {
      memcpy(rows->targets[i], l->points + 3 * (size_t)a->orders[c * l->count + i], sizeof *rows->targets);
    }
    TRY(landmark_pose(r, rows, &settings, &outcome));
    energies[c] = outcome.final_energy;
    TRY(progress_report(&request->report, (double)(c + 1) / (double)a->count, "finding correspondences"));
  }
  return EXM_OK;
}

/** Does what distinguishes two assignments mirror the landmarks rather than turn them? */
static int is_mirrored(const registration *r, const exm_landmarks *l, const uint32_t *first, const uint32_t *second)
{
  double mean[3] = {0}, moment[9] = {0}, turn[9], spread = 0;
  size_t const n = l->count;
  for (size_t i = 0; i < n; i++) {
    dense_axpy(3, 1 / (double)n, r->reference->positions[l->vertices[i]], mean);
  }
  for (size_t i = 0; i < n; i++) {
    size_t to = 0;
    while (second[to] != first[i]) {
      to++;
    }
    const double *p = r->reference->positions[l->vertices[i]], *q = r->reference->positions[l->vertices[to]];
    for (size_t k = 0; k < 9; k++) {
      moment[k] += (q[k / 3] - mean[k / 3]) * (p[k % 3] - mean[k % 3]);
    }
    spread +=
        (p[0] - mean[0]) * (p[0] - mean[0]) + (p[1] - mean[1]) * (p[1] - mean[1]) + (p[2] - mean[2]) * (p[2] - mean[2]);
  }
  rotation_fit3(1, moment, turn);
  double const turned = 2 * (spread - dense_dot(9, turn, moment));
  for (size_t k = 0; k < 9; k++) {
    moment[k] = -moment[k]; /* a reflection is a turn of the negative */
  }
  rotation_fit3(1, moment, turn);
  double const reflected = 2 * (spread - dense_dot(9, turn, moment));
  return reflected < turned && reflected < MIRROR * spread;
}

static void conclude(const registration *r, const match_request *request, const assignments *a, const double *energies,
                     uint32_t *order, uint32_t *second_order, exm_registration_match_report *report)
{
  size_t const n = request->landmarks.count, size = n * sizeof *order;
  size_t best = 0, second = SIZE_MAX;
  for (size_t c = 1; c < a->count; c++) {
    if (energies[c] < energies[best]) {
      second = best;
      best = c;
    } else if (second == SIZE_MAX || energies[c] < energies[second]) {
      second = c;
    }
  }
  memcpy(order, a->orders + best * n, size);
  report->energy = energies[best];
  report->second = INFINITY;
  report->margin = 1;
  if (second != SIZE_MAX) {
    report->second = energies[second];
    report->margin = energies[second] > 0 ? (energies[second] - energies[best]) / energies[second] : 0;
    report->mirrored = is_mirrored(r, &request->landmarks, order, a->orders + second * n);
  }
  if (second_order) {
    memcpy(second_order, a->orders + (second == SIZE_MAX ? best : second) * n, size);
  }
  report->permissible = a->permissible < 1e18 ? (size_t)a->permissible : SIZE_MAX;
  report->solved = a->count;
}

exm_status registration_match(registration *r, const match_request *request, uint32_t *order, uint32_t *second,
                              exm_registration_match_report *report)
{
  double const start = clock_seconds();
  size_t const n = request->landmarks.count;
  arena scratch = {0};
  double *low = ARENA_NEW(&scratch, double, n *n), *high = ARENA_NEW(&scratch, double, n *n);
  double *distances = ARENA_NEW(&scratch, double, n *n);
  double *energies = ARENA_NEW(&scratch, double, SOLVED_MOST);
  landmark_rows rows = {0};
  assignments a = {
      .size = n, .low = low, .high = high, .between = distances, .groups = request->groups, .capacity = SOLVED_MOST};
  exm_status status = low && high && distances && energies ? EXM_OK : status_no_memory("the search");
  if (status == EXM_OK) {
    find_ranges(r, &request->landmarks, low, high);
    find_distances(request, low, high, distances);
    status = assignments_find(&scratch, &a);
  }
  if (status == EXM_OK) {
    status = landmark_points(&scratch, &request->landmarks, &rows);
  }
  if (status == EXM_OK) {
    status = solve_all(r, request, &a, &rows, energies);
  }
  if (status == EXM_OK) {
    conclude(r, request, &a, energies, order, second, report);
    report->seconds = clock_seconds() - start;
  }
  arena_release(&scratch);
  if (status == EXM_OK && report->margin < request->settings.margin) {
    return status_set(EXM_WARNING_AMBIGUOUS, "two assignments fit about as well: the energies are %g and %g%s",
                      report->energy, report->second, report->mirrored ? ", and one is the other's mirror image" : "");
  }
  return status;
}
