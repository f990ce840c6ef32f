/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Binary PLY in memory: what OBJ and OFF are turned into, OpenMesh's reader of it being strict. */
#ifndef EXM_MESH_PLY_WRITER_H
#define EXM_MESH_PLY_WRITER_H

#include "mesh/mesh_file.h"

typedef struct ply_writer {
  size_t vertex_count, face_count;
  size_t vertices_written, faces_written;
  char *bytes, *vertices, *faces; /* PLY has all vertices first, OBJ need not: each kind has its own cursor */
  char *face;                     /* the one being written */
} ply_writer;

/** Room for the elements of `file`, however many corners they have. */
exm_status ply_writer_begin(ply_writer *writer, const mesh_file *file, size_t vertex_count, size_t face_count,
                            arena *memory);

void ply_writer_vertex(ply_writer *writer, const float position[3]);
void ply_writer_begin_face(ply_writer *writer);
void ply_writer_corner(ply_writer *writer, int32_t vertex);

/** Returns how many corners the face has. */
int32_t ply_writer_end_face(ply_writer *writer);

/** Put what was written in the place of the file. All vertices and faces have been written. */
void ply_writer_end(const ply_writer *writer, mesh_file *file);

#endif
