/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Shape spaces by themselves: round trips, what they do not see, and what lies between two shapes. */
#include "harness.h"
#include "zoo.h"

#include "linalg/rotation_log.h"
#include "mesh/edges.h"
#include "sequence/shape_space.h"

static const char *const NAMES[] = {"positions", "gradients", "linear rotation-invariant", "lengths and angles",
                                    "patches"};

typedef struct lab {
  zoo_mesh shape;
  exm_mesh *mesh;
  shape_space space;
  size_t size, dimension;
  float *a, *b;
  double *code_a, *code_b, *back;
} lab;

static void bend(const lab *l, double angle, double stretch, float *out)
{
  for (size_t v = 0; v < l->shape.vertex_count; v++) {
    const float *p = l->shape.positions[v];
    double const turn = angle * (double)p[0] / 4;
    out[3 * v] = (float)(stretch * (double)p[0] + 0.1 * sin((double)p[1]));
    out[3 * v + 1] = (float)(cos(turn) * (double)p[1] - sin(turn) * (double)p[2]);
    out[3 * v + 2] = (float)(sin(turn) * (double)p[1] + cos(turn) * (double)p[2]);
  }
}

static void turn_whole(const lab *l, const double vector[3], const double shift[3], const float *in, float *out)
{
  double R[9];
  rotation_exp(vector, R);
  for (size_t i = 0; i < l->size; i++) {
    const float *p = in + i / 3 * 3;
    const double *row = R + 3 * (i % 3);
    out[i] = (float)(row[0] * (double)p[0] + row[1] * (double)p[1] + row[2] * (double)p[2] + shift[i % 3]);
  }
}

static int lab_begin(lab *l, int32_t kind, zoo_mesh shape)
{
  *l = (lab){.shape = shape, .mesh = zoo_create(&shape)};
  exm_status const status = shape_space_create(kind, l->mesh, &l->space);
  CHECK(status >= 0);
  if (status < 0) {
    exm_mesh_destroy(l->mesh);
    return 0;
  }
  l->size = 3 * shape.vertex_count;
  l->dimension = l->space.dimension;
  l->a = test_array(l->size, sizeof(float));
  l->b = test_array(l->size, sizeof(float));
  l->code_a = test_array(l->dimension, sizeof(double));
  l->code_b = test_array(l->dimension, sizeof(double));
  l->back = test_array(l->size, sizeof(double));
  return 1;
}

static void lab_end(lab *l)
{
  shape_space_release(&l->space);
  exm_mesh_destroy(l->mesh);
  free(l->a);
  free(l->b);
  free(l->code_a);
  free(l->code_b);
  free(l->back);
}

static double distance(const lab *l, const float *expected)
{
  double most = 0;
  for (size_t i = 0; i < l->size; i++) {
    most = fmax(most, fabs(l->back[i] - (double)expected[i]));
  }
  return most;
}

static void check_round_trip(lab *l, const float *shape, double tolerance)
{
  CHECK(l->space.methods->encode(&l->space, shape, NULL, l->code_a) >= 0);
  CHECK(l->space.methods->decode(&l->space, l->code_a, l->back) >= 0);
  CHECK_NEAR(distance(l, shape), 0, tolerance);
}

TEST(round_trips)
{
  for (int32_t kind = 1; kind <= 4; kind++) {
    zoo_mesh meshes[4] = {zoo_bar(8, 2), zoo_sphere(3), zoo_torus(20, 12, 2, 0.7F), zoo_grid(9, 6, 2, 1)};
    for (size_t i = 0; i < 4; i++) {
      lab l;
      test_about("%s of a %s", NAMES[kind], meshes[i].name);
      if (lab_begin(&l, kind, meshes[i])) {
        for (size_t j = 0; j < l.size; j++) {
          l.a[j] = meshes[i].positions[j / 3][j % 3];
        }
        check_round_trip(&l, l.a, 1e-6);
        bend(&l, 2.2, 1.3, l.a);
        check_round_trip(&l, l.a, 1e-6);
        turn_whole(&l, (const double[]){2, 1, -1.5}, (const double[]){5, -3, 1}, l.a, l.b);
        check_round_trip(&l, l.b, 1e-6);
        lab_end(&l);
      }
      zoo_free(&meshes[i]);
    }
  }
}

