/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Bounded biharmonic weights: their laws on every mesh of the zoo, a slow second route to them on a small one, and what
 * is refused. tests/python/test_weights_optimality.py asks a general solver. */
#include "allocation.h"
#include "harness.h"
#include "linalg/sparse.h"
#include "mesh/mesh.h"
#include "weights/handles.h"
#include "zoo.h"

enum { MOST = 64 };

/* Handles of one vertex each unless more are added by hand. */
typedef struct handle_list {
  size_t count;
  int32_t kinds[MOST];
  size_t offsets[MOST + 1];
  uint32_t vertices[MOST];
} handle_list;

static void add(handle_list *list, size_t vertex)
{
  list->vertices[list->offsets[list->count]] = (uint32_t)vertex;
  list->offsets[list->count + 1] = list->offsets[list->count] + 1;
  list->count++;
}

static exm_handles view(const handle_list *list)
{
  return (exm_handles){list->count, list->kinds, list->offsets, list->vertices};
}

static float *weights_of(const exm_mesh *m, const handle_list *list)
{
  exm_handles const handles = view(list);
  float *weights = test_array(list->count * m->vertex_count, sizeof *weights);
  exm_status const status = exm_weights_bounded_biharmonic(m, &handles, NULL, NULL, weights);
  if (status != EXM_OK) {
    test_fail(__FILE__, __LINE__, "status %d: %s", (int)status, exm_last_error());
    memset(weights, 0, list->count * m->vertex_count * sizeof *weights);
  }
  return weights;
}

/* The lowest vertex of every part, and `more` others where the generator points. */
static handle_list spread(const exm_mesh *m, size_t more, uint64_t seed)
{
  handle_list list = {0};
  test_random random = {seed};
  uint32_t next = 0;
  for (size_t v = 0; v < m->vertex_count; ++v) {
    if (m->components[v] == next) {
      add(&list, v);
      ++next;
    }
  }
  for (size_t tries = 0; more > 0 && tries < 100; ++tries) {
    uint32_t const v = (uint32_t)(test_uniform(&random) * (double)m->vertex_count);
    size_t h = 0;
    while (h < list.count && list.vertices[h] != v) {
      ++h;
    }
    if (h == list.count) {
      add(&list, v);
      --more;
    }
  }
  return list;
}

static void check_constraints(const exm_mesh *m, const handle_list *list, const float *weights)
{
  size_t const V = m->vertex_count;
  for (size_t v = 0; v < V; ++v) {
    double sum = 0;
    for (size_t h = 0; h < list->count; ++h) {
      double const w = (double)weights[h * V + v];
      CHECK(w >= 0 && w <= 1);
      sum += w;
    }
    CHECK_NEAR(sum, 1, 1e-6);
  }
  for (size_t h = 0; h < list->count; ++h) {
    for (size_t i = list->offsets[h]; i < list->offsets[h + 1]; ++i) {
      for (size_t other = 0; other < list->count; ++other) {
        CHECK(weights[other * V + list->vertices[i]] == (float)(other == h));
      }
    }
  }
}

TEST(constraints_hold_on_the_zoo)
{
  size_t count;
  const zoo_mesh *animals = zoo(&count);
  for (size_t a = 0; a < count; ++a) {
    exm_mesh *m = zoo_create(&animals[a]);
    REQUIRE(m != NULL);
    for (size_t more = 0; more <= 6; more += 3) {
      test_about("%s, %zu handles more than parts", animals[a].name, more);
      handle_list const list = spread(m, more, a);
      float *weights = weights_of(m, &list);
      check_constraints(m, &list, weights);
      /* A handle has no say in parts that it has no vertex in. */
      for (size_t h = 0; h < list.count; ++h) {
        for (size_t v = 0; v < m->vertex_count; ++v) {
          bool const is_near = m->components[v] == m->components[list.vertices[list.offsets[h]]];
          CHECK(is_near || weights[h * m->vertex_count + v] == 0);
        }
      }
      exm_handles const handles = view(&list);
      CHECK(handles_check_weights(m, &handles, weights) == EXM_OK);
      free(weights);
    }
    exm_mesh_destroy(m);
  }
}

