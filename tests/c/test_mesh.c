/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What validation says of a mesh, and every way to be refused. The geometry's laws are in test_geometry.c. */
#include <pthread.h>

#include "allocation.h"
#include "harness.h"
#include "mesh/mesh.h"
#include "zoo.h"

#define FOR_EACH_IN_ZOO(specimen, made)                                                                                \
  for (size_t zoo_count_ = 0, zoo_i_ = (zoo(&zoo_count_), 0); zoo_i_ < zoo_count_; ++zoo_i_)                           \
    for (const zoo_mesh *specimen = zoo(&zoo_count_) + zoo_i_; specimen; specimen = NULL)                              \
      for (exm_mesh *made = (test_about("%s", specimen->name), zoo_create(specimen)); made;                            \
           exm_mesh_destroy(made), made = NULL)

static const float CORNERS[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
static const uint32_t FACES[][3] = {{0, 1, 2}, {2, 1, 3}};

static exm_status create(const float (*positions)[3], size_t vertices, const uint32_t (*triangles)[3], size_t faces)
{
  exm_mesh *made = (exm_mesh *)&made; /* anything but NULL */
  exm_status const status =
      exm_mesh_create(positions ? positions[0] : NULL, vertices, triangles ? triangles[0] : NULL, faces, &made);
  CHECK((status >= 0) == (made != NULL));
  exm_mesh_destroy(made);
  return status;
}

/* --------------------------------------------------------------------------------------------------------- the report
 */

TEST(zoo_is_reported_as_it_is)
{
  FOR_EACH_IN_ZOO(specimen, made)
  {
    exm_mesh_report report;
    exm_mesh_report_init(&report);
    CHECK_STATUS(exm_mesh_get_report(made, &report), EXM_OK);
    CHECK(report.vertex_count == specimen->vertex_count);
    CHECK(report.triangle_count == specimen->triangle_count);
    CHECK(report.component_count == specimen->components);
    CHECK(report.boundary_edge_count == specimen->boundary_edges);
    CHECK(report.non_manifold_edge_count == specimen->non_manifold_edges);
    CHECK(report.degenerate_face_count == specimen->degenerate_faces);
    CHECK(report.loose_vertex_count == specimen->loose_vertices);
  }
}

TEST(flawed_meshes_are_usable_with_a_warning)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  for (size_t i = 0; i < count; ++i) {
    const zoo_mesh *z = &all[i];
    test_about("%s", z->name);
    exm_mesh *made;
    exm_status const status =
        exm_mesh_create(z->positions[0], z->vertex_count, z->triangles[0], z->triangle_count, &made);
    CHECK(status == (z->sound ? EXM_OK : EXM_WARNING_MESH));
    exm_mesh_destroy(made);
  }
}

TEST(warning_says_what_and_where)
{
  const zoo_mesh *z = zoo_find("zero area");
  exm_element kind;
  size_t index;
  CHECK_STATUS(
      create((const float(*)[3])z->positions, z->vertex_count, (const uint32_t(*)[3])z->triangles, z->triangle_count),
      EXM_WARNING_MESH, "0 non-manifold edges", "2 degenerate faces", "0 loose vertices");
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_FACE && index == 1);
  z = zoo_find("loose vertices");
  CHECK_STATUS(
      create((const float(*)[3])z->positions, z->vertex_count, (const uint32_t(*)[3])z->triangles, z->triangle_count),
      EXM_WARNING_MESH, "2 loose vertices");
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_VERTEX && index == 0);
}

TEST(flaws_are_listed)
{
  uint32_t found[8] = {77, 77, 77, 77, 77, 77, 77, 77};
  size_t count = 0;
  exm_mesh *made = zoo_create(zoo_find("doubled face"));
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_NON_MANIFOLD_EDGE, found, 8, &count), EXM_OK);
  uint32_t const edges[] = {0, 1, 0, 2, 1, 2};
  CHECK(count == 6 && memcmp(found, edges, sizeof edges) == 0 && found[6] == 77);
  exm_mesh_destroy(made);

  made = zoo_create(zoo_find("loose vertices"));
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_LOOSE_VERTEX, found, 8, &count), EXM_OK);
  CHECK(count == 2 && found[0] == 0 && found[1] == 4);
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_DEGENERATE_FACE, NULL, 0, &count), EXM_OK);
  CHECK(count == 0);
  exm_mesh_destroy(made);
}

TEST(flaws_keep_to_the_capacity)
{
  uint32_t found[2] = {77, 77};
  size_t count = 0;
  exm_mesh *made = zoo_create(zoo_find("zero area"));
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_DEGENERATE_FACE, found, 1, &count), EXM_OK);
  CHECK(count == 2 && found[0] == 1 && found[1] == 77);
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_DEGENERATE_FACE, NULL, 0, &count), EXM_OK);
  CHECK(count == 2);
  exm_mesh_destroy(made);
}

