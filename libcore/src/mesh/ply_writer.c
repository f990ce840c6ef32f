/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/ply_writer.h"

#include <stdio.h>
#include <string.h>

enum { HEADER = 512 };

static const char *byte_order(void)
{
  uint16_t const one = 1;
  char first;
  memcpy(&first, &one, 1);
  return first ? "little" : "big";
}

exm_status ply_writer_begin(ply_writer *writer, const mesh_file *file, size_t vertex_count, size_t face_count,
                            arena *memory)
{
  /* Elements and corners each took at least two bytes of text, but for the last. */
  size_t const most = file->size / 2 + 1;
  if (vertex_count > most || face_count > most || most > INT32_MAX) {
    return status_set(EXM_ERROR_IO, "%s: it is too short for %zu vertices and %zu faces, or too long to read",
                      file->path, vertex_count, face_count);
  }
  size_t const vertex_bytes = vertex_count * 3 * sizeof(float);
  char *const bytes = ARENA_NEW(memory, char, HEADER + vertex_bytes + (face_count + most) * sizeof(int32_t));
  if (!bytes) {
    return status_no_memory(file->path);
  }
  int const length = snprintf(bytes, HEADER,
                              "ply\nformat binary_%s_endian 1.0\nelement vertex %zu\nproperty float x\n"
                              "property float y\nproperty float z\nelement face %zu\n"
                              "property list int int vertex_indices\nend_header\n",
                              byte_order(), vertex_count, face_count);
  char *const vertices = bytes + length;
  *writer = (ply_writer){.vertex_count = vertex_count,
                         .face_count = face_count,
                         .bytes = bytes,
                         .vertices = vertices,
                         .faces = vertices + vertex_bytes};
  return EXM_OK;
}

void ply_writer_vertex(ply_writer *writer, const float position[3])
{
  memcpy(writer->vertices, position, 3 * sizeof *position);
  writer->vertices += 3 * sizeof *position;
  ++writer->vertices_written;
}

void ply_writer_begin_face(ply_writer *writer)
{
  writer->face = writer->faces;
  writer->faces += sizeof(int32_t);
  ++writer->faces_written;
}

void ply_writer_corner(ply_writer *writer, int32_t vertex)
{
  memcpy(writer->faces, &vertex, sizeof vertex);
  writer->faces += sizeof vertex;
}

int32_t ply_writer_end_face(ply_writer *writer)
{
  int32_t const corners = (int32_t)((size_t)(writer->faces - writer->face) / sizeof(int32_t)) - 1;
  memcpy(writer->face, &corners, sizeof corners);
  return corners;
}

void ply_writer_end(const ply_writer *writer, mesh_file *file)
{
  file->bytes = writer->bytes;
  file->size = (size_t)(writer->faces - writer->bytes);
  file->format = MESH_FORMAT_PLY;
}
