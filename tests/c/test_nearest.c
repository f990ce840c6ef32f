/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The index of points against a look at all of them, with ties, filters and reaches. */
#include "numeric/nearest.h"

#include "harness.h"

typedef struct cloud {
  size_t count;
  double (*points)[3], (*normals)[3];
} cloud;

/** Points on a coarse lattice repeat each other's distances, and some are the same point. */
static cloud cloud_create(size_t count, int is_lattice, uint64_t seed)
{
  test_random random = {seed};
  cloud c = {count, test_array(count + 1, sizeof *c.points), test_array(count + 1, sizeof *c.normals)};
  for (size_t i = 0; i < count; i++) {
    double length = 0;
    for (int k = 0; k < 3; k++) {
      double const u = test_uniform(&random);
      c.points[i][k] = is_lattice ? floor(u * 4) : u * (k == 2 ? 0.1 : 1);
      c.normals[i][k] = test_uniform(&random) - 0.5;
      length += c.normals[i][k] * c.normals[i][k];
    }
    for (int k = 0; k < 3; k++) {
      c.normals[i][k] = i % 7 == 0 ? 0 : c.normals[i][k] / sqrt(length);
    }
  }
  return c;
}

static void cloud_free(cloud *c)
{
  free(c->points);
  free(c->normals);
}

static int agrees(const nearest_filter *f, size_t i, const double direction[3])
{
  double cosine = 0, own = 0, other = 0;
  for (int k = 0; k < 3; k++) {
    cosine += f->normals[i][k] * direction[k];
    own += f->normals[i][k] * f->normals[i][k];
    other += direction[k] * direction[k];
  }
  return own == 0 || other == 0 || (f->is_unsigned ? fabs(cosine) : cosine) >= f->least_cosine;
}

static double squared_distance(const double a[3], const double b[3])
{
  double const x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return x * x + y * y + z * z;
}

static uint32_t look_at_all(const cloud *c, const double query[3], const double direction[3], const nearest_filter *f,
                            double reach)
{
  uint32_t best = NEAREST_NONE;
  double least = reach * reach;
  for (size_t i = 0; i < c->count; i++) {
    double const squared = squared_distance(c->points[i], query);
    if ((squared < least || (squared == least && best == NEAREST_NONE)) && (!f || agrees(f, i, direction))) {
      best = (uint32_t)i;
      least = squared;
    }
  }
  return best;
}

TEST(is_the_nearest_of_all)
{
  static size_t const sizes[] = {1, 2, 7, 8, 9, 64, 65, 1000};
  for (size_t round = 0; round < 16; round++) {
    test_about("round %zu", round);
    arena memory = {0};
    nearest tree;
    cloud c = cloud_create(sizes[round % 8], round >= 8, 3 + round),
          queries = cloud_create(300, round >= 8, 99 + round);
    uint32_t found[300], filtered[300];
    double squared[300];
    nearest_filter const filter = {(const double(*)[3])c.normals, 0.5, round % 2 == 1};
    REQUIRE(nearest_create(&memory, (const double(*)[3])c.points, c.count, &tree) == EXM_OK);
    nearest_find(&tree, (const double(*)[3])queries.points, 300, NULL, NULL, INFINITY, 1, found, squared);
    nearest_find(&tree, (const double(*)[3])queries.points, 300, (const double(*)[3])queries.normals, &filter, 0.3, 2,
                 filtered, NULL);
    for (size_t i = 0; i < 300; i++) {
      uint32_t const expected = look_at_all(&c, queries.points[i], NULL, NULL, INFINITY);
      CHECK(found[i] == expected);
      CHECK(squared[i] == squared_distance(c.points[expected], queries.points[i]));
      CHECK(filtered[i] == look_at_all(&c, queries.points[i], queries.normals[i], &filter, 0.3));
    }
    arena_release(&memory);
    cloud_free(&c);
    cloud_free(&queries);
  }
}

TEST(several_are_sorted_and_none_is_nearer)
{
  enum { WANTED = 12 };
  static size_t const sizes[] = {1, 5, 12, 500};
  for (size_t round = 0; round < 8; round++) {
    test_about("round %zu", round);
    arena memory = {0};
    nearest tree;
    cloud c = cloud_create(sizes[round % 4], round >= 4, 7 + round);
    uint32_t *found = test_array(c.count * WANTED, sizeof *found);
    double *squared = test_array(c.count * WANTED, sizeof *squared);
    REQUIRE(nearest_create(&memory, (const double(*)[3])c.points, c.count, &tree) == EXM_OK);
    nearest_find_several(&tree, (const double(*)[3])c.points, c.count, WANTED, 2, found, squared);
    size_t const there = c.count < WANTED ? c.count : WANTED;
    for (size_t i = 0; i < c.count; i++) {
      size_t nearer = 0;
      for (size_t k = 0; k < WANTED; k++) {
        CHECK((found[i * WANTED + k] != NEAREST_NONE) == (k < there));
        CHECK(k == 0 || k >= there || squared[i * WANTED + k] >= squared[i * WANTED + k - 1]);
      }
      for (size_t j = 0; j < c.count; j++) {
        nearer += squared_distance(c.points[j], c.points[i]) < squared[i * WANTED + there - 1];
      }
      CHECK(nearer < there);
      CHECK(squared[i * WANTED] == 0);
    }
    arena_release(&memory);
    cloud_free(&c);
    free(found);
    free(squared);
  }
}

TEST(nothing_is_nearest_to_no_points)
{
  arena memory = {0};
  nearest tree;
  double const query[1][3] = {{0, 0, 0}};
  uint32_t found = 5;
  REQUIRE(nearest_create(&memory, query, 0, &tree) == EXM_OK);
  nearest_find(&tree, query, 1, NULL, NULL, INFINITY, 1, &found, NULL);
  CHECK(found == NEAREST_NONE);
  arena_release(&memory);
}
