// SPDX-License-Identifier: GPL-3.0-or-later
// As-rigid-as-possible deformation by CGAL's Surface_mesh_deformation, on the whole mesh.
//
//   cgal_arap FILE   positions f64 [V][3], triangles u32 [F][3], for each handle vertex its handle and its vertex
//   (u32),
//                    displacements of handles f64 [frames][H][3]; each array after an int64 count of its numbers
//
// "bind" answers the seconds from nothing to the end of preprocess(), "iterate" those of one iteration on the next
// frame, from where the last one ended. "solve ITERATIONS TOLERANCE FILE" answers those of a solve for the first frame
// from the reference, and writes the positions, f64 [V][3], to FILE.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_deformation.h>
#include <memory>
#include <sstream>
#include <string>

#include "worker.hpp"

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Vertex = Mesh::Vertex_index;
using Deformation = CGAL::Surface_mesh_deformation<Mesh, CGAL::Default, CGAL::Default, CGAL::ORIGINAL_ARAP>;

struct Input {
  std::vector<double> positions;
  std::vector<std::uint32_t> triangles, handles, vertices;
  std::vector<double> displacements;
};

static Input read_input(const char *path)
{
  std::ifstream file(path, std::ios::binary);
  Input input;
  input.positions = worker::read<double>(file);
  input.triangles = worker::read<std::uint32_t>(file);
  input.handles = worker::read<std::uint32_t>(file);
  input.vertices = worker::read<std::uint32_t>(file);
  input.displacements = worker::read<double>(file);
  return input;
}

static Kernel::Point_3 point_of(const Input &input, std::uint32_t vertex)
{
  const double *p = input.positions.data() + 3 * vertex;
  return {p[0], p[1], p[2]};
}

static Mesh mesh_of(const Input &input)
{
  Mesh mesh;
  for (std::uint32_t v = 0; v < input.positions.size() / 3; v++) {
    mesh.add_vertex(point_of(input, v));
  }
  for (std::size_t f = 0; f < input.triangles.size(); f += 3) {
    const std::uint32_t *t = input.triangles.data() + f;
    if (mesh.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2])) == Mesh::null_face()) {
      throw std::runtime_error("Surface_mesh refuses a face of this mesh");
    }
  }
  return mesh;
}

static std::unique_ptr<Deformation> bind(const Input &input, Mesh &mesh)
{
  auto deformation = std::make_unique<Deformation>(mesh);
  deformation->insert_roi_vertices(vertices(mesh).begin(), vertices(mesh).end());
  for (std::uint32_t v : input.vertices) {
    deformation->insert_control_vertex(Vertex(v));
  }
  if (!deformation->preprocess()) {
    throw std::runtime_error("preprocess() failed");
  }
  return deformation;
}

static void set_targets(const Input &input, std::size_t frame, Deformation &deformation)
{
  std::size_t const handle_count = input.handles.back() + 1;
  const double *moved = input.displacements.data() + frame * handle_count * 3;
  for (std::size_t i = 0; i < input.vertices.size(); i++) {
    const double *by = moved + 3 * input.handles[i];
    deformation.set_target_position(Vertex(input.vertices[i]),
                                    point_of(input, input.vertices[i]) + Kernel::Vector_3(by[0], by[1], by[2]));
  }
}

static double solve(const Input &input, const Mesh &mesh, Deformation &deformation, const std::string &words)
{
  std::istringstream arguments(words);
  unsigned iterations = 0;
  double tolerance = 0;
  std::string path;
  arguments >> iterations >> tolerance >> path;
  deformation.reset();
  set_targets(input, 0, deformation);
  double const start = worker::now();
  deformation.deform(iterations, tolerance);
  double const seconds = worker::now() - start;
  std::ofstream file(path, std::ios::binary);
  for (Vertex v : mesh.vertices()) {
    Kernel::Point_3 const point = mesh.point(v);
    double const coordinates[3] = {point.x(), point.y(), point.z()};
    file.write(reinterpret_cast<const char *>(coordinates), sizeof coordinates);
  }
  return seconds;
}

int main(int argc, char **argv)
try {
  if (argc != 2) {
    throw std::runtime_error("usage: cgal_arap FILE");
  }
  Input const input = read_input(argv[1]);
  Mesh mesh = mesh_of(input);
  auto deformation = bind(input, mesh);
  std::size_t const frames = input.displacements.size() / (3 * (input.handles.back() + 1));
  std::size_t frame = 0;
  worker::ready();
  for (std::string command; std::getline(std::cin, command);) {
    if (command == "bind") {
      Mesh copy = mesh_of(input);
      double const start = worker::now();
      auto const other = bind(input, copy);
      worker::answer(worker::now() - start);
      continue;
    }
    if (command.rfind("solve ", 0) == 0) {
      worker::answer(solve(input, mesh, *deformation, command.substr(6)));
      continue;
    }
    set_targets(input, frame++ % frames, *deformation);
    double const start = worker::now();
    deformation->deform(1, 0);
    worker::answer(worker::now() - start);
  }
} catch (const std::exception &error) {
  std::cerr << error.what() << '\n';
  return 1;
}
