/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/openmesh_shim.h"

#include <OpenMesh/Core/IO/reader/PLYReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{

/* OpenMesh reports trouble on standard error; we report it as a status. */
void silence_openmesh()
{
  static std::once_flag once;
  std::call_once(once, [] {
    omlog().disable();
    omout().disable();
    omerr().disable();
  });
}

/* Run `body` and turn whatever it throws into a status: nothing may unwind into C. */
template <typename Body> exm_status guarded(const char *what, Body body) noexcept
{
  try {
    silence_openmesh();
    return body();
  } catch (const std::bad_alloc &) {
    return status_no_memory(what);
  } catch (const std::exception &error) {
    return status_set(EXM_ERROR_INTERNAL, "OpenMesh failed with %s: %s", what, error.what());
  } catch (...) {
    return status_set(EXM_ERROR_INTERNAL, "OpenMesh failed with %s", what);
  }
}

/* ---------------------------------------------------------------------------------------------------------- parsing */

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

struct parse_error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/* Takes what OpenMesh's readers find as plain lists. Its own importer would build a mesh at once, and copy the vertices
 * of every non-manifold face: the vertices would no longer be the file's. */
class list_importer final : public OpenMesh::IO::BaseImporter
{
public:
  explicit list_importer(size_t file_size) : limit(file_size)
  {
  }

  std::vector<OpenMesh::Vec3f> positions;
  std::vector<uint32_t> corners;
  size_t faces = 0;
  size_t declared_vertices = 0, declared_faces = 0; /* 0 where the format has no counts */

  VertexHandle add_vertex(const OpenMesh::Vec3f &point) override
  {
    VertexHandle const vertex = add_vertex();
    set_point(vertex, point);
    return vertex;
  }

  VertexHandle add_vertex() override
  {
    check_growth(positions.size());
    positions.emplace_back(0.0F, 0.0F, 0.0F);
    return VertexHandle(static_cast<int>(positions.size() - 1));
  }

  void set_point(VertexHandle vertex, const OpenMesh::Vec3f &point) override
  {
    for (size_t axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(point[axis])) {
        throw parse_error("vertex " + std::to_string(vertex.idx()) + " has a coordinate that is not finite");
      }
    }
    positions[static_cast<size_t>(vertex.idx())] = point;
  }

  FaceHandle add_face(const VHandles &polygon) override
  {
    check_growth(faces);
    std::vector<uint32_t> ring;
    for (VertexHandle const vertex : polygon) {
      if (!vertex.is_valid() || static_cast<size_t>(vertex.idx()) >= positions.size()) {
        throw parse_error("face " + std::to_string(faces) + " has corner " + std::to_string(vertex.idx()) +
                          ", but there are " + std::to_string(positions.size()) + " vertices");
      }
      uint32_t const index = static_cast<uint32_t>(vertex.idx());
      if (std::find(ring.begin(), ring.end(), index) == ring.end()) {
        ring.push_back(index);
      }
    }
    for (size_t i = 2; i < ring.size(); ++i) {
      corners.insert(corners.end(), {ring[0], ring[i - 1], ring[i]});
    }
    return FaceHandle(static_cast<int>(faces++));
  }

  /* The counts of a header. A file cannot hold more elements than bytes, whatever it says. */
  void reserve(unsigned int vertices, unsigned int, unsigned int polygons) override
  {
    if (vertices > limit || polygons > limit) {
      throw parse_error("the header counts " + std::to_string(vertices) + " vertices and " + std::to_string(polygons) +
                        " faces, more than the file has bytes");
    }
    declared_vertices = vertices;
    declared_faces = polygons;
  }

  size_t n_vertices() const override
  {
    return positions.size();
  }
  size_t n_faces() const override
  {
    return faces;
  }
  size_t n_edges() const override
  {
    return 0;
  }

  /* Everything else that a file may say is of no interest here. */
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override
  {
    return HalfedgeHandle();
  }
  FaceHandle add_face(HalfedgeHandle) override
  {
    return FaceHandle();
  }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f> &) override
  {
  }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f> &) override
  {
  }
  void set_face_texindex(FaceHandle, int) override
  {
  }
  void set_halfedge(VertexHandle, HalfedgeHandle) override
  {
  }
  void set_normal(VertexHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_normal(VertexHandle, const OpenMesh::Vec3d &) override
  {
  }
  void set_normal(FaceHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_normal(FaceHandle, const OpenMesh::Vec3d &) override
  {
  }
  void set_color(VertexHandle, const OpenMesh::Vec3uc &) override
  {
  }
  void set_color(VertexHandle, const OpenMesh::Vec4uc &) override
  {
  }
  void set_color(VertexHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_color(VertexHandle, const OpenMesh::Vec4f &) override
  {
  }
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3uc &) override
  {
  }
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4uc &) override
  {
  }
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4f &) override
  {
  }
  void set_color(FaceHandle, const OpenMesh::Vec3uc &) override
  {
  }
  void set_color(FaceHandle, const OpenMesh::Vec4uc &) override
  {
  }
  void set_color(FaceHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_color(FaceHandle, const OpenMesh::Vec4f &) override
  {
  }
  void set_texcoord(VertexHandle, const OpenMesh::Vec2f &) override
  {
  }
  void set_texcoord(VertexHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f &) override
  {
  }
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f &) override
  {
  }
  void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo &) override
  {
  }
  void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo &) override
  {
  }
  void set_status(OpenMesh::EdgeHandle, const OpenMesh::Attributes::StatusInfo &) override
  {
  }
  void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo &) override
  {
  }
  void set_next(HalfedgeHandle, HalfedgeHandle) override
  {
  }
  void set_face(HalfedgeHandle, FaceHandle) override
  {
  }
  void request_face_texcoords2D() override
  {
  }
  void add_texture_information(int, std::string) override
  {
  }