TEST(one_handle_has_everything)
{
  exm_mesh *m = zoo_create(zoo_find("torus"));
  REQUIRE(m != NULL);
  handle_list list = {0};
  add(&list, 5);
  float *weights = weights_of(m, &list);
  for (size_t v = 0; v < m->vertex_count; ++v) {
    CHECK(weights[v] == 1);
  }
  free(weights);
  exm_mesh_destroy(m);
}

TEST(nothing_but_handles)
{
  zoo_mesh grid = zoo_grid(1, 1, 1, 1);
  exm_mesh *m = zoo_create(&grid);
  REQUIRE(m != NULL);
  handle_list list = {0};
  for (size_t v = 0; v < 4; ++v) {
    add(&list, v);
  }
  float *weights = weights_of(m, &list);
  check_constraints(m, &list, weights);
  free(weights);
  exm_mesh_destroy(m);
  zoo_free(&grid);
}

/* ------------------------------------------------------------------------------------------------------- optimality */

/* sum_h 1/2 w_h' L M^-1 L w_h for [H][V]. */
static double energy_of(const mesh *m, size_t H, const double *weights)
{
  arena memory = {0};
  sparse lower, whole;
  size_t const V = m->vertex_count;
  double *y = ARENA_NEW(&memory, double, H *V), total = 0;
  if (!y ||
      sparse_laplacian(&memory, V, m->triangle_count, (const uint32_t(*)[3])m->triangles,
                       (const double(*)[3])m->cotangents, &lower) < 0 ||
      sparse_whole(&memory, &lower, &whole) < 0) {
    test_fail(__FILE__, __LINE__, "no Laplacian");
    return NAN;
  }
  sparse_multiply(&whole, H, weights, y);
  for (size_t i = 0; i < H * V; ++i) {
    total += 0.5 * y[i] * y[i] / m->masses[i % V];
  }
  arena_release(&memory);
  return total;
}

/* Dense A = A^-1 by Gauss and Jordan, for matrices that need no pivoting. */
static void invert(size_t n, double *a)
{
  for (size_t k = 0; k < n; ++k) {
    double const pivot = 1 / a[k * n + k];
    a[k * n + k] = 1;
    for (size_t j = 0; j < n; ++j) {
      a[k * n + j] *= pivot;
    }
    for (size_t i = 0; i < n; ++i) {
      double const factor = a[i * n + k];
      if (i != k) {
        a[i * n + k] = 0;
        for (size_t j = 0; j < n; ++j) {
          a[i * n + j] -= factor * a[k * n + j];
        }
      }
    }
  }
}

/* The projection by bisection of the threshold; ours leaves out entries. */
static void project(size_t count, const double *v, size_t stride, double *z)
{
  double low = -10, high = 10;
  for (int i = 0; i < 60; ++i) {
    double const middle = 0.5 * (low + high);
    double sum = 0;
    for (size_t h = 0; h < count; ++h) {
      sum += fmax(0, v[h * stride] - middle);
    }
    if (sum > 1) {
      low = middle;
    } else {
      high = middle;
    }
  }
  for (size_t h = 0; h < count; ++h) {
    z[h * stride] = fmax(0, v[h * stride] - low);
  }
}

/* The same problem by the plainest means: dense, one penalty, thousands of steps, handles as a penalty of their own.
 * Q [V][V] is the energy's matrix. Weights [H][V]. */
