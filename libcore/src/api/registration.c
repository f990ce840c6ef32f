/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/registration.h"

#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"
#include "registration/landmarks.h"
#include "registration/match.h"

/* A landmark farther from the scan than this share of the scan's diagonal belongs to something else. */
static double const OUTSIDE = 0.25;

void exm_registration_fit_settings_init(exm_registration_fit_settings *settings)
{
  if (settings) {
    *settings = (exm_registration_fit_settings){.struct_size = sizeof *settings,
                                                .scale = 1,
                                                .known_scale = 1,
                                                .start = EXM_START_STATELESS,
                                                .disc_radius = 0.15,
                                                .disc_count = 10,
                                                .iterations = 20,
                                                .sample_count = 1000,
                                                .reach = 0.15,
                                                .max_angle = 60,
                                                .tightness = 1,
                                                .landmark_share = 0.1,
                                                .finish = 1,
                                                .detail = 1,
                                                .reject_landmarks = 1};
  }
}

void exm_registration_fit_report_init(exm_registration_fit_report *report)
{
  if (report) {
    *report = (exm_registration_fit_report){.struct_size = sizeof *report};
  }
}

void exm_registration_match_settings_init(exm_registration_match_settings *settings)
{
  if (settings) {
    *settings =
        (exm_registration_match_settings){.struct_size = sizeof *settings, .scale = 1, .known_scale = 1, .margin = 0.2};
  }
}

void exm_registration_match_report_init(exm_registration_match_report *report)
{
  if (report) {
    *report = (exm_registration_match_report){.struct_size = sizeof *report};
  }
}

void exm_registration_info_init(exm_registration_info *info)
{
  if (info) {
    *info = (exm_registration_info){.struct_size = sizeof *info};
  }
}

exm_status exm_registration_create(const exm_mesh *reference, const float *exemplars, size_t exemplar_count,
                                   const exm_blended_bind_settings *settings, exm_progress callback, void *user,
                                   exm_registration **out)
{
  TRY(check_pointer(out, "out"));
  *out = NULL;
  TRY(check_pointer(reference, "mesh"));
  TRY(check_pointer(exemplars, "exemplars"));
  registration_request request = {.reference = reference,
                                  .exemplars = exemplars,
                                  .exemplar_count = exemplar_count,
                                  .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  exm_blended_bind_settings_init(&request.settings);
  TRY(settings_read(&request.settings, sizeof request.settings, settings, "settings"));
  TRY(check_exemplars(exemplars, exemplar_count, reference->vertex_count));
  request.settings.dimension = 3;
  TRY(check_blended_settings(&request.settings, reference->vertex_count, exemplar_count));
  return registration_create(&request, out);
}

void exm_registration_destroy(exm_registration *r)
{
  registration_destroy(r);
}

/* -------------------------------------------------------------------------------------------------------- arguments */

static exm_status check_landmark(const registration *r, const exm_landmarks *l, size_t i)
{
  if (l->weights && !(l->weights[i] >= 0 && isfinite(l->weights[i]))) {
    return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_LANDMARK, i, "landmarks: the weight of landmark %zu is %g", i,
                         l->weights[i]);
  }
  if (l->vertices[i] >= r->reference->vertex_count) {
    return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_LANDMARK, i,
                         "landmarks: landmark %zu is vertex %u, but the mesh has %zu", i, l->vertices[i],
                         r->reference->vertex_count);
  }
  for (size_t k = 0; k < 3 && !(l->weights && l->weights[i] == 0); k++) {
    if (!isfinite(l->points[3 * i + k])) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_LANDMARK, i,
                           "landmarks: the %c coordinate of landmark %zu is not finite", "xyz"[k], i);
    }
  }
  return EXM_OK;
}

static exm_status check_landmarks(const registration *r, const exm_landmarks *l)
{
  if (l->count == 0) {
    return EXM_OK;
  }
  TRY(check_pointer(l->vertices, "landmarks->vertices"));
  TRY(check_pointer(l->points, "landmarks->points"));
  if (l->count > r->reference->vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "landmarks->count is %zu, more than the %zu vertices", l->count,
                      r->reference->vertex_count);
  }
  for (size_t i = 0; i < l->count; i++) {
    TRY(check_landmark(r, l, i));
    for (size_t j = 0; j < i; j++) {
      if (l->vertices[i] == l->vertices[j]) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_LANDMARK, i,
                             "landmarks: landmarks %zu and %zu are the same vertex %u", j, i, l->vertices[i]);
      }
    }
  }
  return EXM_OK;
}