private:
  size_t limit;

  /* Readers go on counting after the file has ended; this is what stops them. */
  void check_growth(size_t count) const
  {
    if (count >= limit) {
      throw parse_error("it ends too early");
    }
  }
};

/* Readers are shared by the process and keep what they have read of the current file in themselves. */
std::mutex &reader_mutex()
{
  static std::mutex mutex;
  return mutex;
}

bool run_reader(const mesh_file &file, std::istream &stream, list_importer &importer)
{
  OpenMesh::IO::Options options;
  /* Where a number is missing or garbled, or memory runs out, throw at once; the readers themselves do not look. */
  stream.exceptions(std::ios::failbit | std::ios::badbit);
  if (file.format == MESH_FORMAT_PLY) {
    return OpenMesh::IO::PLYReader().read(stream, importer, options);
  }
  options += OpenMesh::IO::Options::Binary;
  return OpenMesh::IO::STLReader().read(stream, importer, options);
}

/* Readers stop without a word where a file ends. */
void check_counts(const list_importer &importer)
{
  size_t const vertices = importer.declared_vertices, faces = importer.declared_faces; /* 0 in STL, which has none */
  if ((vertices != 0 && importer.positions.size() != vertices) || (faces != 0 && importer.faces != faces)) {
    throw parse_error("it ends too early");
  }
}

exm_status hand_out(const list_importer &importer, arena *memory, shim_surface *out)
{
  shim_surface surface = {};
  surface.vertex_count = importer.positions.size();
  surface.triangle_count = importer.corners.size() / 3;
  surface.positions = static_cast<float(*)[3]>(arena_array(memory, surface.vertex_count, sizeof *surface.positions));
  surface.triangles =
      static_cast<uint32_t(*)[3]>(arena_array(memory, surface.triangle_count, sizeof *surface.triangles));
  if (!surface.positions || !surface.triangles) {
    return status_no_memory("the mesh of a file");
  }
  for (size_t i = 0; i < surface.vertex_count; ++i) {
    std::copy_n(importer.positions[i].data(), 3, surface.positions[i]);
  }
  for (size_t i = 0; i < importer.corners.size(); ++i) {
    surface.triangles[i / 3][i % 3] = importer.corners[i];
  }
  *out = surface;
  return EXM_OK;
}