TEST(dimensions_are_those_of_the_paper)
{
  zoo_mesh torus = zoo_torus(20, 12, 2, 0.7F);
  size_t const F = torus.triangle_count, E = 3 * F / 2;
  size_t const expected[] = {3 * torus.vertex_count, 9 * F + 3, 3 * E + 6, 2 * E + 6};
  for (int32_t kind = 0; kind < 4; kind++) {
    shape_space space;
    exm_mesh *made = zoo_create(&torus);
    CHECK(shape_space_create(kind, made, &space) >= 0);
    CHECK(space.dimension == expected[kind]);
    shape_space_release(&space);
    exm_mesh_destroy(made);
  }
  zoo_free(&torus);
}

/* Turned and moved as a whole, a shape differs in the last six numbers and no others; gradients differ in rotations
 * alone, and when only moved in the last three. */
TEST(rigid_motions_are_not_seen)
{
  for (int32_t kind = 1; kind <= 4; kind++) {
    lab l;
    test_about("%s", NAMES[kind]);
    if (!lab_begin(&l, kind, zoo_bar(8, 2))) {
      continue;
    }
    double const none[3] = {0}, shift[3] = {1, 2, 3}, turn[3] = {0.3, -0.8, 0.5};
    bend(&l, 1.4, 1.1, l.a);
    turn_whole(&l, kind == 1 ? none : turn, shift, l.a, l.b);
    CHECK(l.space.methods->encode(&l.space, l.a, NULL, l.code_a) >= 0);
    CHECK(l.space.methods->encode(&l.space, l.b, NULL, l.code_b) >= 0);
    size_t const seen = kind == 1 ? 3 : 6;
    double most = 0, last = 0;
    for (size_t i = 0; i < l.dimension; i++) {
      double const difference = fabs(l.code_a[i] - l.code_b[i]);
      most = i + seen < l.dimension ? fmax(most, difference) : most;
      last = i + seen < l.dimension ? last : fmax(last, difference);
    }
    CHECK_NEAR(most, 0, 1e-4);
    CHECK(last > 1);
    zoo_free(&l.shape);
    lab_end(&l);
  }
}

/* Half-way between a bar and the bar turned by half a turn: turned by a quarter, and not crushed as vertices are. To
 * gradients a shape's own turns and that of the whole are one, and average exactly where there are none of the former.
 */
TEST(half_a_turn_is_halved)
{
  for (int32_t kind = 1; kind <= 4; kind++) {
    lab l;
    test_about("%s", NAMES[kind]);
    if (!lab_begin(&l, kind, zoo_bar(8, 2))) {
      continue;
    }
    double const none[3] = {0}, half[3] = {0, 0, M_PI - 1e-3}, quarter[3] = {0, 0, (M_PI - 1e-3) / 2};
    for (size_t i = 0; i < l.size; i++) {
      l.a[i] = l.shape.positions[i / 3][i % 3];
    }
    if (kind != EXM_SHAPE_GRADIENTS) {
      bend(&l, 0.4, 1, l.a);
    }
    turn_whole(&l, half, none, l.a, l.b);
    CHECK(l.space.methods->encode(&l.space, l.a, NULL, l.code_a) >= 0);
    CHECK(l.space.methods->encode(&l.space, l.b, l.code_a, l.code_b) >= 0);
    for (size_t i = 0; i < l.dimension; i++) {
      l.code_a[i] = (l.code_a[i] + l.code_b[i]) / 2;
    }
    CHECK(l.space.methods->decode(&l.space, l.code_a, l.back) >= 0);
    turn_whole(&l, quarter, none, l.a, l.b);
    size_t const last = l.size - 3;
    double along = 0, square = 0;
    for (size_t i = 0; i < l.size; i++) { /* the same shape: distances to one vertex */
      double const here = l.back[i] - l.back[last + i % 3], there = (double)l.b[i] - (double)l.b[last + i % 3];
      along += here * there;
      square += there * there;
    }
    for (size_t v = 0; v + 1 < l.shape.vertex_count; v++) {
      double now = 0, then = 0;
      for (size_t k = 0; k < 3; k++) {
        now += pow(l.back[3 * v + k] - l.back[last + k], 2);
        then += pow((double)l.b[3 * v + k] - (double)l.b[last + k], 2);
      }
      CHECK_NEAR(sqrt(now), sqrt(then), 1e-4);
    }
    CHECK(along > (kind == EXM_SHAPE_GRADIENTS ? 0.999999 : 0.95) * square); /* turned by a quarter, about */
    zoo_free(&l.shape);
    lab_end(&l);
  }
}

