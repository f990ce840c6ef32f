/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "linalg/dense.h"
#include "mesh/areas.h"
#include "mesh/normals.h"
#include "mesh/rim.h"
#include "registration/registration.h"

/* As many samples as any fit will ask for. */
enum { SAMPLES_MOST = 4096 };
static double const AFTER_BIND = 0.9;

static exm_status copy_mesh(const mesh *from, mesh **out)
{
  arena scratch = {0};
  float(*positions)[3] = arena_array(&scratch, from->vertex_count, sizeof *positions);
  if (!positions) {
    return status_no_memory("the mesh");
  }
  for (size_t i = 0; i < 3 * from->vertex_count; i++) {
    positions[i / 3][i % 3] = (float)from->positions[i / 3][i % 3];
  }
  exm_status const status = mesh_create((const float(*)[3])positions, from->vertex_count,
                                        (const uint32_t(*)[3])from->triangles, from->triangle_count, out);
  arena_release(&scratch);
  return status < 0 ? status : EXM_OK;
}

/** The deformer wants handles when it is bound, but landmarks come later: one vertex of each connected part stands
 *  in, at weight 0. */
static exm_status bind_deformer(registration *r, const registration_request *request)
{
  const mesh *m = r->reference;
  size_t const parts = m->report.component_count;
  arena scratch = {0};
  int32_t *kinds = ARENA_NEW(&scratch, int32_t, parts);
  size_t *offsets = ARENA_NEW(&scratch, size_t, parts + 1);
  uint32_t *vertices = ARENA_NEW(&scratch, uint32_t, parts);
  double *weights = ARENA_NEW(&scratch, double, parts);
  exm_deformer *deformer = NULL;
  r->handle_targets = ARENA_NEW(&r->memory, double, 12 * parts);
  exm_status status =
      kinds && offsets && vertices && weights && r->handle_targets ? EXM_OK : status_no_memory("the registration");
  if (status == EXM_OK) {
    for (size_t v = m->vertex_count; v-- > 0;) {
      vertices[m->components[v]] = (uint32_t)v;
    }
    for (size_t p = 0; p < parts; p++) {
      offsets[p + 1] = p + 1;
    }
    exm_handles const handles = {.count = parts, .kinds = kinds, .vertex_offsets = offsets, .vertices = vertices};
    blended_request const bind = {.reference = m,
                                  .exemplars = request->exemplars,
                                  .exemplar_count = request->exemplar_count,
                                  .handles = &handles,
                                  .settings = request->settings,
                                  .report = progress_part(&request->report, 0, AFTER_BIND)};
    status = blended_deformer_bind(&bind, &deformer);
  }
  r->deformer = (blended_deformer *)deformer;
  exm_status const warning = status;
  if (status >= 0) {
    status = blended_deformer_weigh_handles(r->deformer, weights);
  }
  arena_release(&scratch);
  /* A turn that handles leave open is no matter here: they hold nothing. */
  return status < 0 || warning == EXM_WARNING_UNDERDETERMINED ? status : warning;
}

/** Farthest point sampling: each next sample is as far as can be from those before it. */
static exm_status choose_samples(registration *r)
{
  const mesh *m = r->reference;
  size_t const V = m->vertex_count;
  arena scratch = {0};
  double *far = ARENA_NEW(&scratch, double, V);
  r->sample_count = V < SAMPLES_MOST ? V : SAMPLES_MOST;
  r->samples = ARENA_NEW(&r->memory, uint32_t, r->sample_count);
  if (!far || !r->samples) {
    arena_release(&scratch);
    return status_no_memory("the registration");
  }
  for (size_t v = 0; v < V; v++) {
    far[v] = INFINITY;
  }
  size_t next = 0;
  for (size_t i = 0; i < r->sample_count; i++) {
    const double *at = m->positions[next];
    r->samples[i] = (uint32_t)next;
    far[next] = -1;
    size_t farthest = next;
    for (size_t v = 0; v < V; v++) {
      double const x = m->positions[v][0] - at[0], y = m->positions[v][1] - at[1], z = m->positions[v][2] - at[2];
      far[v] = fmin(far[v], x * x + y * y + z * z);
      farthest = far[v] > far[farthest] ? v : farthest;
    }
    next = farthest;
  }
  arena_release(&scratch);
  return EXM_OK;
}