static exm_status check_on_scan(const scan *s, const exm_landmarks *l)
{
  for (size_t i = 0; i < l->count; i++) {
    uint32_t index;
    double squared = 0;
    if (!(l->weights && l->weights[i] == 0)) {
      nearest_find(&s->tree, (const double(*)[3])(l->points + 3 * i), 1, NULL, NULL, INFINITY, 1, &index, &squared);
    }
    if (sqrt(squared) > OUTSIDE * s->report.diagonal) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_LANDMARK, i,
                           "landmarks: landmark %zu is %g away from the scan, %.0f %% of the scan's diagonal", i,
                           sqrt(squared), 100 * sqrt(squared) / s->report.diagonal);
    }
  }
  return EXM_OK;
}

static exm_status check_number(const char *name, double value, double low, double high)
{
  if (!(value >= low && value <= high)) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.%s is %g, not %g to %g", name, value, low, high);
  }
  return EXM_OK;
}

static exm_status check_fit_settings(const exm_registration_fit_settings *s)
{
  if (s->scale != 0 && s->scale != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.scale is %d, not 0 or 1", s->scale);
  }
  if (s->finish != 0 && s->finish != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.finish is %d, not 0 or 1", s->finish);
  }
  if (s->reject_landmarks != 0 && s->reject_landmarks != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.reject_landmarks is %d, not 0 or 1", s->reject_landmarks);
  }
  if (s->start != EXM_START_STATELESS && s->start != EXM_START_WARM) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.start is %d, not EXM_START_STATELESS or EXM_START_WARM", s->start);
  }
  if (s->iterations < 0 || s->iterations > 10000) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.iterations is %d, not 0 to 10000", s->iterations);
  }
  if (s->disc_count < 1 || s->disc_count > 1000) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.disc_count is %zu, not 1 to 1000", s->disc_count);
  }
  if (s->sample_count < 10 || s->sample_count > 1000000) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.sample_count is %zu, not 10 to 1000000", s->sample_count);
  }
  TRY(check_number("known_scale", s->known_scale, 1e-12, 1e12));
  TRY(check_number("disc_radius", s->disc_radius, 0, 10));
  TRY(check_number("reach", s->reach, 1e-6, 100));
  TRY(check_number("max_angle", s->max_angle, 1, 180));
  TRY(check_number("tightness", s->tightness, 1e-6, 1e6));
  TRY(check_number("landmark_share", s->landmark_share, 0, 1e6));
  return check_number("detail", s->detail, 1e-6, 1e6);
}

