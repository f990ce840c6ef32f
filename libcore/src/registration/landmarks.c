/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/landmarks.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* A landmark's point farther from the scan than so many spacings is not on it, and has no disc there. */
static double const ON_SCAN = 3;
/* Points whose second spread is below this share of the first lie on a line. */
static double const LINE = 1e-3;

static double weight_of(const exm_landmarks *l, size_t i)
{
  return l->weights ? l->weights[i] : 1;
}

exm_status landmark_check_spread(const exm_landmarks *landmarks, size_t least)
{
  double mean[3] = {0}, moments[9] = {0}, values[3];
  size_t count = 0;
  for (size_t i = 0; i < landmarks->count; i++) {
    if (weight_of(landmarks, i) > 0) {
      dense_axpy(3, 1, landmarks->points + 3 * i, mean);
      count++;
    }
  }
  if (count < least) {
    return status_set(EXM_ERROR_UNCONSTRAINED, "%zu landmarks count, but at least %zu are needed", count, least);
  }
  for (size_t i = 0; i < landmarks->count; i++) {
    if (weight_of(landmarks, i) > 0) {
      double offset[3];
      for (size_t k = 0; k < 3; k++) {
        offset[k] = landmarks->points[3 * i + k] - mean[k] / (double)count;
      }
      for (size_t k = 0; k < 3; k++) {
        dense_axpy(3, offset[k], offset, moments + 3 * k);
      }
    }
  }
  TRY(dense_eigen(3, moments, values));
  if (!(values[1] > LINE * LINE * values[2])) {
    return status_set(EXM_ERROR_UNCONSTRAINED, "the points of all %zu landmarks lie %s: the turn about it is open",
                      count, values[2] > 0 ? "on one line" : "at one place");
  }
  return EXM_OK;
}

/* ------------------------------------------------------------------------------------------------------------ points
 */

static exm_status allocate_rows(arena *owner, size_t count, size_t term_count, landmark_rows *rows)
{
  rows->offsets = ARENA_NEW(owner, size_t, count + 1);
  rows->vertices = ARENA_NEW(owner, uint32_t, term_count);
  rows->coefficients = ARENA_NEW(owner, double, term_count);
  rows->weights = ARENA_NEW(owner, double, count);
  rows->targets = arena_array(owner, count, sizeof *rows->targets);
  return rows->offsets && rows->vertices && rows->coefficients && rows->weights && rows->targets
             ? EXM_OK
             : status_no_memory("the landmarks");
}

static void add_point(const exm_landmarks *l, size_t i, landmark_rows *rows)
{
  size_t const at = rows->offsets[rows->count];
  rows->vertices[at] = l->vertices[i];
  rows->coefficients[at] = 1;
  rows->weights[rows->count] = weight_of(l, i);
  memcpy(rows->targets[rows->count], l->points + 3 * i, sizeof *rows->targets);
  rows->offsets[++rows->count] = at + 1;
}

exm_status landmark_points(arena *owner, const exm_landmarks *landmarks, landmark_rows *out)
{
  landmark_rows rows = {0};
  TRY(allocate_rows(owner, landmarks->count, landmarks->count, &rows));
  for (size_t i = 0; i < landmarks->count; i++) {
    if (weight_of(landmarks, i) > 0) {
      add_point(landmarks, i, &rows);
    }
  }
  *out = rows;
  return EXM_OK;
}

/* ------------------------------------------------------------------------------------------------------------- discs
 */

/** How far the scan is whole about a point: the distance of its nearest boundary, or `radius`. The disc is left in
 *  scan->ways. */
static double whole_radius(const scan *s, uint32_t point, double radius)
{
  geodesics *ways = s->ways;
  double whole = radius * (1 + 1e-9);
  geodesics_disc(ways, point, radius);
  for (size_t i = 0; i < ways->count; i++) {
    uint32_t const v = ways->vertices[i];
    whole = s->boundary[v] ? fmin(whole, ways->distances[v]) : whole;
  }
  return whole;
}

/** Mean of the last disc's points within `radius`, by area. */
static void mean_of_disc(const geodesics *ways, const double *areas, double radius, double mean[3])
{
  double total = 0;
  memset(mean, 0, 3 * sizeof *mean);
  for (size_t i = 0; i < ways->count; i++) {
    uint32_t const v = ways->vertices[i];
    if (ways->distances[v] <= radius) {
      dense_axpy(3, areas[v], ways->positions[v], mean);
      total += areas[v];
    }
  }
  for (size_t k = 0; k < 3; k++) {
    mean[k] /= total;
  }
}

static void add_disc(const registration *r, double radius, double weight, landmark_rows *rows)
{
  const geodesics *ways = &r->ways;
  size_t const first = rows->offsets[rows->count];
  size_t next = first;
  double total = 0;
  for (size_t i = 0; i < ways->count; i++) {
    uint32_t const v = ways->vertices[i];
    if (ways->distances[v] <= radius) {
      rows->vertices[next] = v;
      rows->coefficients[next++] = r->areas[v];
      total += r->areas[v];
    }
  }
  for (size_t t = first; t < next; t++) {
    rows->coefficients[t] /= total;
  }
  rows->weights[rows->count] = weight;
  rows->offsets[++rows->count] = next;
}