/** The sample next to each vertex: limbs are thin, and ears thinner, so it has to face the same way. */
static exm_status find_nearest_samples(registration *r)
{
  const mesh *m = r->reference;
  size_t const V = m->vertex_count;
  arena scratch = {0};
  nearest tree;
  double(*points)[3] = arena_array(&scratch, r->sample_count, sizeof *points);
  double(*own)[3] = arena_array(&scratch, r->sample_count, sizeof *own);
  double(*normals)[3] = arena_array(&scratch, V, sizeof *normals);
  r->sample_of = ARENA_NEW(&r->memory, uint32_t, V);
  exm_status status = points && own && normals && r->sample_of ? EXM_OK : status_no_memory("the registration");
  if (status == EXM_OK) {
    mesh_vertex_normals((const double(*)[3])m->positions, V, (const uint32_t(*)[3])m->triangles, m->triangle_count,
                        normals);
    for (size_t i = 0; i < r->sample_count; i++) {
      memcpy(points[i], m->positions[r->samples[i]], sizeof *points);
      memcpy(own[i], normals[r->samples[i]], sizeof *own);
    }
    status = nearest_create(&scratch, (const double(*)[3])points, r->sample_count, &tree);
  }
  if (status == EXM_OK) {
    nearest_filter const facing = {.normals = (const double(*)[3])own, .least_cosine = 0.3};
    nearest_find(&tree, (const double(*)[3])m->positions, V, (const double(*)[3])normals, &facing, INFINITY, 0,
                 r->sample_of, NULL);
  }
  for (size_t v = 0; v < V && status == EXM_OK; v++) {
    if (r->sample_of[v] == NEAREST_NONE) {
      nearest_find(&tree, (const double(*)[3])(m->positions + v), 1, NULL, NULL, INFINITY, 1, &r->sample_of[v], NULL);
    }
  }
  arena_release(&scratch);
  return status;
}

static exm_status prepare(registration *r)
{
  const mesh *m = r->reference;
  r->areas = ARENA_NEW(&r->memory, double, m->vertex_count);
  r->is_rim = ARENA_NEW(&r->memory, uint8_t, m->vertex_count);
  exm_status status = r->areas && r->is_rim ? EXM_OK : status_no_memory("the registration");
  if (status == EXM_OK) {
    status = geodesics_create(&r->memory, (const double(*)[3])m->positions, m->vertex_count,
                              (const uint32_t(*)[3])m->triangles, m->triangle_count, &r->ways);
  }
  if (status == EXM_OK) {
    status = mesh_rim(&r->ways, r->is_rim);
  }
  if (status == EXM_OK) {
    status = choose_samples(r);
  }
  if (status == EXM_OK) {
    status = find_nearest_samples(r);
  }
  if (status == EXM_OK) {
    mesh_voronoi_areas(m, r->areas);
    for (size_t v = 0; v < m->vertex_count; v++) {
      r->size += r->areas[v];
    }
    r->size = sqrt(r->size);
    r->sample_rows = ARENA_NEW(&r->memory, double, r->sample_count *registration_basis(r)->rank);
    status = r->sample_rows ? registration_rows(r, r->sample_count, 1, r->samples, NULL, r->sample_rows)
                            : status_no_memory("the registration");
  }
  return status;
}

exm_status registration_create(const registration_request *request, registration **out)
{
  double const start = clock_seconds();
  registration *r = calloc(1, sizeof *r);
  if (!r) {
    return status_no_memory("the registration");
  }
  exm_status warning = EXM_OK;
  exm_status status = copy_mesh(request->reference, &r->reference);
  if (status == EXM_OK) {
    warning = status = bind_deformer(r, request);
  }
  if (status >= 0) {
    status = prepare(r);
  }
  if (status >= 0) {
    status = progress_report(&request->report, 1, "binding");
  }
  if (status < 0) {
    registration_destroy(r);
    return status;
  }
  r->info = (exm_registration_info){.struct_size = sizeof r->info,
                                    .vertex_count = r->reference->vertex_count,
                                    .exemplar_count = request->exemplar_count,
                                    .atom_count = r->deformer->info.atom_count,
                                    .size = r->size,
                                    .create_seconds = clock_seconds() - start};
  *out = r;
  return warning;
}

void registration_destroy(registration *r)
{
  if (r) {
    deformer_destroy((exm_deformer *)r->deformer);
    mesh_destroy(r->reference);
    arena_release(&r->last.memory);
    arena_release(&r->memory);
    free(r);
  }
}