/* A bar twisted by one and a half turns from end to end, half-way to none: by three quarters of a turn. A triangle's
 * own logarithm is not unique any more at a full turn, so that gradients get three quarters. */
TEST(twists_are_followed_from_triangle_to_triangle)
{
  for (int32_t kind = 1; kind <= 4; kind++) {
    lab l;
    test_about("%s", NAMES[kind]);
    if (!lab_begin(&l, kind, zoo_bar(24, 2))) {
      continue;
    }
    double const whole = (kind == EXM_SHAPE_GRADIENTS ? 1.5 : 3) * M_PI / 24 * 4;
    bend(&l, 0, 1, l.a);
    bend(&l, whole, 1, l.b);
    CHECK(l.space.methods->encode(&l.space, l.a, NULL, l.code_a) >= 0);
    CHECK(l.space.methods->encode(&l.space, l.b, NULL, l.code_b) >= 0);
    for (size_t i = 0; i < l.dimension; i++) {
      l.code_a[i] = (l.code_a[i] + l.code_b[i]) / 2;
    }
    CHECK(l.space.methods->decode(&l.space, l.code_a, l.back) >= 0);
    /* The cross sections keep their size: no crushing, whichever way the whole is turned. */
    for (size_t v = 0; v < l.shape.vertex_count; v++) {
      for (size_t w = 0; w < v; w++) {
        const float *p = l.shape.positions[v], *q = l.shape.positions[w];
        if (p[0] == q[0] && fabs((double)(p[1] - q[1])) == 2 && fabs((double)(p[2] - q[2])) == 2) {
          double const across = hypot(hypot(l.back[3 * v] - l.back[3 * w], l.back[3 * v + 1] - l.back[3 * w + 1]),
                                      l.back[3 * v + 2] - l.back[3 * w + 2]);
          CHECK(across > 0.8 * sqrt(8) && across < 1.2 * sqrt(8));
        }
      }
    }
    zoo_free(&l.shape);
    lab_end(&l);
  }
}

/* A mesh that spins: logarithms go on rising, for all triangles. One that has no other turn spins for ever. */
static void spin(int is_deformed, int frames)
{
  lab l;
  double unit = 1;
  if (!lab_begin(&l, EXM_SHAPE_GRADIENTS, zoo_sphere(2))) {
    return;
  }
  double const none[3] = {0};
  double *codes[2] = {l.code_a, l.code_b};
  for (size_t i = 0; i < l.size; i++) {
    l.a[i] = l.shape.positions[i / 3][i % 3];
  }
  if (is_deformed) {
    bend(&l, 0.3, 1, l.a);
  }
  for (int i = 0; i < frames; i++) {
    double const turn[3] = {0.9 * i, 0, 0};
    turn_whole(&l, turn, none, l.a, l.b);
    CHECK(l.space.methods->encode(&l.space, l.b, i ? codes[(i + 1) % 2] : NULL, codes[i % 2]) >= 0);
    double squared = 0; /* scaled so that all triangles together have the turn times the root of inertia */
    for (size_t f = 0; f < l.shape.triangle_count; f++) {
      squared += codes[i % 2][9 * f] * codes[i % 2][9 * f];
    }
    unit = i == 1 ? sqrt(squared) / 0.9 : unit;
    CHECK(i < 2 || fabs(sqrt(squared) / unit - 0.9 * i) < 0.2);
  }
  zoo_free(&l.shape);
  lab_end(&l);
}

TEST(logarithms_follow_the_frames)
{
  spin(0, 20);
  spin(1, 7);
}