static void slow_weights(const mesh *m, const handle_list *list, double *weights)
{
  size_t const V = m->vertex_count, H = list->count;
  arena memory = {0};
  sparse lower, whole, square;
  double *inverse_masses = ARENA_NEW(&memory, double, V), *a = ARENA_NEW(&memory, double, V *V);
  double *u = ARENA_NEW(&memory, double, H *V), *x = ARENA_NEW(&memory, double, H *V);
  for (size_t v = 0; v < V; ++v) {
    inverse_masses[v] = 1 / m->masses[v];
  }
  REQUIRE(sparse_laplacian(&memory, V, m->triangle_count, (const uint32_t(*)[3])m->triangles,
                           (const double(*)[3])m->cotangents, &lower) == EXM_OK);
  REQUIRE(sparse_whole(&memory, &lower, &whole) == EXM_OK);
  REQUIRE(sparse_square(&memory, &whole, inverse_masses, &square) == EXM_OK);
  double trace = 0;
  for (size_t j = 0; j < V; ++j) {
    for (int32_t e = square.starts[j]; e < square.starts[j + 1]; ++e) {
      a[(size_t)square.rows[e] * V + j] = a[j * V + (size_t)square.rows[e]] = square.values[e];
    }
    trace += a[j * V + j];
  }
  double const rho = 0.002 * trace / (double)V, held = 1e6 * trace / (double)V;
  for (size_t j = 0; j < V; ++j) {
    a[j * V + j] += rho;
  }
  for (size_t h = 0; h < H; ++h) {
    for (size_t i = list->offsets[h]; i < list->offsets[h + 1]; ++i) {
      a[list->vertices[i] * V + list->vertices[i]] += held;
    }
  }
  invert(V, a);
  for (size_t i = 0; i < H * V; ++i) {
    weights[i] = 1 / (double)H;
  }
  for (int step = 0; step < 4000; ++step) {
    for (size_t h = 0; h < H; ++h) {
      double *right = u + h * V; /* holds the multipliers on entry */
      for (size_t v = 0; v < V; ++v) {
        x[h * V + v] = rho * (weights[h * V + v] - right[v]);
      }
      for (size_t i = list->offsets[h]; i < list->offsets[h + 1]; ++i) {
        x[h * V + list->vertices[i]] += held;
      }
      double *solved = weights + h * V;
      for (size_t v = 0; v < V; ++v) {
        solved[v] = 0;
        for (size_t j = 0; j < V; ++j) {
          solved[v] += a[v * V + j] * x[h * V + j];
        }
        right[v] += solved[v];
      }
    }
    for (size_t v = 0; v < V; ++v) {
      project(H, u + v, V, weights + v);
    }
    for (size_t i = 0; i < H * V; ++i) {
      u[i] -= weights[i];
    }
  }
  arena_release(&memory);
}

TEST(as_good_as_the_slow_way)
{
  zoo_mesh grid = zoo_grid(10, 8, 10, 8);
  exm_mesh *m = zoo_create(&grid);
  REQUIRE(m != NULL);
  handle_list list = {0};
  size_t const vertices[] = {0, 10, 40, 60, 93};
  for (size_t h = 0; h < 5; ++h) {
    add(&list, vertices[h]);
  }
  size_t const entries = list.count * m->vertex_count;
  float *weights = weights_of(m, &list);
  double *slow = test_array(entries, sizeof *slow), *fast = test_array(entries, sizeof *fast);
  slow_weights(m, &list, slow);
  for (size_t i = 0; i < entries; ++i) {
    fast[i] = (double)weights[i];
    CHECK_NEAR(fast[i], slow[i], 0.02); /* energies are flat: half a percent leaves this much room */
  }
  double const best = energy_of(m, list.count, slow), found = energy_of(m, list.count, fast);
  CHECK(found < 1.005 * best && found > 0.995 * best);
  free(weights);
  free(slow);
  free(fast);
  exm_mesh_destroy(m);
  zoo_free(&grid);
}