exm_status exm_registration_fit(exm_registration *r, const exm_scan *target, const exm_landmarks *landmarks,
                                const exm_registration_fit_settings *settings, exm_progress callback, void *user,
                                exm_registration_fit_report *report)
{
  TRY(check_pointer(r, "registration"));
  TRY(check_pointer(target, "scan"));
  fit_request request = {.target = target, .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  exm_registration_fit_settings_init(&request.settings);
  TRY(settings_read(&request.settings, sizeof request.settings, settings, "settings"));
  TRY(check_fit_settings(&request.settings));
  TRY(report_check(report, "report"));
  if (landmarks) {
    request.landmarks = *landmarks;
  }
  TRY(check_landmarks(r, &request.landmarks));
  TRY(check_on_scan(target, &request.landmarks));
  if (request.settings.start != EXM_START_WARM || !r->last.positions) {
    TRY(landmark_check_spread(&request.landmarks, 3));
  }
  exm_registration_fit_report found = {.struct_size = sizeof found};
  exm_status const status = registration_fit(r, &request, &found);
  TRY(status);
  TRY(report_write(report, &found, sizeof found, "report"));
  return status;
}

static exm_status check_match_settings(const exm_registration_match_settings *s)
{
  if (s->scale != 0 && s->scale != 1) {
    return status_set(EXM_ERROR_ARGUMENT, "settings.scale is %d, not 0 or 1", s->scale);
  }
  TRY(check_number("known_scale", s->known_scale, 1e-12, 1e12));
  return check_number("margin", s->margin, 0, 1);
}

exm_status exm_registration_match(exm_registration *r, const exm_landmarks *landmarks, const int32_t *groups,
                                  const exm_registration_match_settings *settings, exm_progress callback, void *user,
                                  uint32_t *order, uint32_t *second, exm_registration_match_report *report)
{
  TRY(check_pointer(r, "registration"));
  TRY(check_pointer(landmarks, "landmarks"));
  TRY(check_pointer(groups, "groups"));
  TRY(check_pointer(order, "order"));
  match_request request = {
      .landmarks = *landmarks, .groups = groups, .report = {.callback = callback, .user = user, .begin = 0, .end = 1}};
  exm_registration_match_settings_init(&request.settings);
  TRY(settings_read(&request.settings, sizeof request.settings, settings, "settings"));
  TRY(check_match_settings(&request.settings));
  TRY(report_check(report, "report"));
  TRY(check_landmarks(r, landmarks));
  for (size_t i = 0; landmarks->weights && i < landmarks->count; i++) {
    if (!(landmarks->weights[i] > 0)) {
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_LANDMARK, i,
                           "landmarks: the weight of landmark %zu is 0: all count in a search", i);
    }
  }
  TRY(landmark_check_spread(landmarks, 4));
  exm_registration_match_report found = {.struct_size = sizeof found};
  exm_status const status = registration_match(r, &request, order, second, &found);
  TRY(status);
  TRY(report_write(report, &found, sizeof found, "report"));
  return status;
}

/* ----------------------------------------------------------------------------------------------------------- results
 */

static exm_status check_fitted(const exm_registration *r)
{
  TRY(check_pointer(r, "registration"));
  return r->last.positions ? EXM_OK : status_set(EXM_ERROR_ARGUMENT, "registration has not fitted anything yet");
}

exm_status exm_registration_positions(const exm_registration *r, float *positions)
{
  TRY(check_pointer(r, "registration"));
  TRY(check_pointer(positions, "positions"));
  const float *from = r->shown ? r->shown : r->last.positions;
  for (size_t i = 0; i < 3 * r->reference->vertex_count; i++) {
    positions[i] = from ? from[i] : (float)r->reference->positions[i / 3][i % 3];
  }
  return EXM_OK;
}

/** `to` may be NULL: not asked for. */
static void hand_out(void *to, const void *from, size_t count, size_t size)
{
  if (to) {
    memcpy(to, from, count * size);
  }
}

exm_status exm_registration_vertex_matches(const exm_registration *r, uint32_t *points, float *distances)
{
  TRY(check_fitted(r));
  hand_out(points, r->last.vertex_points, r->reference->vertex_count, sizeof *points);
  hand_out(distances, r->last.vertex_distances, r->reference->vertex_count, sizeof *distances);
  return EXM_OK;
}

exm_status exm_registration_scan_matches(const exm_registration *r, uint32_t *vertices, uint32_t *triangles,
                                         float *barycentric, float *distances)
{
  TRY(check_fitted(r));
  hand_out(vertices, r->last.scan_vertices, r->last.point_count, sizeof *vertices);
  hand_out(triangles, r->last.scan_triangles, r->last.point_count, sizeof *triangles);
  hand_out(barycentric, r->last.scan_barycentric, 3 * r->last.point_count, sizeof *barycentric);
  hand_out(distances, r->last.scan_distances, r->last.point_count, sizeof *distances);
  return EXM_OK;
}

exm_status exm_registration_landmark_residuals(const exm_registration *r, double *residuals)
{
  TRY(check_fitted(r));
  TRY(check_pointer(residuals, "residuals"));
  hand_out(residuals, r->last.landmark_residuals, r->last.landmark_count, sizeof *residuals);
  return EXM_OK;
}

exm_status exm_registration_get_info(const exm_registration *r, exm_registration_info *info)
{
  TRY(check_pointer(r, "registration"));
  TRY(check_pointer(info, "info"));
  exm_registration_info found = r->info;
  found.point_count = r->last.point_count;
  found.landmark_count = r->last.landmark_count;
  return report_write(info, &found, sizeof found, "info");
}
