/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "zoo.h"

#include "harness.h"

/* -------------------------------------------------------------------------------------------------------- makers */

static zoo_mesh allocate(size_t vertex_count, size_t triangle_count)
{
  zoo_mesh mesh = {.vertex_count = vertex_count, .triangle_count = triangle_count};
  mesh.positions = test_array(vertex_count, sizeof *mesh.positions);
  mesh.triangles = test_array(triangle_count, sizeof *mesh.triangles);
  mesh.components = 1;
  mesh.sound = true;
  return mesh;
}

void zoo_free(zoo_mesh *mesh)
{
  free(mesh->positions);
  free(mesh->triangles);
  *mesh = (zoo_mesh){0};
}

static void put_vertex(zoo_mesh *mesh, size_t vertex, double x, double y, double z)
{
  mesh->positions[vertex][0] = (float)x;
  mesh->positions[vertex][1] = (float)y;
  mesh->positions[vertex][2] = (float)z;
}

static void put_triangle(zoo_mesh *mesh, size_t triangle, size_t a, size_t b, size_t c)
{
  mesh->triangles[triangle][0] = (uint32_t)a;
  mesh->triangles[triangle][1] = (uint32_t)b;
  mesh->triangles[triangle][2] = (uint32_t)c;
}

/* A quad a b c d (counter-clockwise) as triangles `triangle` and `triangle` + 1. */
static void put_quad(zoo_mesh *mesh, size_t triangle, size_t a, size_t b, size_t c, size_t d)
{
  put_triangle(mesh, triangle, a, b, c);
  put_triangle(mesh, triangle + 1, a, c, d);
}

zoo_mesh zoo_grid(size_t columns, size_t rows, float width, float height)
{
  size_t const row_length = columns + 1;
  zoo_mesh mesh = allocate(row_length * (rows + 1), 2 * columns * rows);
  for (size_t j = 0; j <= rows; ++j) {
    for (size_t i = 0; i <= columns; ++i) {
      put_vertex(&mesh, j * row_length + i, width * (double)i / (double)columns, height * (double)j / (double)rows, 0);
    }
  }
  for (size_t j = 0; j < rows; ++j) {
    for (size_t i = 0; i < columns; ++i) {
      size_t const corner = j * row_length + i;
      put_quad(&mesh, 2 * (j * columns + i), corner, corner + 1, corner + row_length + 1, corner + row_length);
    }
  }
  mesh.name = "grid";
  mesh.boundary_edges = 2 * (columns + rows);
  mesh.euler_characteristic = 1;
  return mesh;
}

zoo_mesh zoo_torus(size_t around, size_t across, float major, float minor)
{
  zoo_mesh mesh = allocate(around * across, 2 * around * across);
  for (size_t i = 0; i < around; ++i) {
    for (size_t j = 0; j < across; ++j) {
      double const u = 2 * M_PI * (double)i / (double)around, v = 2 * M_PI * (double)j / (double)across;
      double const radius = major + minor * cos(v);
      size_t const next_i = (i + 1) % around, next_j = (j + 1) % across;
      put_vertex(&mesh, i * across + j, radius * cos(u), radius * sin(u), minor * sin(v));
      put_quad(&mesh, 2 * (i * across + j), i * across + j, next_i * across + j, next_i * across + next_j,
               i * across + next_j);
    }
  }
  mesh.name = "torus";
  return mesh;
}

/* The vertex of `mesh` at a lattice point, added where it is new. */
static size_t lattice_vertex(zoo_mesh *mesh, double x, double y, double z)
{
  for (size_t i = 0; i < mesh->vertex_count; ++i) {
    const float *p = mesh->positions[i];
    if (p[0] == (float)x && p[1] == (float)y && p[2] == (float)z) {
      return i;
    }
  }
  put_vertex(mesh, mesh->vertex_count, x, y, z);
  return mesh->vertex_count++;
}

