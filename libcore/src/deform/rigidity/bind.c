/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "base/clock.h"
#include "deform/rigidity/deformer.h"
#include "weights/handles.h"

static void *copy(arena *owner, const void *from, size_t count, size_t size)
{
  void *to = arena_array(owner, count, size);
  if (to) {
    memcpy(to, from, count * size);
  }
  return to;
}

/* A deformer outlives its mesh. */
static exm_status keep_mesh(arena *owner, const mesh *from, mesh *out)
{
  size_t const V = from->vertex_count, F = from->triangle_count;
  *out = (mesh){.vertex_count = V,
                .triangle_count = F,
                .positions = copy(owner, from->positions, V, sizeof *from->positions),
                .triangles = copy(owner, from->triangles, F, sizeof *from->triangles),
                .components = copy(owner, from->components, V, sizeof *from->components),
                .neighbor_offsets = copy(owner, from->neighbor_offsets, V + 1, sizeof *from->neighbor_offsets),
                .neighbors = copy(owner, from->neighbors, from->neighbor_offsets[V], sizeof *from->neighbors),
                .report = from->report};
  if (!out->positions || !out->triangles || !out->components || !out->neighbor_offsets || !out->neighbors) {
    return status_no_memory("the deformer");
  }
  return EXM_OK;
}

static exm_status reach_create(const rings *around, const int32_t *radii, int32_t radius, const progress *report,
                               rigidity_reach *out)
{
  size_t const V = around->vertex_count;
  *out = (rigidity_reach){0};
  out->radii = ARENA_NEW(&out->memory, int32_t, V);
  out->counts = ARENA_NEW(&out->memory, double, V);
  if (!out->radii || !out->counts) {
    return status_no_memory("the deformer");
  }
  for (size_t v = 0; v < V; v++) {
    out->radii[v] = radii ? radii[v] : radius;
  }
  return balls_create(&out->memory, around, out->radii, report, out->counts, &out->balls);
}

/* What a solver works on belongs to the deformer's parts. The states hold their disc rotations in the system. Coarser
 * levels follow at the next solve that asks for them. */
static void connect(rigidity_deformer *deformer)
{
  deformer->solver.now.disc_rotations = deformer->system.disc_rotations[0];
  deformer->solver.next.disc_rotations = deformer->system.disc_rotations[1];
  if (deformer->base.has_result) {
    rigidity_problem const problem = {.s = &deformer->edges,
                                      .components = deformer->reference.components,
                                      .balls = &deformer->reach.balls,
                                      .h = &deformer->handles,
                                      .system = &deformer->system};
    solver_fit(&deformer->solver, &problem, &deformer->solver.now);
  }
}

static exm_status bind(rigidity_deformer *deformer, const rigidity_request *request)
{
  double const start = clock_seconds();
  arena *owner = &deformer->base.memory;
  progress const neighborhoods = progress_part(&request->report, 0.05, 0.5);
  TRY(progress_report(&request->report, 0, "checking handles"));
  TRY(keep_mesh(owner, request->reference, &deformer->reference));
  deformer->disc_radius = request->disc_size * request->reference->report.diagonal;
  TRY(held_create(request->reference, request->handles, deformer->disc_radius, &deformer->handles));
  deformer->reference.cotangents = request->reference->cotangents;
  deformer->reference.degenerate_faces = request->reference->degenerate_faces;
  TRY(spokes_create(owner, &deformer->reference, &deformer->edges));
  deformer->reference.cotangents = NULL;
  deformer->reference.degenerate_faces = NULL;
  TRY(system_pattern(owner, &deformer->edges.around, &deformer->pattern));
  TRY(solver_create(owner, request->reference->vertex_count, &deformer->solver));
  TRY(reach_create(&deformer->edges.around, request->radii, request->radius, &neighborhoods, &deformer->reach));
  TRY(progress_report(&request->report, 0.5, "factoring"));
  TRY(system_create(&deformer->edges, &deformer->handles, &deformer->pattern, deformer->reach.counts, NULL,
                    &deformer->system));
  if (rigidity_deformer_is_large(deformer)) {
    TRY(progress_report(&request->report, 0.9, "coarsening"));
    TRY(rigidity_deformer_coarsen(deformer));
  }
  TRY(progress_report(&request->report, 1, "bound"));
  connect(deformer);
  deformer->base.info.bind_seconds = clock_seconds() - start;
  return EXM_OK;
}

exm_status rigidity_deformer_bind(const rigidity_request *request, exm_deformer **out)
{
  exm_deformer *deformer;
  TRY(handles_check(request->reference, request->handles));
  TRY(deformer_check_held(request->reference, request->handles));
  TRY(deformer_begin(sizeof(rigidity_deformer), &rigidity_methods, EXM_DEFORMER_RIGIDITY, request->reference,
                     request->handles, &deformer));
  deformer->info.exemplar_count = 1;
  deformer->info.coefficient_count = request->reference->vertex_count;
  exm_status const status = bind((rigidity_deformer *)deformer, request);
  if (status < 0) {
    deformer_destroy(deformer);
    return status;
  }
  *out = deformer;
  return EXM_OK;
}

static void forget_coarse(rigidity_deformer *deformer)
{
  coarse_destroy(deformer->coarse);
  deformer->coarse = NULL;
  deformer->has_coarse = deformer->is_coarse_there = 0;
}

exm_status rigidity_deformer_set_radii(rigidity_deformer *deformer, const int32_t *radii, int32_t radius,
                                       const progress *report)
{
  rigidity_reach reach = {0};
  rigidity_system system = {0};
  progress const neighborhoods = progress_part(report, 0, 0.5);
  exm_status status = reach_create(&deformer->edges.around, radii, radius, &neighborhoods, &reach);
  if (status == EXM_OK) {
    status = progress_report(report, 0.5, "factoring");
  }
  if (status == EXM_OK) {
    status = system_create(&deformer->edges, &deformer->handles, &deformer->pattern, reach.counts, &deformer->system,
                           &system);
  }
  if (status < 0) {
    system_destroy(&system);
    arena_release(&reach.memory);
    return status;
  }
  forget_coarse(deformer);
  system_destroy(&deformer->system);
  arena_release(&deformer->reach.memory);
  deformer->system = system;
  deformer->reach = reach;
  connect(deformer);
  return EXM_OK;
}

exm_status rigidity_deformer_set_handles(rigidity_deformer *deformer, const exm_handles *handles,
                                         const progress *report)
{
  held own = {0};
  rigidity_system system = {0};
  TRY(handles_check(&deformer->reference, handles));
  TRY(deformer_check_held(&deformer->reference, handles));
  TRY(progress_report(report, 0, "factoring"));
  exm_status status = held_create(&deformer->reference, handles, deformer->disc_radius, &own);
  if (status == EXM_OK) {
    status =
        system_create(&deformer->edges, &own, &deformer->pattern, deformer->reach.counts, &deformer->system, &system);
  }
  if (status < 0) {
    system_destroy(&system);
    held_destroy(&own);
    return status;
  }
  forget_coarse(deformer);
  system_destroy(&deformer->system);
  held_destroy(&deformer->handles);
  deformer->system = system;
  deformer->handles = own;
  deformer->base.handle_kinds = own.kinds;
  deformer->base.info.handle_count = own.handle_count;
  connect(deformer);
  return EXM_OK;
}
