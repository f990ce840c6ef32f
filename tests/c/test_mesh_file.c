/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Files of every format, good and bad; all of them written here. */
#include <unistd.h>

#include "allocation.h"
#include "harness.h"
#include "zoo.h"

#define PLY_HEADER(vertices)                                                                                           \
  "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex " vertices "\nproperty float x\nproperty float y\n"     \
  "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
#define SQUARE "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
#define FACET(a, b, c)                                                                                                 \
  "facet normal 0 0 1\n outer loop\n  vertex " a "\n  vertex " b "\n  vertex " c "\n endloop\nendfacet\n"

static exm_status read_text(const char *name, const char *text, exm_mesh **out)
{
  return exm_mesh_read(test_file(name, text, strlen(text)), out);
}

/* ------------------------------------------------------------------------------------------------------------- good */

/* A unit square of two triangles, in every way that a format can say it. */
static const struct {
  const char *name, *text;
} SQUARES[] = {
    {"quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"},
    {"upper_case_name.OBJ", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"},
    {"triangles.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"},
    {"no_last_newline.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4"},
    {"carriage_returns.obj", "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4\r\n"},
    {"from_the_end.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -4 -3 -2 -1\n"},
    {"attributes.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1 4/1/1\n"},
    {"comments.obj", "# v nan\nv 0 0 0 # first\nv 1 0 0\n\nv 1 1 0\nv 0 1 0\nf 1 2 3 4 # all\n"},
    {"materials.obj", "mtllib none.mtl\no a\ng b\ns off\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl c\nf 1 2 3 4\n"},
    {"colours.obj", "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3 4\n"},
    {"spellings.obj", "v -0.0 0. 0\nv 1e0 0E-3 +0\nv 100e-2 1.000 -0\nv 0 .1e1 0\nf 1 2 3 4\n"},
    {"a_repeated_corner.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 2 3 4\n"},
    {"a_collapsed_face.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 1 2\n"},
    {"quad.off", "OFF\n4 1 0\n" SQUARE "4 0 1 2 3\n"},
    {"no_last_newline.off", "OFF\n4 1 0\n" SQUARE "4 0 1 2 3"},
    {"comments.off", "OFF\n# made by hand\n\n4 1 0 # counts\n" SQUARE "\n4 0 1 2 3 # all\n"},
    {"face_colours.off", "OFF\n4 2 0\n" SQUARE "3 0 1 2 255 0 0\n3 0 2 3 0.5 0.5 0.5 1\n"},
    {"vertex_colours.off", "COFF\n4 1 0\n0 0 0 255 0 0\n1 0 0 9\n1 1 0\n0 1 0 1 2 3 4 5 6 7 8\n4 0 1 2 3\n"},
    {"normals.off", "NOFF\n4 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n4 0 1 2 3\n"},
    {"repeated_corner.off", "OFF\n4 2 0\n" SQUARE "5 0 1 1 2 3\n3 0 0 1\n"},
    {"quad.ply", PLY_HEADER("4") SQUARE "4 0 1 2 3\n"},
    {"no_last_newline.ply", PLY_HEADER("4") SQUARE "4 0 1 2 3"},
    {"colours.ply",
     "ply\nformat ascii 1.0\nobj_info by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
     "property uchar red\nproperty double alpha\nelement face 1\nproperty list uint8 int32 vertex_index\n"
     "property uchar flags\nelement edge 0\nproperty int a\nend_header\n"
     "0 0 0 1 0.5\n1 0 0 1 0.5\n1 1 0 2 0.5\n0 1 0 3 0.5\n4 0 1 2 3 1\n"},
    {"triangles.stl", "solid a\n" FACET("0 0 0", "1 0 0", "1 1 0") FACET("0 0 0", "1 1 0", "0 1 0") "endsolid a\n"},
};

TEST(every_spelling_of_a_square)
{
  for (size_t i = 0; i < sizeof SQUARES / sizeof *SQUARES; ++i) {
    test_about("%s", SQUARES[i].name);
    exm_mesh *made = NULL;
    CHECK_STATUS(read_text(SQUARES[i].name, SQUARES[i].text, &made), EXM_OK);
    if (made) {
      exm_mesh_report report;
      exm_mesh_report_init(&report);
      exm_mesh_get_report(made, &report);
      CHECK(report.vertex_count == 4 && report.triangle_count == 2 && report.boundary_edge_count == 4);
      CHECK_NEAR(report.diagonal, sqrt(2), 1e-12);
      double cotangents[2][3], area = 0;
      exm_mesh_cotangents(made, cotangents[0]);
      float positions[4][3];
      uint32_t triangles[2][3];
      exm_mesh_get_arrays(made, positions[0], triangles[0]);
      for (size_t f = 0; f < 2; ++f) { /* counter-clockwise: signed areas, seen from +z */
        const float *a = positions[triangles[f][0]], *b = positions[triangles[f][1]], *c = positions[triangles[f][2]];
        area += (double)((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2;
      }
      CHECK_NEAR(area, 1, 1e-12);
    }
    exm_mesh_destroy(made);
  }
}

static size_t put_text(char *bytes, const char *text)
{
  memcpy(bytes, text, strlen(text));
  return strlen(text);
}

static size_t put_floats(char *bytes, const float *values, size_t count)
{
  memcpy(bytes, values, count * sizeof *values); /* the tests run on little-endian machines only */
  return count * sizeof *values;
}

static size_t binary_ply(char *bytes, float last_coordinate)
{
  float const corners[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, last_coordinate};
  unsigned char const face[] = {4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0};
  size_t size = put_text(bytes, "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\n"
                                "property float y\nproperty float z\nelement face 1\n"
                                "property list uchar int vertex_indices\nend_header\n");
  size += put_floats(bytes + size, corners, 12);
  memcpy(bytes + size, face, sizeof face);
  return size + sizeof face;
}

static size_t binary_stl(char *bytes, const char *header, float last_coordinate)
{
  float const facets[2][12] = {{0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0},
                               {0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 1, last_coordinate}};
  memset(bytes, 0, 84 + 2 * 50);
  put_text(bytes, header);
  bytes[80] = 2;
  put_floats(bytes + 84, facets[0], 12);
  put_floats(bytes + 134, facets[1], 12);
  return 84 + 2 * 50;
}

TEST(binary_files)
{
  char bytes[1024];
  exm_mesh *made;
  CHECK_STATUS(exm_mesh_read(test_file("binary.ply", bytes, binary_ply(bytes, 0)), &made), EXM_OK);
  exm_mesh_destroy(made);
  CHECK_STATUS(exm_mesh_read(test_file("binary.stl", bytes, binary_stl(bytes, "made by hand", 0)), &made), EXM_OK);
  exm_mesh_destroy(made);
  CHECK_STATUS(exm_mesh_read(test_file("sly.stl", bytes, binary_stl(bytes, "solid: not text", 0)), &made), EXM_OK);
  exm_mesh_destroy(made);
}

TEST(binary_files_that_are_not_finite)
{
  char bytes[1024];
  exm_mesh *made;
  CHECK_STATUS(exm_mesh_read(test_file("nan.ply", bytes, binary_ply(bytes, NAN)), &made), EXM_ERROR_IO, "nan.ply",
               "vertex 3", "not finite");
  CHECK_STATUS(exm_mesh_read(test_file("nan.stl", bytes, binary_stl(bytes, "", INFINITY)), &made), EXM_ERROR_IO,
               "nan.stl", "facet 1", "vertex 2", "not finite");
}

TEST(binary_files_that_are_cut_short)
{
  char bytes[1024];
  exm_mesh *made;
  size_t const ply = binary_ply(bytes, 0);
  for (size_t size = 1; size < ply; ++size) {
    CHECK_STATUS(exm_mesh_read(test_file("short.ply", bytes, size), &made), EXM_ERROR_IO, "short.ply");
  }
  size_t const stl = binary_stl(bytes, "", 0);
  for (size_t size = 1; size < stl; ++size) {
    CHECK_STATUS(exm_mesh_read(test_file("short.stl", bytes, size), &made), EXM_ERROR_IO, "short.stl");
  }
}

TEST(non_manifold_files_keep_their_vertices)
{
  /* OpenMesh's own importer would add copies of the vertices of the third face. */
  exm_mesh *made;
  CHECK_STATUS(
      read_text("book.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv -1 1 0\nv -1 -1 0\nf 1 2 3\nf 2 1 4\nf 1 2 5\n", &made),
      EXM_WARNING_MESH, "1 non-manifold edges");
  exm_mesh_report report;
  exm_mesh_report_init(&report);
  CHECK_STATUS(exm_mesh_get_report(made, &report), EXM_OK);
  CHECK(report.vertex_count == 5 && report.triangle_count == 3 && report.non_manifold_edge_count == 1);
  exm_mesh_destroy(made);
}

/* -------------------------------------------------------------------------------------------------------------- bad */

static const struct {
  const char *name, *text, *says;
} BAD[] = {
    {"empty.obj", "", "is empty"},
    {"empty.stl", "", "is empty"},
    {"blank.stl", "  \n\n", "has no faces"},
    {"garbage.obj", "\x7f\x45\x4c\x46 nothing\n", "has no faces"},
    {"garbage.off", "\x7f\x45\x4c\x46 nothing\n", "line 1"},
    {"garbage.ply", "\x7f\x45\x4c\x46 nothing\n", "line 1"},
    {"garbage.stl", "\x7f\x45\x4c\x46 nothing\n", "has no faces"},
    {"unknown.fbx", "OFF\n", "\".fbx\" is not known"},
    {"no_extension", "OFF\n", "\".\" is not known"},
    {"no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "has no faces"},
    {"nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", "line 2: \"v 1 nan 0\""},
    {"inf.obj", "v 0 0 0\nv 1 0 0\nv 0 1 -inf\nf 1 2 3\n", "line 3"},
    {"overflow.obj", "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n", "line 2"},
    {"two_coordinates.obj", "v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1"},
    {"comma.obj", "v 0,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1"},
    {"range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: there is no vertex 4, there are 3"},
    {"zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4: there is no vertex 0"},
    {"far_from_the_end.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 1 2\n", "line 4: there is no vertex -9"},
    {"no_vertex_number.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf /1 /2 /3\n", "line 4"},
    {"words.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf one two three\n", "line 4"},
    {"two_corners.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4"},
    {"binary.off", "OFF BINARY\n\1\2\3", "header of a text OFF file"},
    {"four_dimensions.off", "4OFF\n1 0 0\n0 0 0 0\n", "header of a text OFF file"},
    {"header_alone.off", "OFF\n", "the counts of vertices and faces"},
    {"words.off", "OFF\nfour one\n", "line 2"},
    {"truncated.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n", "ends after vertex 2 of 4 and face 0 of 1"},
    {"missing_face.off", "OFF\n4 2 0\n" SQUARE "4 0 1 2 3\n", "ends after vertex 4 of 4 and face 1 of 2"},
    {"nan.off", "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", "line 4: \"1 0 nan\""},
    {"range.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 6: there is no vertex 3, there are 3"},
    {"negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n", "line 6"},
    {"many.off", "OFF\n4000000000 1 0\n0 0 0\n", "too short for 4000000000 vertices and 1 faces"},
    {"valence.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", "line 6"},
    {"nan.ply", PLY_HEADER("4") "0 0 0\n1 nan 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "after vertex"},
    {"range.ply", PLY_HEADER("4") SQUARE "4 0 1 2 4\n", "face 0 has corner 4, but there are 4 vertices"},
    {"truncated.ply", PLY_HEADER("4") "0 0 0\n1 0 0\n", "it ends too early"},
    {"many.ply", PLY_HEADER("4000000000") SQUARE "4 0 1 2 3\n", "line 4"},
    {"valence.ply", PLY_HEADER("4") SQUARE "4000000000 0 1 2 3\n", "after vertex 4 and face 0"},
    {"no_end.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "no end_header"},
    {"no_element.ply", "ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3"},
    {"types.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty flaot x\nend_header\n0\n", "line 4"},
    {"integer_coordinates.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nend_header\n0\n", "line 4"},
    {"list_of_reals.ply", "ply\nformat ascii 1.0\nelement face 1\nproperty list int float vertex_index\nend_header\n",
     "line 4"},
    {"second_list.ply",
     "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_index\nproperty list int float "
     "uv\nend_header\n",
     "line 5"},
    {"late_list.ply",
     "ply\nformat ascii 1.0\nelement face 1\nproperty int flags\nproperty list int int vertex_index\nend_header\n",
     "line 5"},
    {"header.ply", "ply\nformat ascii 1.0\nanything else\nend_header\n", "line 3"},
    {"format.ply", "ply\nformat ebcdic 1.0\nend_header\n", "could not be understood"},
    {"flat.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n",
     "could not be understood"},
    {"nan.stl", "solid a\n" FACET("0 0 0", "1 0 nan", "1 1 0") "endsolid a\n", "line 5"},
    {"two_numbers.stl", "solid a\n" FACET("0 0 0", "1 0", "1 1 0") "endsolid a\n", "line 5"},
    {"truncated.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "middle of a facet"},
    {"four_corners.stl", "solid a\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n",
     "line 6"},
};

TEST(every_bad_file_is_refused_with_a_reason)
{
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; ++i) {
    exm_mesh *made = (exm_mesh *)&made;
    CHECK_STATUS(read_text(BAD[i].name, BAD[i].text, &made), EXM_ERROR_IO, BAD[i].name, BAD[i].says);
    CHECK(made == NULL);
  }
}

TEST(files_that_cannot_be_opened)
{
  exm_mesh *made;
  CHECK_STATUS(exm_mesh_read("/nowhere/at all.obj", &made), EXM_ERROR_IO, "/nowhere/at all.obj", "cannot be opened");
  CHECK_STATUS(exm_mesh_read("/", &made), EXM_ERROR_IO, "not a regular file");
  CHECK_STATUS(exm_mesh_read(NULL, &made), EXM_ERROR_ARGUMENT, "path is NULL");
  CHECK_STATUS(exm_mesh_read("a.obj", NULL), EXM_ERROR_ARGUMENT, "out is NULL");
}

TEST(a_file_is_validated_like_arrays)
{
  exm_mesh *made;
  CHECK_STATUS(read_text("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", &made), EXM_ERROR_ARGUMENT, "same point");
}

/* Runs `run` and returns how many bytes the process wrote to standard error meanwhile. */
static long bytes_on_stderr(void (*run)(void))
{
  char path[512];
  snprintf(path, sizeof path, "%s", test_file("stderr.txt", "", 0));
  int const kept = dup(STDERR_FILENO);
  FILE *const capture = fopen(path, "r+");
  dup2(fileno(capture), STDERR_FILENO);
  run();
  dup2(kept, STDERR_FILENO);
  close(kept);
  fseek(capture, 0, SEEK_END);
  long const written = ftell(capture);
  fclose(capture);
  return written;
}

/* Random damage must end in a mesh or in a status: never in a crash, a hang or a word on standard error. */
static void read_damaged_files(void)
{
  test_random random = {2024};
  for (size_t round = 0; round < 4000; ++round) {
    char bytes[1024];
    size_t const which = round % (sizeof SQUARES / sizeof *SQUARES + 2);
    const char *name = which % 2 ? "damaged.ply" : "damaged.stl";
    size_t size;
    if (which < sizeof SQUARES / sizeof *SQUARES) {
      name = SQUARES[which].name;
      size = put_text(bytes, SQUARES[which].text);
    } else {
      size = which % 2 ? binary_ply(bytes, 0) : binary_stl(bytes, "", 0);
    }
    test_about("round %zu, %s", round, name);
    for (int damage = (int)(3 * test_uniform(&random)); damage >= 0; --damage) {
      static const char spice[] = "0123456789-+.e/ \n\t#vfn\0\xff";
      size_t const where = (size_t)((double)size * test_uniform(&random));
      bytes[where] = spice[(size_t)(test_uniform(&random) * (double)(sizeof spice - 1))];
    }
    size -= test_uniform(&random) < 0.2 ? (size_t)((double)size * test_uniform(&random)) : 0;
    exm_mesh *made = NULL;
    exm_status const status = exm_mesh_read(test_file(name, bytes, size), &made);
    CHECK((status >= 0) == (made != NULL));
    CHECK(status != EXM_ERROR_INTERNAL);
    exm_mesh_destroy(made);
  }
}

TEST(damaged_files)
{
  CHECK(bytes_on_stderr(read_damaged_files) == 0);
}

/* -------------------------------------------------------------------------------------------- memory, real data */

/* Iostreams swallow std::bad_alloc, so a success is looked at: it has to be the whole square. */
static exm_status read_square(void *path)
{
  exm_mesh *made = NULL;
  exm_status const status = exm_mesh_read(path, &made);
  exm_mesh_report report;
  exm_mesh_report_init(&report);
  bool const whole = status < 0 || (exm_mesh_get_report(made, &report) == EXM_OK && report.vertex_count == 4 &&
                                    report.triangle_count == 2 && fabs(report.diagonal - sqrt(2)) < 1e-12);
  exm_mesh_destroy(made);
  return whole ? status : EXM_ERROR_INTERNAL;
}

TEST(read_survives_every_failed_allocation)
{
  if (!allocation_can_fail()) {
    SKIP("allocations cannot be made to fail here");
  }
  const char *const chosen[] = {"quad.obj", "quad.off", "quad.ply", "triangles.stl"};
  for (size_t i = 0; i < sizeof SQUARES / sizeof *SQUARES; ++i) {
    for (size_t c = 0; c < 4; ++c) {
      if (strcmp(SQUARES[i].name, chosen[c]) == 0) {
        char path[512];
        snprintf(path, sizeof path, "%s", test_file(SQUARES[i].name, SQUARES[i].text, strlen(SQUARES[i].text)));
        test_about("%s", SQUARES[i].name);
        CHECK(for_each_failed_allocation(read_square, path) > 10);
      }
    }
  }
}

TEST(real_meshes)
{
  static const struct {
    const char *name;
    size_t vertices, triangles;
  } known[] = {{"bar1.off", 722, 1440}, {"cactus_small.off", 620, 1236}, {"dino.off", 14070, 28136}};
  for (size_t i = 0; i < 3; ++i) {
    const char *path = test_data(known[i].name);
    if (!path) {
      SKIP("the real meshes are not here (EXEMPLAR_DATA)");
    }
    exm_mesh *made;
    CHECK_STATUS(exm_mesh_read(path, &made), EXM_OK);
    exm_mesh_report report;
    exm_mesh_report_init(&report);
    CHECK_STATUS(exm_mesh_get_report(made, &report), EXM_OK);
    CHECK(report.vertex_count == known[i].vertices && report.triangle_count == known[i].triangles);
    CHECK(report.boundary_edge_count == 0 && report.component_count == 1);
    exm_mesh_destroy(made);
  }
}