zoo_mesh zoo_bar(size_t length, size_t side)
{
  double const size[3] = {(double)length, (double)side, (double)side};
  size_t const cells[3] = {length, side, side};
  size_t const quads = 2 * (2 * length * side + side * side);
  zoo_mesh mesh = allocate(4 * quads, 2 * quads);
  mesh.vertex_count = 0;
  size_t triangle = 0;
  for (int axis = 0; axis < 3; ++axis) { /* two faces across each axis, outward normals */
    int const u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int far = 0; far < 2; ++far) {
      for (size_t i = 0; i < cells[u] * cells[v]; ++i) {
        size_t corner[4];
        for (size_t k = 0; k < 4; ++k) { /* counter-clockwise seen from +axis */
          double p[3];
          p[axis] = far ? size[axis] : 0;
          p[u] = (double)(i % cells[u]) + (k == 1 || k == 2);
          p[v] = (double)(i / cells[u]) + (k >= 2);
          corner[k] = lattice_vertex(&mesh, p[0], p[1], p[2]);
        }
        put_quad(&mesh, triangle, corner[0], corner[far ? 1 : 3], corner[2], corner[far ? 3 : 1]);
        triangle += 2;
      }
    }
  }
  mesh.name = "bar";
  mesh.euler_characteristic = 2;
  return mesh;
}

static size_t sphere_vertex(zoo_mesh *mesh, double x, double y, double z)
{
  double const scale = 1 / sqrt(x * x + y * y + z * z);
  return lattice_vertex(mesh, x * scale, y * scale, z * scale);
}

static size_t sphere_middle(zoo_mesh *mesh, size_t a, size_t b)
{
  const float *p = mesh->positions[a < b ? a : b], *q = mesh->positions[a < b ? b : a];
  return sphere_vertex(mesh, p[0] + (double)q[0], p[1] + (double)q[1], p[2] + (double)q[2]);
}

zoo_mesh zoo_sphere(int subdivisions)
{
  static const uint8_t icosahedron[20][3] = {{0, 1, 2},  {0, 2, 3},  {0, 3, 4},  {0, 4, 5},   {0, 5, 1},
                                             {1, 6, 2},  {2, 7, 3},  {3, 8, 4},  {4, 9, 5},   {5, 10, 1},
                                             {6, 7, 2},  {7, 8, 3},  {8, 9, 4},  {9, 10, 5},  {10, 6, 1},
                                             {6, 11, 7}, {7, 11, 8}, {8, 11, 9}, {9, 11, 10}, {10, 11, 6}};
  size_t count = 20;
  zoo_mesh mesh = allocate(12, count);
  put_vertex(&mesh, 0, 0, 0, 1);
  put_vertex(&mesh, 11, 0, 0, -1);
  for (size_t i = 0; i < 5; ++i) {
    double const angle = 2 * M_PI * (double)i / 5, z = 1 / sqrt(5), r = 2 / sqrt(5);
    put_vertex(&mesh, 1 + i, r * cos(angle), r * sin(angle), z);
    put_vertex(&mesh, 6 + i, r * cos(angle + M_PI / 5), r * sin(angle + M_PI / 5), -z);
  }
  for (size_t i = 0; i < count; ++i) {
    put_triangle(&mesh, i, icosahedron[i][0], icosahedron[i][1], icosahedron[i][2]);
  }
  for (int level = 0; level < subdivisions; ++level) {
    zoo_mesh fine = allocate(2 + 2 * count, 4 * count); /* V = 2 + F / 2, and F quadruples */
    memcpy(fine.positions, mesh.positions, mesh.vertex_count * sizeof *mesh.positions);
    fine.vertex_count = mesh.vertex_count;
    for (size_t i = 0; i < count; ++i) {
      size_t const a = mesh.triangles[i][0], b = mesh.triangles[i][1], c = mesh.triangles[i][2];
      size_t const ab = sphere_middle(&fine, a, b), bc = sphere_middle(&fine, b, c), ca = sphere_middle(&fine, c, a);
      put_triangle(&fine, 4 * i, a, ab, ca);
      put_triangle(&fine, 4 * i + 1, b, bc, ab);
      put_triangle(&fine, 4 * i + 2, c, ca, bc);
      put_triangle(&fine, 4 * i + 3, ab, bc, ca);
    }
    zoo_free(&mesh);
    mesh = fine;
    count *= 4;
  }
  mesh.name = "sphere";
  mesh.euler_characteristic = 2;
  return mesh;
}