/* ---------------------------------------------------------------------------------------------------------- topology
 */

struct no_attributes : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::None);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  EdgeAttributes(OpenMesh::Attributes::None);
  FaceAttributes(OpenMesh::Attributes::None);
};
using tri_mesh = OpenMesh::TriMesh_ArrayKernelT<no_attributes>;

/* Only the connectivity is asked of it, so its points stay where they are. */
std::vector<uint32_t> build(tri_mesh &mesh, const uint32_t (*triangles)[3], size_t triangle_count, size_t vertex_count)
{
  std::vector<uint32_t> rejected;
  mesh.reserve(vertex_count, vertex_count + triangle_count, triangle_count); /* V - E + F = 2 - ... */
  for (size_t i = 0; i < vertex_count; ++i) {
    mesh.add_vertex(tri_mesh::Point(0, 0, 0));
  }
  for (size_t i = 0; i < triangle_count; ++i) {
    VertexHandle const a(static_cast<int>(triangles[i][0])), b(static_cast<int>(triangles[i][1])),
        c(static_cast<int>(triangles[i][2]));
    if (!mesh.add_face(a, b, c).is_valid()) {
      rejected.push_back(static_cast<uint32_t>(i));
    }
  }
  return rejected;
}

shim_edge describe(const tri_mesh &mesh, OpenMesh::EdgeHandle edge)
{
  HalfedgeHandle const one = mesh.halfedge_handle(edge, 0), other = mesh.halfedge_handle(edge, 1);
  auto const from = static_cast<uint32_t>(mesh.from_vertex_handle(one).idx());
  auto const to = static_cast<uint32_t>(mesh.to_vertex_handle(one).idx());
  uint32_t const along = mesh.is_boundary(one) ? 0 : 1, against = mesh.is_boundary(other) ? 0 : 1;
  return from < to ? shim_edge{from, to, along, against} : shim_edge{to, from, against, along};
}

} // namespace

exm_status openmesh_parse(const mesh_file *file, arena *memory, shim_surface *out)
{
  return guarded(file->path, [&] {
    list_importer importer(file->size);
    try {
      std::istringstream stream(std::string(file->bytes, file->size));
      std::lock_guard<std::mutex> const lock(reader_mutex());
      if (!run_reader(*file, stream, importer)) {
        return status_set(EXM_ERROR_IO, "%s could not be understood", file->path);
      }
      check_counts(importer);
    } catch (const parse_error &error) {
      return status_set(EXM_ERROR_IO, "%s: %s", file->path, error.what());
    } catch (const std::ios_base::failure &) {
      return status_set(EXM_ERROR_IO, "%s: after vertex %zu and face %zu it ends too early or holds what is no number",
                        file->path, importer.positions.size(), importer.faces);
    }
    return hand_out(importer, memory, out);
  });
}

exm_status openmesh_topology(const uint32_t (*triangles)[3], size_t triangle_count, size_t vertex_count, arena *memory,
                             shim_topology *out)
{
  return guarded("the topology of a mesh", [&] {
    tri_mesh mesh;
    std::vector<uint32_t> const rejected = build(mesh, triangles, triangle_count, vertex_count);
    shim_topology topology = {};
    topology.edge_count = mesh.n_edges();
    topology.rejected_count = rejected.size();
    topology.edges = static_cast<shim_edge *>(arena_array(memory, topology.edge_count, sizeof(shim_edge)));
    topology.rejected = static_cast<uint32_t *>(arena_array(memory, topology.rejected_count, sizeof(uint32_t)));
    if (!topology.edges || !topology.rejected) {
      return status_no_memory("the edges of a mesh");
    }
    std::copy(rejected.begin(), rejected.end(), topology.rejected);
    for (size_t i = 0; i < topology.edge_count; ++i) {
      topology.edges[i] = describe(mesh, OpenMesh::EdgeHandle(static_cast<int>(i)));
    }
    *out = topology;
    return exm_status(EXM_OK);
  });
}