TEST(arrays_come_back_bit_by_bit)
{
  FOR_EACH_IN_ZOO(specimen, made)
  {
    float(*positions)[3] = test_array(specimen->vertex_count, sizeof *positions);
    uint32_t(*triangles)[3] = test_array(specimen->triangle_count, sizeof *triangles);
    CHECK_STATUS(exm_mesh_get_arrays(made, positions[0], triangles[0]), EXM_OK);
    CHECK(memcmp(positions, specimen->positions, specimen->vertex_count * sizeof *positions) == 0);
    CHECK(memcmp(triangles, specimen->triangles, specimen->triangle_count * sizeof *triangles) == 0);
    CHECK_STATUS(exm_mesh_get_arrays(made, NULL, NULL), EXM_OK);
    free(positions);
    free(triangles);
  }
}

/* ----------------------------------------------------------------------------------------------------------- topology
 */

/* Does an edge u v occur in the triangle list? The slow and obvious way. */
static bool has_edge(const zoo_mesh *z, uint32_t u, uint32_t v)
{
  for (size_t f = 0; f < z->triangle_count; ++f) {
    bool has_u = false, has_v = false;
    for (int i = 0; i < 3; ++i) {
      has_u = has_u || z->triangles[f][i] == u;
      has_v = has_v || z->triangles[f][i] == v;
    }
    if (has_u && has_v && u != v) {
      return true;
    }
  }
  return false;
}

TEST(rings_are_the_edges_of_the_triangles)
{
  FOR_EACH_IN_ZOO(specimen, made)
  {
    for (uint32_t u = 0; u < made->vertex_count; ++u) {
      uint32_t next = made->neighbor_offsets[u];
      for (uint32_t v = 0; v < made->vertex_count; ++v) { /* in order, so this checks that rings are sorted as well */
        bool const listed = next < made->neighbor_offsets[u + 1] && made->neighbors[next] == v;
        CHECK(listed == has_edge(specimen, u, v));
        next += listed;
      }
      CHECK(next == made->neighbor_offsets[u + 1]);
    }
  }
}

TEST(euler_characteristic)
{
  FOR_EACH_IN_ZOO(specimen, made)
  {
    long const edges = (long)made->neighbor_offsets[made->vertex_count] / 2;
    long const vertices = (long)(made->vertex_count - made->report.loose_vertex_count);
    CHECK(vertices - edges + (long)made->triangle_count == specimen->euler_characteristic);
  }
}

TEST(components_are_numbered_by_their_lowest_vertex)
{
  FOR_EACH_IN_ZOO(specimen, made)
  {
    uint32_t seen = 0;
    for (size_t v = 0; v < made->vertex_count; ++v) {
      CHECK(made->components[v] <= seen);
      seen += made->components[v] == seen;
      for (uint32_t i = made->neighbor_offsets[v]; i < made->neighbor_offsets[v + 1]; ++i) {
        CHECK(made->components[made->neighbors[i]] == made->components[v]);
      }
    }
    CHECK(seen == specimen->components);
  }
}

TEST(topology_does_not_depend_on_the_order_of_triangles)
{
  /* OpenMesh accepts or refuses a triangle by what came before it; the answer must not show that. */
  test_random random = {7};
  FOR_EACH_IN_ZOO(specimen, made)
  {
    zoo_mesh shuffled = *specimen;
    shuffled.triangles = test_array(specimen->triangle_count, sizeof *shuffled.triangles);
    memcpy(shuffled.triangles, specimen->triangles, specimen->triangle_count * sizeof *shuffled.triangles);
    for (size_t f = specimen->triangle_count; f-- > 1;) {
      size_t const other = (size_t)(test_uniform(&random) * (double)(f + 1));
      uint32_t kept[3];
      memcpy(kept, shuffled.triangles[f], sizeof kept);
      memcpy(shuffled.triangles[f], shuffled.triangles[other], sizeof kept);
      memcpy(shuffled.triangles[other], kept, sizeof kept);
    }
    exm_mesh *again = zoo_create(&shuffled);
    REQUIRE(again != NULL);
    size_t const offsets = (made->vertex_count + 1) * sizeof *made->neighbor_offsets;
    CHECK(memcmp(again->neighbor_offsets, made->neighbor_offsets, offsets) == 0);
    CHECK(memcmp(again->neighbors, made->neighbors,
                 made->neighbor_offsets[made->vertex_count] * sizeof *made->neighbors) == 0);
    CHECK(again->report.boundary_edge_count == made->report.boundary_edge_count);
    CHECK(again->report.non_manifold_edge_count == made->report.non_manifold_edge_count);
    exm_mesh_destroy(again);
    free(shuffled.triangles);
  }
}