TEST(mirror_images_have_mirrored_weights)
{
  enum { LENGTH = 24, SIDE = 4 };
  zoo_mesh bar = zoo_bar(LENGTH, SIDE);
  exm_mesh *m = zoo_create(&bar);
  REQUIRE(m != NULL);
  handle_list list = {0}; /* both ends */
  for (int end = 0; end < 2; ++end) {
    for (size_t v = 0; v < m->vertex_count; ++v) {
      if (fabs(m->positions[v][0] - end * LENGTH) < 1e-6 && fabs(m->positions[v][1]) < 1e-6) {
        list.vertices[list.offsets[list.count + 1]++] = (uint32_t)v;
      }
    }
    list.count++;
    list.offsets[list.count + 1] = list.offsets[list.count];
  }
  float *weights = weights_of(m, &list);
  check_constraints(m, &list, weights);
  double worst = 0;
  for (size_t v = 0; v < m->vertex_count; ++v) {
    for (size_t u = 0; u < m->vertex_count; ++u) {
      if (fabs(m->positions[u][0] + m->positions[v][0] - LENGTH) < 1e-6 &&
          fabs(m->positions[u][1] - m->positions[v][1]) < 1e-6 &&
          fabs(m->positions[u][2] - m->positions[v][2]) < 1e-6) {
        worst = fmax(worst, fabs((double)(weights[v] - weights[m->vertex_count + u])));
      }
    }
  }
  CHECK(worst < 0.01); /* the triangles' diagonals are not mirrored */
  free(weights);
  exm_mesh_destroy(m);
  zoo_free(&bar);
}

TEST(scale_and_order_do_not_matter)
{
  zoo_mesh sphere = zoo_sphere(3);
  exm_mesh *m = zoo_create(&sphere);
  REQUIRE(m != NULL);
  handle_list list = spread(m, 6, 3), reversed = {0};
  size_t const V = m->vertex_count, H = list.count;
  float *weights = weights_of(m, &list), *again = weights_of(m, &list);
  CHECK(memcmp(weights, again, H * V * sizeof *weights) == 0);
  free(again);
  for (size_t h = H; h-- > 0;) {
    add(&reversed, list.vertices[h]);
  }
  again = weights_of(m, &reversed);
  for (size_t i = 0; i < H * V; ++i) {
    CHECK_NEAR((double)again[(H - 1 - i / V) * V + i % V], (double)weights[i], 1e-5);
  }
  free(again);
  exm_mesh_destroy(m);
  double const scales[] = {1e-12, 1e-3, 1e3, 1e12};
  for (size_t k = 0; k < 4; ++k) {
    test_about("scale %g", scales[k]);
    zoo_mesh scaled = zoo_sphere(3);
    for (size_t v = 0; v < V; ++v) {
      for (size_t i = 0; i < 3; ++i) {
        scaled.positions[v][i] = (float)((double)scaled.positions[v][i] * scales[k]);
      }
    }
    m = zoo_create(&scaled);
    REQUIRE(m != NULL);
    again = weights_of(m, &list);
    for (size_t i = 0; i < H * V; ++i) {
      CHECK_NEAR((double)again[i], (double)weights[i], 1e-4);
    }
    free(again);
    exm_mesh_destroy(m);
    zoo_free(&scaled);
  }
  free(weights);
  zoo_free(&sphere);
}

/* --------------------------------------------------------------------------------------------------------- refusals */

#define REFUSED(handles, ...)                                                                                          \
  CHECK_STATUS(exm_weights_bounded_biharmonic(m, &(handles), NULL, NULL, weights), EXM_ERROR_ARGUMENT, __VA_ARGS__)