TEST(parts_and_loose_vertices_keep_their_places)
{
  float positions[9][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {5, 0, 0},
                           {6, 0, 0}, {5, 1, 0}, {5, 0, 1}, {9, 9, 9}};
  uint32_t const triangles[8][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3},
                                    {4, 6, 5}, {4, 5, 7}, {4, 7, 6}, {5, 6, 7}};
  for (int32_t kind = 1; kind <= 4; kind++) {
    exm_mesh *made = NULL;
    shape_space space;
    test_about("%s", NAMES[kind]);
    CHECK(exm_mesh_create(&positions[0][0], 9, &triangles[0][0], 8, &made) >= 0);
    CHECK(shape_space_create(kind, made, &space) >= 0);
    double *code = test_array(space.dimension, sizeof(double)), back[27];
    float moved[27];
    for (size_t i = 0; i < 27; i++) {
      moved[i] = positions[i / 3][i % 3] * (i < 12 ? 2 : 1) + (i >= 24 ? 4 : 0);
    }
    CHECK(space.methods->encode(&space, moved, NULL, code) >= 0);
    CHECK(space.methods->decode(&space, code, back) >= 0);
    for (size_t i = 0; i < 27; i++) {
      CHECK_NEAR(back[i], (double)moved[i], 1e-5);
    }
    free(code);
    shape_space_release(&space);
    exm_mesh_destroy(made);
  }
}

TEST(rings_must_be_rings_for_forms)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  size_t refused = 0;
  for (size_t i = 0; i < count; i++) {
    exm_mesh *made = NULL;
    shape_space space;
    if (exm_mesh_create(&all[i].positions[0][0], all[i].vertex_count, &all[i].triangles[0][0], all[i].triangle_count,
                        &made) < 0) {
      continue;
    }
    test_about("%s", all[i].name);
    for (int32_t kind = 1; kind <= 4; kind++) { /* whatever the mesh, a space or an error; never a crash */
      exm_status const status = shape_space_create(kind, made, &space);
      if (status < 0) {
        CHECK_STATUS(status, EXM_ERROR_TOPOLOGY, "vertex", "ring");
        CHECK(kind == EXM_SHAPE_LINEAR_ROTATION_INVARIANT);
        refused++;
      } else {
        shape_space_release(&space);
      }
    }
    exm_mesh_destroy(made);
  }
  CHECK(refused > 0);
}

TEST(logarithms_and_exponentials)
{
  test_random random = {5};
  for (int i = 0; i < 2000; i++) {
    double R[9], back[9], v[3], like[3], found[3];
    for (int k = 0; k < 3; k++) {
      v[k] = (i % 4 ? 3 : 40) * (test_uniform(&random) - 0.5) * (i % 7 ? 1 : 1e-9);
      like[k] = v[k] + 0.2 * (test_uniform(&random) - 0.5) * fabs(v[k]);
    }
    rotation_exp(v, R);
    rotation_log(R, like, found);
    rotation_exp(found, back);
    for (int k = 0; k < 9; k++) {
      CHECK_NEAR(back[k], R[k], 1e-13);
    }
    double const turns = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / (2 * M_PI);
    for (int k = 0; k < 3 && turns < 0.9; k++) {
      CHECK_NEAR(found[k], v[k], 1e-7);
    }
  }
}

TEST(edges_know_their_triangles)
{
  zoo_mesh torus = zoo_torus(8, 6, 2, 0.7F);
  exm_mesh *made = zoo_create(&torus);
  arena memory = {0};
  mesh_edges edges;
  face_order order;
  CHECK(mesh_edges_find(&memory, made, &edges) >= 0);
  CHECK(face_order_find(&memory, made, &edges, &order) >= 0);
  CHECK(edges.count == 3 * torus.triangle_count / 2 && order.part_count == 1);
  for (size_t f = 0; f < torus.triangle_count; f++) {
    for (size_t i = 0; i < 3; i++) {
      const mesh_edge *edge = &edges.edges[edges.of_face[f][i]];
      uint32_t const a = torus.triangles[f][(i + 1) % 3], b = torus.triangles[f][(i + 2) % 3];
      CHECK(edge->ends[0] == (a < b ? a : b) && edge->ends[1] == (a < b ? b : a));
      CHECK(edge->faces[0] == f || edge->faces[1] == f);
    }
    CHECK((order.parents[f] == NO_FACE) == (f == 0));
  }
  arena_release(&memory);
  exm_mesh_destroy(made);
  zoo_free(&torus);
}