/* ----------------------------------------------------------------------------------------------------------- refusals
 */

TEST(create_refuses_null)
{
  exm_mesh *made;
  CHECK_STATUS(exm_mesh_create(NULL, 4, FACES[0], 2, &made), EXM_ERROR_ARGUMENT, "positions", "NULL");
  CHECK_STATUS(exm_mesh_create(CORNERS[0], 4, NULL, 2, &made), EXM_ERROR_ARGUMENT, "triangles", "NULL");
  CHECK_STATUS(exm_mesh_create(CORNERS[0], 4, FACES[0], 2, NULL), EXM_ERROR_ARGUMENT, "out", "NULL");
}

TEST(create_refuses_emptiness)
{
  CHECK_STATUS(create(CORNERS, 0, FACES, 2), EXM_ERROR_ARGUMENT, "no vertices");
  CHECK_STATUS(create(CORNERS, 4, FACES, 0), EXM_ERROR_ARGUMENT, "no triangles");
}

TEST(create_refuses_sizes_that_do_not_fit)
{
  CHECK_STATUS(create(CORNERS, SIZE_MAX, FACES, 2), EXM_ERROR_OUT_OF_MEMORY, "does not fit");
  CHECK_STATUS(create(CORNERS, (size_t)INT32_MAX + 1, FACES, 2), EXM_ERROR_OUT_OF_MEMORY, "2147483648 vertices");
  CHECK_STATUS(create(CORNERS, 4, FACES, SIZE_MAX / 3), EXM_ERROR_OUT_OF_MEMORY, "does not fit");
}

TEST(create_refuses_what_is_not_finite)
{
  float const bad[] = {NAN, INFINITY, -INFINITY};
  const char *const spelling[] = {"nan", "inf", "-inf"};
  for (size_t i = 0; i < 3; ++i) {
    float positions[4][3];
    memcpy(positions, CORNERS, sizeof positions);
    positions[2][i] = bad[i];
    char axis[] = {"xyz"[i], ' ', 'c', 0};
    CHECK_STATUS(create((const float(*)[3])positions, 4, FACES, 2), EXM_ERROR_ARGUMENT, "vertex 2", axis, spelling[i]);
    exm_element kind;
    size_t index;
    exm_last_error_element(&kind, &index);
    CHECK(kind == EXM_ELEMENT_VERTEX && index == 2);
  }
}

TEST(create_refuses_a_mesh_without_extent)
{
  static const float point[4][3] = {{3, 2, 1}, {3, 2, 1}, {3, 2, 1}, {3, 2, 1}};
  CHECK_STATUS(create(point, 4, FACES, 2), EXM_ERROR_ARGUMENT, "all 4 vertices", "same point");
}

TEST(create_refuses_points_for_triangles)
{
  static const float positions[4][3] = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {0, 0, 0}};
  CHECK_STATUS(create(positions, 4, FACES, 1), EXM_ERROR_TOPOLOGY, "single point");
}

TEST(create_refuses_an_index_out_of_range)
{
  static const uint32_t triangles[][3] = {{0, 1, 2}, {2, 1, 4}};
  CHECK_STATUS(create(CORNERS, 4, triangles, 2), EXM_ERROR_TOPOLOGY, "triangle 1", "corner 2", "vertex 4",
               "4 vertices");
  exm_element kind;
  size_t index;
  exm_last_error_element(&kind, &index);
  CHECK(kind == EXM_ELEMENT_FACE && index == 1);
}

TEST(create_refuses_a_repeated_corner)
{
  static const uint32_t triangles[][3][3] = {{{0, 0, 2}}, {{0, 2, 2}}, {{2, 0, 2}}};
  const char *const named[] = {"vertex 0", "vertex 2", "vertex 2"};
  for (size_t i = 0; i < 3; ++i) {
    CHECK_STATUS(create(CORNERS, 4, triangles[i], 1), EXM_ERROR_TOPOLOGY, "triangle 0", named[i]);
  }
}

TEST(other_calls_refuse_null)
{
  exm_mesh *made = zoo_create(zoo_find("tetrahedron"));
  exm_mesh_report report;
  exm_mesh_report_init(&report);
  double weights[4][3];
  size_t count;
  CHECK_STATUS(exm_mesh_get_report(NULL, &report), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_mesh_get_report(made, NULL), EXM_ERROR_ARGUMENT, "report is NULL");
  CHECK_STATUS(exm_mesh_get_arrays(NULL, NULL, NULL), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_mesh_cotangents(NULL, weights[0]), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_mesh_cotangents(made, NULL), EXM_ERROR_ARGUMENT, "cotangents is NULL");
  CHECK_STATUS(exm_mesh_flaws(NULL, EXM_FLAW_LOOSE_VERTEX, NULL, 0, &count), EXM_ERROR_ARGUMENT, "mesh is NULL");
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_LOOSE_VERTEX, NULL, 0, NULL), EXM_ERROR_ARGUMENT, "count is NULL");
  CHECK_STATUS(exm_mesh_flaws(made, EXM_FLAW_LOOSE_VERTEX, NULL, 1, &count), EXM_ERROR_ARGUMENT, "elements is NULL");
  exm_mesh_destroy(made);
  exm_mesh_destroy(NULL);
  exm_mesh_report_init(NULL);
}

