/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/result.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"

/* Points within this share of the mesh's size of the fitted surface are explained by it. */
static double const EXPLAINED = 0.02;
/* Below this quality the scan may show something else. */
static double const DOUBTFUL = 0.5;
/* And above this energy: poses that were left out of the exemplars are reached at 0.005 to 0.02, other beasts, a torus
 * and swapped landmarks at 0.07 and more, however well they are explained then. */
static double const FAR_FETCHED = 0.05;

static nearest_filter agreeing(const fit_request *request, const double (*normals)[3])
{
  return (nearest_filter){.normals = normals,
                          .least_cosine = cos(request->settings.max_angle * M_PI / 180),
                          .is_unsigned = !request->target->report.signed_normals};
}

/** Feet of all of the scan's points, with normals that agree. */
static exm_status all_feet(const shape *surface, const fit_request *request, double reach, foot *feet)
{
  const scan *target = request->target;
  nearest_filter const filter = agreeing(request, (const double(*)[3])surface->normals);
  return shape_feet(surface, (const double(*)[3])target->points, target->point_count,
                    (const double(*)[3])target->normals, &filter, reach, request->settings.thread_count, feet);
}

exm_status result_judge(const shape *surface, const fit_request *request, exm_registration_fit_report *report)
{
  const scan *target = request->target;
  double const tolerance = EXPLAINED * surface->r->size * report->scale;
  arena scratch = {0};
  foot *feet = ARENA_NEW(&scratch, foot, target->point_count);
  exm_status status = feet ? EXM_OK : status_no_memory("the result");
  double explained = 0, area = 0;
  if (status == EXM_OK) {
    /* A vertex may be farther off than the surface. */
    status = all_feet(surface, request, 4 * tolerance, feet);
  }
  for (size_t i = 0; i < target->point_count && status == EXM_OK; i++) {
    area += target->areas[i];
    explained += feet[i].squared <= tolerance * tolerance ? target->areas[i] : 0;
  }
  report->quality = area > 0 ? explained / area : 0;
  arena_release(&scratch);
  return status;
}

static exm_status allocate(registered_fit *fit, size_t V, size_t P, size_t landmark_count)
{
  arena *owner = &fit->memory;
  fit->point_count = P;
  fit->landmark_count = landmark_count;
  fit->positions = ARENA_NEW(owner, float, 3 * V);
  fit->vertex_points = ARENA_NEW(owner, uint32_t, V);
  fit->vertex_distances = ARENA_NEW(owner, float, V);
  fit->scan_vertices = ARENA_NEW(owner, uint32_t, P);
  fit->scan_triangles = ARENA_NEW(owner, uint32_t, P);
  fit->scan_barycentric = ARENA_NEW(owner, float, 3 * P);
  fit->scan_distances = ARENA_NEW(owner, float, P);
  fit->landmark_residuals = ARENA_NEW(owner, double, landmark_count);
  return fit->positions && fit->vertex_points && fit->vertex_distances && fit->scan_vertices && fit->scan_triangles &&
                 fit->scan_barycentric && fit->scan_distances && fit->landmark_residuals
             ? EXM_OK
             : status_no_memory("the result");
}

/** Each point of the scan: its foot where normals agree, or the bare distance. */
static exm_status fill_scan(const shape *surface, const fit_request *request, double reach,
                            exm_registration_fit_report *report, registered_fit *fit)
{
  const scan *target = request->target;
  size_t const P = target->point_count;
  arena scratch = {0};
  foot *feet = ARENA_NEW(&scratch, foot, P), *nearest_feet = ARENA_NEW(&scratch, foot, P);
  exm_status status = feet && nearest_feet ? EXM_OK : status_no_memory("the result");
  if (status == EXM_OK) {
    status = all_feet(surface, request, reach, feet);
  }
  if (status == EXM_OK) {
    status = shape_feet(surface, (const double(*)[3])target->points, P, NULL, NULL, INFINITY,
                        request->settings.thread_count, nearest_feet);
  }
  double sum = 0, count = 0;
  for (size_t i = 0; i < P && status == EXM_OK; i++) {
    int const is_seen = feet[i].triangle != NEAREST_NONE && feet[i].squared <= reach * reach;
    fit->scan_triangles[i] = is_seen ? feet[i].triangle : EXM_UNSEEN;
    fit->scan_vertices[i] = is_seen ? feet[i].vertex : EXM_UNSEEN;
    for (size_t k = 0; k < 3; k++) {
      fit->scan_barycentric[3 * i + k] = is_seen ? (float)feet[i].barycentric[k] : 0;
    }
    fit->scan_distances[i] = (float)sqrt(is_seen ? feet[i].squared : nearest_feet[i].squared);
    sum += is_seen ? feet[i].squared : 0;
    count += is_seen;
  }
  report->residual = count > 0 ? sqrt(sum / count) : 0;
  arena_release(&scratch);
  return status;
}