/** How many discs a landmark has: those that are whole on the scan. Both discs of the largest are left in place. */
static size_t usable_discs(registration *r, const fit_request *request, size_t i, uint32_t point, double squared,
                           double scale)
{
  const scan *s = request->target;
  const exm_registration_fit_settings *settings = &request->settings;
  double const step = settings->disc_radius * r->size / (double)settings->disc_count;
  if (!(step > 0) || point == NEAREST_NONE || sqrt(squared) > ON_SCAN * s->report.spacing) {
    return 0;
  }
  double const whole = whole_radius(s, point, settings->disc_radius * r->size * scale);
  size_t count = 0;
  while (count < settings->disc_count && (double)(count + 1) * step * scale <= whole) {
    count++;
  }
  geodesics_disc(&r->ways, request->landmarks.vertices[i], (double)count * step * (1 + 1e-9));
  return count;
}

exm_status landmark_discs(arena *owner, const registration *r, const fit_request *request, const exm_landmarks *l,
                          double scale, landmark_rows *out)
{
  const exm_registration_fit_settings *settings = &request->settings;
  registration *own = (registration *)r; /* for the scratch of its discs */
  landmark_rows rows = {0};
  arena scratch = {0};
  uint32_t *points = ARENA_NEW(&scratch, uint32_t, l->count);
  double *squared = ARENA_NEW(&scratch, double, l->count);
  size_t *counts = ARENA_NEW(&scratch, size_t, l->count);
  exm_status status = points && squared && counts ? EXM_OK : status_no_memory("the landmarks");
  size_t row_count = 0, term_count = 0;
  if (status == EXM_OK) {
    nearest_find(&request->target->tree, (const double(*)[3])l->points, l->count, NULL, NULL, INFINITY, 1, points,
                 squared);
    for (size_t i = 0; i < l->count; i++) {
      counts[i] = weight_of(l, i) > 0 ? usable_discs(own, request, i, points[i], squared[i], scale) : 0;
      row_count += counts[i] + 1;
      term_count += counts[i] * own->ways.count + 1;
    }
    status = allocate_rows(owner, row_count, term_count, &rows);
  }
  double const step = settings->disc_radius * r->size / (double)settings->disc_count;
  for (size_t i = 0; i < l->count && status == EXM_OK; i++) {
    if (weight_of(l, i) > 0 && counts[i] == 0) {
      add_point(l, i, &rows);
    } else if (counts[i] > 0) {
      usable_discs(own, request, i, points[i], squared[i], scale);
      for (size_t k = 1; k <= counts[i]; k++) {
        double const radius = (double)k * step * (1 + 1e-9);
        mean_of_disc(request->target->ways, request->target->areas, radius * scale, rows.targets[rows.count]);
        add_disc(own, radius, weight_of(l, i) / (double)counts[i], &rows);
      }
    }
  }
  arena_release(&scratch);
  *out = rows;
  return status;
}

/* -------------------------------------------------------------------------------------------------------------- pose
 */

exm_status landmark_hold(registration *r, const landmark_rows *rows)
{
  blended_constraints *held = &r->deformer->solver.held;
  size_t const before = held->row_count - held->handle_row_count;
  if (before > 0) {
    TRY(blended_constraints_remove(&r->deformer->solver, 0, before));
  }
  exm_rows const own = {.count = rows->count,
                        .offsets = rows->offsets,
                        .vertices = rows->vertices,
                        .coefficients = rows->coefficients,
                        .weights = rows->weights};
  return rows->count > 0 ? blended_deformer_add_rows(r->deformer, &own) : EXM_OK;
}

/** A known scale is taken off the targets about the space's origin, and put on the frame when the pose is found. */
static void scale_targets(const registration *r, const landmark_rows *rows, double factor, double (*out)[3])
{
  const double *origin = r->deformer->coordinates.origin;
  for (size_t i = 0; i < rows->count; i++) {
    for (size_t k = 0; k < 3; k++) {
      out[i][k] = origin[k] + (rows->targets[i][k] - origin[k]) * factor;
    }
  }
}

exm_status landmark_pose(registration *r, const landmark_rows *rows, const exm_registration_fit_settings *settings,
                         exm_blended_outcome *outcome)
{
  double const known = settings->scale ? 1 : settings->known_scale;
  blended_options const options = {.sparsity = 0.01,
                                   .scale = settings->scale ? EXM_SCALE_BALANCED : EXM_SCALE_HELD,
                                   .average_iterations = 8,
                                   .minimal_iterations = 8,
                                   .final_iterations = 12};
  exm_solve_report report = {.struct_size = sizeof report};
  arena scratch = {0};
  double(*targets)[3] = arena_array(&scratch, rows->count, sizeof *targets);
  exm_status status = targets ? EXM_OK : status_no_memory("the landmarks");
  if (status == EXM_OK) {
    scale_targets(r, rows, 1 / known, targets);
    status = blended_deformer_solve(r->deformer, r->handle_targets, (const double *)targets, &options, &report);
  }
  arena_release(&scratch);
  TRY(status);
  blended_frame *frame = &r->deformer->solver.frame;
  frame->scale *= known;
  for (size_t k = 0; k < 3; k++) {
    frame->shift[k] *= known;
  }
  *outcome = r->deformer->outcome;
  outcome->scale *= known;
  return EXM_OK;
}