/* --------------------------------------------------------------------------------------------------------- specimens
 */

static zoo_mesh from_arrays(const char *name, const float (*positions)[3], size_t vertex_count,
                            const uint32_t (*triangles)[3], size_t triangle_count)
{
  zoo_mesh mesh = allocate(vertex_count, triangle_count);
  memcpy(mesh.positions, positions, vertex_count * sizeof *positions);
  memcpy(mesh.triangles, triangles, triangle_count * sizeof *triangles);
  mesh.name = name;
  return mesh;
}

#define FROM_ARRAYS(name, positions, triangles)                                                                        \
  from_arrays(name, positions, sizeof(positions) / sizeof *(positions), triangles,                                     \
              sizeof(triangles) / sizeof *(triangles))

static zoo_mesh renamed(zoo_mesh mesh, const char *name)
{
  mesh.name = name;
  return mesh;
}

static zoo_mesh scaled(zoo_mesh mesh, const char *name, float scale)
{
  for (size_t i = 0; i < mesh.vertex_count; ++i) {
    for (int k = 0; k < 3; ++k) {
      mesh.positions[i][k] *= scale;
    }
  }
  return renamed(mesh, name);
}

static zoo_mesh tetrahedron(void)
{
  static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  static const uint32_t triangles[][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  zoo_mesh mesh = FROM_ARRAYS("tetrahedron", positions, triangles);
  mesh.euler_characteristic = 2;
  return mesh;
}

static zoo_mesh single_triangle(void)
{
  static const float positions[][3] = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}};
  static const uint32_t triangles[][3] = {{0, 1, 2}};
  zoo_mesh mesh = FROM_ARRAYS("triangle", positions, triangles);
  mesh.boundary_edges = 3;
  mesh.euler_characteristic = 1;
  return mesh;
}

/* A 4 x 4 grid without its four middle cells: the vertex in the middle would be loose, and goes. */
static zoo_mesh grid_with_hole(void)
{
  zoo_mesh mesh = zoo_grid(4, 4, 4, 4);
  size_t kept = 0;
  for (size_t i = 0; i < mesh.triangle_count; ++i) {
    const uint32_t *t = mesh.triangles[i];
    if (t[0] != 12 && t[1] != 12 && t[2] != 12) {
      put_triangle(&mesh, kept++, t[0] - (t[0] > 12), t[1] - (t[1] > 12), t[2] - (t[2] > 12));
    }
  }
  memmove(mesh.positions + 12, mesh.positions + 13, 12 * sizeof *mesh.positions);
  mesh.vertex_count = 24;
  mesh.triangle_count = kept; /* the six triangles at the middle are gone: the hole is a hexagon */
  mesh.boundary_edges = 16 + 6;
  mesh.euler_characteristic = 0;
  return renamed(mesh, "grid with hole");
}

/* A bar whose cross section is stretched to one part in ten thousand: slivers, but no degenerate ones. */
static zoo_mesh slivers(void)
{
  zoo_mesh mesh = zoo_grid(4, 4, 1, 1e-4F);
  return renamed(mesh, "slivers");
}