/** Each vertex: the scan's point next to it, but for those beyond the scan's rim. */
static exm_status fill_vertices(const shape *surface, const fit_request *request, double reach,
                                exm_registration_fit_report *report, registered_fit *fit)
{
  const scan *target = request->target;
  const registration *r = surface->r;
  size_t const V = r->reference->vertex_count;
  nearest_filter const filter = agreeing(request, (const double(*)[3])target->normals);
  arena scratch = {0};
  double *squared = ARENA_NEW(&scratch, double, V);
  double seen = 0, area = 0;
  if (!squared) {
    return status_no_memory("the result");
  }
  nearest_find(&target->tree, (const double(*)[3])surface->positions, V, (const double(*)[3])surface->normals, &filter,
               reach, request->settings.thread_count, fit->vertex_points, squared);
  for (size_t v = 0; v < V; v++) {
    uint32_t const point = fit->vertex_points[v];
    int const is_seen = point != NEAREST_NONE &&
                        (!target->boundary[point] || squared[v] <= target->report.spacing * target->report.spacing);
    fit->vertex_points[v] = is_seen ? point : EXM_UNSEEN;
    fit->vertex_distances[v] = is_seen ? (float)sqrt(squared[v]) : NAN;
    area += r->areas[v];
    seen += is_seen ? r->areas[v] : 0;
  }
  report->seen = area > 0 ? seen / area : 0;
  arena_release(&scratch);
  return EXM_OK;
}

static void fill_landmarks(const shape *surface, const fit_request *request, exm_registration_fit_report *report,
                           registered_fit *fit)
{
  const exm_landmarks *l = &request->landmarks;
  double sum = 0, count = 0;
  for (size_t i = 0; i < l->count; i++) {
    double squared = 0;
    fit->landmark_residuals[i] = NAN;
    if (l->weights && !(l->weights[i] > 0)) {
      continue;
    }
    for (size_t k = 0; k < 3; k++) {
      double const offset = surface->positions[l->vertices[i]][k] - l->points[3 * i + k];
      squared += offset * offset;
    }
    fit->landmark_residuals[i] = sqrt(squared);
    if (sqrt(squared) >= report->worst_residual) {
      report->worst_residual = sqrt(squared);
      report->worst_landmark = i;
    }
    sum += squared;
    count++;
  }
  report->landmark_residual = count > 0 ? sqrt(sum / count) : 0;
}

exm_status result_fill(const shape *surface, const fit_request *request, exm_registration_fit_report *report,
                       registered_fit *fit)
{
  double const reach = fmax(EXPLAINED * surface->r->size * report->scale, 2 * request->target->report.spacing);
  TRY(allocate(fit, surface->r->reference->vertex_count, request->target->point_count, request->landmarks.count));
  memcpy(fit->positions, surface->shown, 3 * surface->r->reference->vertex_count * sizeof(float));
  TRY(fill_scan(surface, request, reach, report, fit));
  TRY(fill_vertices(surface, request, reach, report, fit));
  fill_landmarks(surface, request, report, fit);
  return EXM_OK;
}

exm_status result_warn(const exm_registration_fit_report *report)
{
  if (report->rejected_count > 0) {
    return status_set_at(
        EXM_WARNING_FIT, EXM_ELEMENT_LANDMARK, report->worst_landmark,
        "landmark %zu contradicts all others and was left out, of %zu in all: it is %g from where they "
        "put it",
        report->worst_landmark, report->rejected_count, report->worst_residual);
  }
  if (report->energy > FAR_FETCHED) {
    return status_set(
        EXM_WARNING_FIT,
        "the mesh had to be bent far from every exemplar, to an energy of %.2g: the scan may show something "
        "else, or landmarks may be wrong",
        report->energy);
  }
  if (report->quality < DOUBTFUL) {
    return status_set(EXM_WARNING_FIT,
                      "only %.0f %% of the scan lies on the fitted shape: it may show something else, or landmarks may "
                      "be wrong",
                      100 * report->quality);
  }
  return EXM_OK;
}
