/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/shape.h"

#include <math.h>
#include <string.h>

#include "linalg/dense.h"
#include "mesh/normals.h"
#include "mesh/triangle.h"

exm_status shape_create(arena *owner, const registration *r, shape *out)
{
  size_t const V = r->reference->vertex_count;
  *out = (shape){.r = r,
                 .shown = ARENA_NEW(owner, float, 3 * V),
                 .positions = arena_array(owner, V, sizeof *out->positions),
                 .normals = arena_array(owner, V, sizeof *out->normals)};
  return out->shown && out->positions && out->normals ? EXM_OK : status_no_memory("the shape");
}

void shape_release(shape *s)
{
  arena_release(&s->memory);
}

exm_status shape_refresh(shape *s)
{
  const mesh *m = s->r->reference;
  arena memory = {0};
  nearest tree = {0};
  exm_status const status = nearest_create(&memory, (const double(*)[3])s->positions, m->vertex_count, &tree);
  if (status < 0) {
    arena_release(&memory);
    return status;
  }
  arena_release(&s->memory);
  s->memory = memory;
  s->tree = tree;
  mesh_vertex_normals((const double(*)[3])s->positions, m->vertex_count, (const uint32_t(*)[3])m->triangles,
                      m->triangle_count, s->normals);
  for (size_t i = 0; i < 3 * m->vertex_count; i++) {
    s->shown[i] = (float)s->positions[i / 3][i % 3];
  }
  return EXM_OK;
}

exm_status shape_pose(shape *s, const registered_pose *pose)
{
  const registration *r = s->r;
  const blended_basis *basis = registration_basis(r);
  blended *b = &r->deformer->solver;
  b->frame = pose->frame;
  memset(b->coefficients, 0, b->joint_count * 3 * sizeof(double));
  for (size_t i = 0; i < basis->atom_count; i++) {
    dense_times(1, basis->rank, 3, basis->basis + i * basis->rank, pose->u, b->coefficients + basis->atoms[i] * 3);
  }
  blended_deformer_place(r->deformer, 0);
  blended_methods.positions(&r->deformer->base, 0, s->shown);
  for (size_t i = 0; i < 3 * r->reference->vertex_count; i++) {
    s->positions[i / 3][i % 3] = (double)s->shown[i];
    if (!isfinite(s->shown[i])) {
      return status_set(EXM_ERROR_NUMERIC, "the fit broke down: vertex %zu is nowhere", i / 3);
    }
  }
  return shape_refresh(s);
}

/** The nearest place on the triangles around a vertex. */
static void refine(const shape *s, const double point[3], foot *out)
{
  const mesh *m = s->r->reference;
  const geodesics *ways = &s->r->ways;
  const double(*p)[3] = (const double(*)[3])s->positions;
  for (uint32_t i = ways->offsets[out->vertex]; i < ways->offsets[out->vertex + 1]; i++) {
    const uint32_t *t = m->triangles[ways->faces[i]];
    double weights[3];
    double const squared = triangle_nearest(p[t[0]], p[t[1]], p[t[2]], point, weights);
    if (out->triangle == NEAREST_NONE || squared < out->squared) {
      out->triangle = ways->faces[i];
      out->squared = squared;
      memcpy(out->barycentric, weights, sizeof weights);
    }
  }
}

exm_status shape_feet(const shape *s, const double (*points)[3], size_t count, const double (*directions)[3],
                      const nearest_filter *filter, double reach, int thread_count, foot *out)
{
  arena scratch = {0};
  uint32_t *vertices = ARENA_NEW(&scratch, uint32_t, count);
  double *squared = ARENA_NEW(&scratch, double, count);
  if (!vertices || !squared) {
    arena_release(&scratch);
    return status_no_memory("correspondences");
  }
  nearest_find(&s->tree, points, count, directions, filter, reach, thread_count, vertices, squared);
  for (size_t i = 0; i < count; i++) {
    out[i] = (foot){.vertex = vertices[i], .triangle = NEAREST_NONE, .squared = squared[i]};
    if (vertices[i] != NEAREST_NONE) {
      refine(s, points[i], &out[i]);
    }
  }
  arena_release(&scratch);
  return EXM_OK;
}

/** out = turn' from */
static void turn_back(const blended_frame *frame, const double from[3], double out[3])
{
  for (size_t j = 0; j < 3; j++) {
    out[j] = frame->turn[j] * from[0] + frame->turn[3 + j] * from[1] + frame->turn[6 + j] * from[2];
  }
}

void frame_from_point(const space *s, const blended_frame *frame, const double point[3], double out[3])
{
  double own[3];
  space_from_point(s, point, own);
  dense_axpy(3, -1, frame->shift, own);
  turn_back(frame, own, out);
  for (size_t k = 0; k < 3; k++) {
    out[k] /= frame->scale;
  }
}

void frame_from_direction(const space *s, const blended_frame *frame, const double direction[3], double out[3])
{
  double own[3];
  for (size_t i = 0; i < 3; i++) {
    own[i] = dense_dot(3, s->axes[i], direction);
  }
  turn_back(frame, own, out);
}