static zoo_mesh moebius(void)
{
  enum { STEPS = 12 };
  zoo_mesh mesh = allocate(2 * STEPS, 2 * STEPS);
  for (size_t i = 0; i < STEPS; ++i) {
    double const u = 2 * M_PI * (double)i / STEPS;
    for (size_t side = 0; side < 2; ++side) {
      double const v = side ? 0.3 : -0.3, radius = 1 + v * cos(u / 2);
      put_vertex(&mesh, 2 * i + side, radius * cos(u), radius * sin(u), v * sin(u / 2));
    }
    size_t const next = (i + 1) % STEPS, twist = i + 1 == STEPS;
    put_quad(&mesh, 2 * i, 2 * i, 2 * next + twist, 2 * next + !twist, 2 * i + 1);
  }
  /* One-sided: there is one rung across which two triangles disagree, whatever one does. */
  mesh.boundary_edges = 2 * STEPS;
  mesh.non_manifold_edges = 1;
  mesh.sound = false;
  return renamed(mesh, "moebius strip");
}

static zoo_mesh bow_tie(void)
{
  static const float positions[][3] = {{0, 0, 0}, {-1, -1, 0}, {-1, 1, 0}, {1, 1, 0}, {1, -1, 0}};
  static const uint32_t triangles[][3] = {{0, 2, 1}, {0, 4, 3}};
  zoo_mesh mesh = FROM_ARRAYS("bow-tie", positions, triangles);
  mesh.boundary_edges = 6; /* every edge is in order; a vertex of two fans is no flaw for a sum over triangles */
  mesh.euler_characteristic = 1;
  return mesh;
}

/* Two closed tetrahedra that share a vertex: OpenMesh refuses the second one's faces there. */
static zoo_mesh kissing_tetrahedra(void)
{
  static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  static const uint32_t triangles[][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3},
                                          {0, 4, 5}, {0, 6, 4}, {4, 6, 5}, {5, 6, 0}};
  zoo_mesh mesh = FROM_ARRAYS("kissing tetrahedra", positions, triangles);
  mesh.euler_characteristic = 3;
  return mesh;
}

static zoo_mesh three_faces_on_an_edge(void)
{
  static const float positions[][3] = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
  static const uint32_t triangles[][3] = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  zoo_mesh mesh = FROM_ARRAYS("three faces on an edge", positions, triangles);
  mesh.boundary_edges = 6;
  mesh.non_manifold_edges = 1;
  mesh.euler_characteristic = 1;
  mesh.sound = false;
  return mesh;
}

static zoo_mesh flipped_face(void)
{
  zoo_mesh mesh = tetrahedron();
  put_triangle(&mesh, 3, 0, 2, 3);
  mesh.non_manifold_edges = 3; /* all its edges now run the same way as their other face's */
  mesh.sound = false;
  return renamed(mesh, "flipped face");
}

static zoo_mesh doubled_face(void)
{
  static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  static const uint32_t triangles[][3] = {{0, 1, 2}, {0, 2, 3}, {0, 1, 2}};
  zoo_mesh mesh = FROM_ARRAYS("doubled face", positions, triangles);
  mesh.boundary_edges = 2;
  mesh.non_manifold_edges = 3; /* two disagree in orientation, the diagonal has three */
  mesh.euler_characteristic = 2;
  mesh.sound = false;
  return mesh;
}

static zoo_mesh loose_vertices(void)
{
  static const float positions[][3] = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}};
  static const uint32_t triangles[][3] = {{1, 2, 3}};
  zoo_mesh mesh = FROM_ARRAYS("loose vertices", positions, triangles);
  mesh.boundary_edges = 3;
  mesh.loose_vertices = 2;
  mesh.components = 3;
  mesh.euler_characteristic = 1;
  mesh.sound = false;
  return mesh;
}

static zoo_mesh zero_area(void)
{
  static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3F, 0, 0}, {0, 0, 0}};
  static const uint32_t triangles[][3] = {{0, 1, 2}, {1, 0, 3}, {0, 2, 4}}; /* collinear; two corners coincide */
  zoo_mesh mesh = FROM_ARRAYS("zero area", positions, triangles);
  mesh.boundary_edges = 5;
  mesh.degenerate_faces = 2;
  mesh.euler_characteristic = 1;
  mesh.sound = false;
  return mesh;
}