TEST(missing_arguments)
{
  exm_mesh *m = zoo_create(zoo_find("torus"));
  REQUIRE(m != NULL);
  handle_list const list = spread(m, 3, 1);
  exm_handles const good = view(&list);
  float *weights = test_array(MOST * m->vertex_count, sizeof *weights);
  CHECK_STATUS(exm_weights_bounded_biharmonic(NULL, &good, NULL, NULL, weights), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_weights_bounded_biharmonic(m, NULL, NULL, NULL, weights), EXM_ERROR_ARGUMENT, "handles is NULL");
  CHECK_STATUS(exm_weights_bounded_biharmonic(m, &good, NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "weights is NULL");
  exm_handles bad = good;
  bad.count = 0;
  REFUSED(bad, "no handles");
  bad = good;
  bad.vertex_offsets = NULL;
  REFUSED(bad, "vertex_offsets is NULL");
  bad = good;
  bad.vertices = NULL;
  REFUSED(bad, "vertices is NULL");
  free(weights);
  exm_mesh_destroy(m);
}

TEST(offsets_and_vertices_are_checked)
{
  exm_mesh *m = zoo_create(zoo_find("torus"));
  REQUIRE(m != NULL);
  handle_list const list = spread(m, 3, 1);
  size_t const V = m->vertex_count, bytes = MOST * V * sizeof(float);
  float *weights = test_array(bytes, 1), *untouched = test_array(bytes, 1);
  memset(weights, 0x55, bytes);
  memset(untouched, 0x55, bytes);
  size_t const shifted[] = {1, 2, 3, 4, 5}, empty[] = {0, 1, 1, 3, 4}, falling[] = {0, 3, 2, 3, 4};
  size_t const crowd[] = {0, 1, 2, 3, V + 1}, pairs[] = {0, 1, 2, 4};
  uint32_t const outside[] = {0, (uint32_t)V, 2, 3}, within[] = {0, 1, 7, 7}, across[] = {0, 7, 2, 7};
  exm_element kind;
  size_t index;
  exm_handles bad = view(&list);
  bad.vertex_offsets = shifted;
  REFUSED(bad, "begins with 1");
  bad.vertex_offsets = empty;
  REFUSED(bad, "handle 1 has no vertices");
  bad.vertex_offsets = falling;
  REFUSED(bad, "handle 1", "3 and 2");
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_HANDLE && index == 1);
  bad.vertex_offsets = crowd;
  REFUSED(bad, "vertices, but there are");
  bad = (exm_handles){3, NULL, pairs, outside};
  REFUSED(bad, "handle 1", "vertex");
  bad.vertices = within;
  REFUSED(bad, "vertex 7", "twice in handle 2");
  bad.vertices = across;
  REFUSED(bad, "vertex 7 belongs to handles 1 and 2");
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_VERTEX && index == 7);
  CHECK(memcmp(weights, untouched, bytes) == 0);
  free(weights);
  free(untouched);
  exm_mesh_destroy(m);
}

/* Kinds count for deformers, not for weights. */
TEST(kinds_are_checked)
{
  exm_mesh *m = zoo_create(zoo_find("torus"));
  REQUIRE(m != NULL);
  handle_list list = spread(m, 3, 1);
  exm_handles handles = view(&list);
  float *weights = test_array(MOST * m->vertex_count, sizeof *weights);
  list.kinds[2] = 3;
  CHECK_STATUS(handles_check(m, &handles), EXM_ERROR_ARGUMENT, "handle 2", "kind 3");
  list.kinds[2] = EXM_HANDLE_FREE;
  CHECK(handles_check(m, &handles) == EXM_OK);
  handles.kinds = NULL;
  CHECK_STATUS(handles_check(m, &handles), EXM_ERROR_ARGUMENT, "kinds is NULL");
  CHECK(exm_weights_bounded_biharmonic(m, &handles, NULL, NULL, weights) == EXM_OK);
  free(weights);
  exm_mesh_destroy(m);
}

TEST(parts_without_a_handle_are_named)
{
  size_t count;
  const zoo_mesh *animals = zoo(&count);
  bool found = false;
  for (size_t a = 0; a < count; ++a) {
    exm_mesh *m = zoo_create(&animals[a]);
    REQUIRE(m != NULL);
    if (animals[a].components >= 2) {
      test_about("%s", animals[a].name);
      handle_list list = {0};
      size_t bare = 0, index;
      exm_element kind;
      char parts[32];
      add(&list, 0);
      while (m->components[bare] == m->components[0]) {
        ++bare;
      }
      exm_handles const handles = view(&list);
      float *weights = test_array(m->vertex_count, sizeof *weights);
      snprintf(parts, sizeof parts, "%zu of %zu", animals[a].components - 1, animals[a].components);
      CHECK_STATUS(exm_weights_bounded_biharmonic(m, &handles, NULL, NULL, weights), EXM_ERROR_UNCONSTRAINED, parts);
      exm_last_error_element(&kind, &index);
      CHECK(kind == EXM_ELEMENT_VERTEX && index == bare);
      free(weights);
      found = true;
    }
    exm_mesh_destroy(m);
  }
  CHECK(found);
}