TEST(flaws_refuses_an_unknown_kind)
{
  exm_mesh *made = zoo_create(zoo_find("tetrahedron"));
  int const unknown = 3;
  size_t count;
  CHECK_STATUS(exm_mesh_flaws(made, (exm_mesh_flaw)unknown, NULL, 0, &count), EXM_ERROR_ARGUMENT, "flaw is 3");
  exm_mesh_destroy(made);
}

/* ------------------------------------------------------------------------------------- structs that grow, threads,
 * memory */

TEST(report_of_an_older_caller_is_not_overrun)
{
  exm_mesh *made = zoo_create(zoo_find("tetrahedron"));
  exm_mesh_report report;
  memset(&report, 0x55, sizeof report);
  report.struct_size = offsetof(exm_mesh_report, component_count); /* a header that knew three fields */
  CHECK_STATUS(exm_mesh_get_report(made, &report), EXM_OK);
  size_t untouched;
  memset(&untouched, 0x55, sizeof untouched);
  CHECK(report.struct_size == offsetof(exm_mesh_report, component_count));
  CHECK(report.vertex_count == 4 && report.triangle_count == 4);
  CHECK(report.component_count == untouched);
  exm_mesh_destroy(made);
}

TEST(report_of_a_newer_caller_keeps_its_new_fields)
{
  struct {
    exm_mesh_report known;
    size_t unknown;
  } report;
  exm_mesh_report_init(&report.known);
  report.known.struct_size = sizeof report;
  report.unknown = 42;
  exm_mesh *made = zoo_create(zoo_find("tetrahedron"));
  CHECK_STATUS(exm_mesh_get_report(made, &report.known), EXM_OK);
  CHECK(report.known.vertex_count == 4 && report.known.struct_size == sizeof report && report.unknown == 42);
  exm_mesh_destroy(made);
}

TEST(report_without_init_is_refused)
{
  exm_mesh *made = zoo_create(zoo_find("tetrahedron"));
  exm_mesh_report report = {0};
  CHECK_STATUS(exm_mesh_get_report(made, &report), EXM_ERROR_ARGUMENT, "report->struct_size is 0", "_init");
  report.struct_size = SIZE_MAX;
  CHECK_STATUS(exm_mesh_get_report(made, &report), EXM_ERROR_ARGUMENT, "struct_size", "_init");
  exm_mesh_destroy(made);
}

static void *work_in_a_thread(void *failures)
{
  *(int *)failures += exm_last_error()[0] != 0; /* another thread's error is not ours */
  for (int i = 0; i < 20; ++i) {
    const zoo_mesh *z = zoo_find("torus");
    exm_mesh *made = NULL;
    *(int *)failures +=
        exm_mesh_create(z->positions[0], z->vertex_count, z->triangles[0], z->triangle_count, &made) != 0;
    exm_mesh_destroy(made);
  }
  return NULL;
}

TEST(threads_do_not_meet)
{
  enum { THREADS = 4 };
  zoo_find("torus"); /* the zoo is built before threads look at it */
  CHECK_STATUS(create(NULL, 0, NULL, 0), EXM_ERROR_ARGUMENT);
  pthread_t threads[THREADS];
  int failed[THREADS] = {0};
  for (size_t i = 0; i < THREADS; ++i) {
    REQUIRE(pthread_create(&threads[i], NULL, work_in_a_thread, &failed[i]) == 0);
  }
  for (size_t i = 0; i < THREADS; ++i) {
    pthread_join(threads[i], NULL);
    CHECK(failed[i] == 0);
  }
  CHECK(strstr(exm_last_error(), "positions is NULL") != NULL);
}

static exm_status create_specimen(void *specimen)
{
  const zoo_mesh *z = specimen;
  exm_mesh *made = NULL;
  exm_status const status =
      exm_mesh_create(z->positions[0], z->vertex_count, z->triangles[0], z->triangle_count, &made);
  exm_mesh_destroy(made);
  return status;
}

TEST(create_survives_every_failed_allocation)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  size_t count;
  const zoo_mesh *all = zoo(&count);
  for (size_t i = 0; i < count; ++i) {
    zoo_mesh specimen = all[i];
    test_about("%s", specimen.name);
    CHECK(for_each_failed_allocation(create_specimen, &specimen) > 10);
  }
}