/* A triangle all of whose corners are one point. */
static zoo_mesh point_face(void)
{
  static const float positions[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 0, 0}};
  static const uint32_t triangles[][3] = {{0, 1, 2}, {1, 3, 4}};
  zoo_mesh mesh = FROM_ARRAYS("point face", positions, triangles);
  mesh.boundary_edges = 6;
  mesh.degenerate_faces = 1;
  mesh.euler_characteristic = 1;
  mesh.sound = false;
  return mesh;
}

static zoo_mesh two_components(void)
{
  zoo_mesh sphere = zoo_sphere(0);
  zoo_mesh mesh = allocate(2 * sphere.vertex_count, 2 * sphere.triangle_count);
  for (size_t i = 0; i < mesh.vertex_count; ++i) {
    const float *p = sphere.positions[i / 2]; /* interleaved, so that no part is a range of vertices */
    put_vertex(&mesh, i, p[0] + 4.0 * (double)(i % 2), p[1], p[2]);
  }
  for (size_t i = 0; i < mesh.triangle_count; ++i) {
    const uint32_t *t = sphere.triangles[i / 2];
    put_triangle(&mesh, i, 2 * t[0] + i % 2, 2 * t[1] + i % 2, 2 * t[2] + i % 2);
  }
  zoo_free(&sphere);
  mesh.components = 2;
  mesh.euler_characteristic = 4;
  return renamed(mesh, "two components");
}

/* ------------------------------------------------------------------------------------------------------------ doors */

enum { SPECIMENS = 22 };

const zoo_mesh *zoo(size_t *count)
{
  static zoo_mesh specimens[SPECIMENS];
  if (!specimens[0].name) {
    size_t n = 0;
    specimens[n++] = tetrahedron();
    specimens[n++] = single_triangle();
    specimens[n++] = zoo_grid(5, 3, 5, 3);
    specimens[n++] = grid_with_hole();
    specimens[n++] = renamed(zoo_bar(1, 1), "cube");
    specimens[n++] = zoo_bar(8, 2);
    specimens[n++] = zoo_sphere(2);
    specimens[n++] = zoo_torus(16, 8, 3, 1);
    specimens[n++] = slivers();
    specimens[n++] = bow_tie();
    specimens[n++] = kissing_tetrahedra();
    specimens[n++] = two_components();
    specimens[n++] = scaled(zoo_sphere(1), "huge sphere", 1e15F);
    specimens[n++] = scaled(zoo_sphere(1), "tiny sphere", 1e-15F);
    specimens[n++] = moebius();
    specimens[n++] = three_faces_on_an_edge();
    specimens[n++] = flipped_face();
    specimens[n++] = doubled_face();
    specimens[n++] = loose_vertices();
    specimens[n++] = zero_area();
    specimens[n++] = point_face();
    specimens[n++] = scaled(zero_area(), "tiny zero area", 1e-15F);
  }
  *count = SPECIMENS;
  return specimens;
}

const zoo_mesh *zoo_find(const char *name)
{
  size_t count;
  const zoo_mesh *all = zoo(&count);
  for (size_t i = 0; i < count; ++i) {
    if (strcmp(all[i].name, name) == 0) {
      return &all[i];
    }
  }
  printf("  the zoo has no \"%s\"\n", name);
  exit(1);
}

exm_mesh *zoo_create(const zoo_mesh *mesh)
{
  exm_mesh *made = NULL;
  exm_status const status =
      exm_mesh_create(mesh->positions[0], mesh->vertex_count, mesh->triangles[0], mesh->triangle_count, &made);
  if (status < 0) {
    test_fail(__FILE__, __LINE__, "%s: %s", mesh->name, exm_last_error());
  }
  return made;
}
