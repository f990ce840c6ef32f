/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sums over balls against a search from every vertex. */
#include "harness.h"
#include "mesh/balls.h"
#include "zoo.h"

/* How many edges from vertex `from`, or INT32_MAX. */
static void find_distances(const mesh *m, uint32_t from, int32_t *distances)
{
  uint32_t *queue = test_array(m->vertex_count, sizeof *queue);
  size_t count = 0;
  for (size_t v = 0; v < m->vertex_count; ++v) {
    distances[v] = INT32_MAX;
  }
  distances[from] = 0;
  queue[count++] = from;
  for (size_t head = 0; head < count; ++head) {
    for (uint32_t e = m->neighbor_offsets[queue[head]]; e < m->neighbor_offsets[queue[head] + 1]; ++e) {
      if (distances[m->neighbors[e]] == INT32_MAX) {
        distances[m->neighbors[e]] = distances[queue[head]] + 1;
        queue[count++] = m->neighbors[e];
      }
    }
  }
  free(queue);
}

typedef struct sums_case {
  const mesh *m;
  int32_t *radii;
  row12 *x, *y, *back, *expected, *expected_back, *scratch;
  double *counts, *expected_counts;
} sums_case;

/* Rows are aligned more strictly than malloc has it. */
static row12 *rows_of(arena *owner, size_t count)
{
  row12 *rows = ARENA_NEW(owner, row12, count);
  if (!rows) {
    exit(1);
  }
  return rows;
}

static double *numbers(row12 *row)
{
  return (double *)row;
}

static void search(sums_case *c)
{
  size_t const V = c->m->vertex_count;
  int32_t *distances = test_array(V, sizeof *distances);
  for (uint32_t k = 0; k < V; ++k) {
    find_distances(c->m, k, distances);
    for (size_t i = 0; i < V; ++i) {
      if (distances[i] < c->radii[k]) {
        for (size_t e = 0; e < 12; ++e) {
          numbers(&c->expected[k])[e] += numbers(&c->x[i])[e];
          numbers(&c->expected_back[i])[e] += numbers(&c->x[k])[e];
        }
        c->expected_counts[i]++;
      }
    }
  }
  free(distances);
}

static void compare(const sums_case *c, int threads, const set_sums *sums)
{
  set_sums_apply(sums, threads, c->x, c->y);
  set_sums_apply_transposed(sums, threads, c->x, c->scratch, c->back);
  for (size_t v = 0; v < c->m->vertex_count; ++v) {
    for (size_t e = 0; e < 12; ++e) {
      CHECK_NEAR(numbers(&c->y[v])[e], numbers(&c->expected[v])[e], 1e-10);
      CHECK_NEAR(numbers(&c->back[v])[e], numbers(&c->expected_back[v])[e], 1e-10);
    }
    CHECK(c->counts[v] == c->expected_counts[v]);
  }
}

/* kind 0: all `radius`; 1: at random up to it; 2: 1 but for a patch. */
static void check_mesh(const mesh *m, int32_t radius, int kind)
{
  size_t const V = m->vertex_count;
  arena owner = {0};
  test_random random = {(uint64_t)radius + 1};
  sums_case c = {.m = m,
                 .radii = test_array(V, sizeof(int32_t)),
                 .x = rows_of(&owner, V),
                 .y = rows_of(&owner, V),
                 .back = rows_of(&owner, V),
                 .expected = rows_of(&owner, V),
                 .expected_back = rows_of(&owner, V),
                 .scratch = rows_of(&owner, V),
                 .counts = test_array(V, sizeof(double)),
                 .expected_counts = test_array(V, sizeof(double))};
  for (size_t v = 0; v < V; ++v) {
    int32_t const drawn = 1 + (int32_t)(test_uniform(&random) * radius);
    c.radii[v] = kind == 0 ? radius : kind == 1 ? drawn : v < V / 5 ? radius : 1;
    for (size_t e = 0; e < 12; ++e) {
      numbers(&c.x[v])[e] = test_uniform(&random) - 0.5;
    }
  }
  search(&c);
  rings const around = {.vertex_count = V, .offsets = m->neighbor_offsets, .neighbors = m->neighbors};
  set_sums sums;
  CHECK_STATUS(balls_create(&owner, &around, c.radii, NULL, c.counts, &sums), EXM_OK);
  CHECK(sums.is_identity || radius > 1);
  for (int threads = 1; threads < 4; ++threads) {
    compare(&c, threads, &sums);
  }
  free(c.radii);
  free(c.counts);
  free(c.expected_counts);
  arena_release(&owner);
}

TEST(balls_are_what_a_search_finds)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  int32_t const radii[] = {1, 2, 3, 7, 20};
  for (size_t i = 0; i < count; ++i) {
    exm_mesh *m = zoo_create(&all[i]);
    for (size_t r = 0; r < 5 && m; ++r) {
      for (int kind = 0; kind < 3; ++kind) {
        test_about("%s, r = %d, kind %d", all[i].name, radii[r], kind);
        check_mesh(m, radii[r], kind);
      }
    }
    exm_mesh_destroy(m);
  }
}

/* More vertices than a run has. */
TEST(runs_do_not_show)
{
  zoo_mesh shape = zoo_grid(31, 40, 1, 1);
  exm_mesh *m = zoo_create(&shape);
  REQUIRE(m != NULL);
  for (int32_t radius = 2; radius < 12; radius += 3) {
    for (int kind = 0; kind < 3; ++kind) {
      test_about("r = %d, kind %d", radius, kind);
      check_mesh(m, radius, kind);
    }
  }
  exm_mesh_destroy(m);
  zoo_free(&shape);
}

/* What differences are for: ball of 3 R (R + 1) + 1 vertices, entries of about 4 R. */
TEST(entries_grow_with_the_radius_and_not_with_its_square)
{
  zoo_mesh shape = zoo_torus(60, 60, 3, 1);
  exm_mesh *m = zoo_create(&shape);
  REQUIRE(m != NULL);
  arena owner = {0};
  int32_t *radii = test_array(m->vertex_count, sizeof *radii);
  rings const around = {.vertex_count = m->vertex_count, .offsets = m->neighbor_offsets, .neighbors = m->neighbors};
  for (int32_t radius = 5; radius <= 20; radius *= 2) {
    for (size_t v = 0; v < m->vertex_count; ++v) {
      radii[v] = radius;
    }
    set_sums sums;
    CHECK_STATUS(balls_create(&owner, &around, radii, NULL, NULL, &sums), EXM_OK);
    double const entries = sums.rows.starts[2 * m->vertex_count] / (double)m->vertex_count;
    printf("  r = %d: %.1f entries a row instead of %d\n", radius, entries, 3 * radius * (radius - 1) + 1);
    CHECK(entries < 5.5 * radius + 5);
  }
  free(radii);
  arena_release(&owner);
  exm_mesh_destroy(m);
  zoo_free(&shape);
}