TEST(weights_from_elsewhere_are_checked)
{
  exm_mesh *m = zoo_create(zoo_find("torus"));
  REQUIRE(m != NULL);
  handle_list const list = spread(m, 2, 1);
  exm_handles const handles = view(&list);
  float *weights = weights_of(m, &list);
  size_t const V = m->vertex_count, held = list.vertices[1];
  size_t free_vertex = 0;
  while (free_vertex == list.vertices[0] || free_vertex == held || free_vertex == list.vertices[2]) {
    ++free_vertex;
  }
  float *entry = &weights[V + free_vertex];
  float const kept = *entry;
  char name[32];
  snprintf(name, sizeof name, "vertex %zu", free_vertex);
  *entry = kept + 0.1F;
  CHECK_STATUS(handles_check_weights(m, &handles, weights), EXM_ERROR_ARGUMENT, name, "instead of 1");
  *entry = -0.5F;
  CHECK_STATUS(handles_check_weights(m, &handles, weights), EXM_ERROR_ARGUMENT, name, "handle 1", "-0.5");
  *entry = NAN;
  CHECK_STATUS(handles_check_weights(m, &handles, weights), EXM_ERROR_ARGUMENT, name);
  *entry = kept;
  CHECK(handles_check_weights(m, &handles, weights) == EXM_OK);
  weights[held] = 0.5F;
  weights[V + held] = 0.5F;
  snprintf(name, sizeof name, "vertex %zu", held);
  CHECK_STATUS(handles_check_weights(m, &handles, weights), EXM_ERROR_ARGUMENT, name, "handle 1", "0.5");
  free(weights);
  exm_mesh_destroy(m);
}

typedef struct watcher {
  int calls, stop_at;
  double last;
} watcher;

static int watch(void *user, double fraction, const char *stage)
{
  watcher *w = user;
  CHECK(fraction >= w->last && fraction <= 1);
  CHECK(stage != NULL && stage[0] != 0);
  w->last = fraction;
  return ++w->calls == w->stop_at;
}

TEST(progress_and_cancelling)
{
  zoo_mesh bar = zoo_bar(20, 4);
  exm_mesh *m = zoo_create(&bar);
  REQUIRE(m != NULL);
  handle_list const list = spread(m, 5, 2);
  exm_handles const handles = view(&list);
  size_t const bytes = list.count * m->vertex_count * sizeof(float);
  float *weights = test_array(bytes, 1), *untouched = test_array(bytes, 1);
  watcher whole = {0};
  CHECK(exm_weights_bounded_biharmonic(m, &handles, watch, &whole, weights) == EXM_OK);
  CHECK(whole.calls >= 4 && whole.last > 0.999);
  memset(weights, 0x55, bytes);
  memset(untouched, 0x55, bytes);
  for (int call = 1; call <= whole.calls; ++call) {
    watcher stopped = {.stop_at = call};
    CHECK_STATUS(exm_weights_bounded_biharmonic(m, &handles, watch, &stopped, weights), EXM_ERROR_CANCELLED,
                 "cancelled");
    CHECK(stopped.calls == call);
    CHECK(memcmp(weights, untouched, bytes) == 0);
  }
  free(weights);
  free(untouched);
  exm_mesh_destroy(m);
  zoo_free(&bar);
}

typedef struct request {
  const exm_mesh *mesh;
  exm_handles handles;
  float *weights;
} request;

static exm_status compute(void *context)
{
  const request *r = context;
  return exm_weights_bounded_biharmonic(r->mesh, &r->handles, NULL, NULL, r->weights);
}

TEST(every_allocation_fails_once)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  exm_mesh *m = zoo_create(zoo_find("torus"));
  REQUIRE(m != NULL);
  handle_list const list = spread(m, 3, 1);
  request r = {m, view(&list), test_array(list.count * m->vertex_count, sizeof(float))};
  CHECK(for_each_failed_allocation(compute, &r) > 30);
  free(r.weights);
  exm_mesh_destroy(m);
}
