/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Mesh files in memory, checked for what OpenMesh 9 would not survive or would silently misread. OpenMesh does the
 * parsing; see mesh_file.c for what it has to be shielded from. */
#ifndef EXM_MESH_MESH_FILE_H
#define EXM_MESH_MESH_FILE_H

#include "base/memory.h"
#include "base/status.h"

typedef enum mesh_format {
  MESH_FORMAT_OBJ,
  MESH_FORMAT_OFF,
  MESH_FORMAT_PLY,
  MESH_FORMAT_STL_TEXT,
  MESH_FORMAT_STL_BINARY
} mesh_format;

typedef struct mesh_file {
  const char *path;
  mesh_format format;
  size_t size;
  char *bytes;         /* [size], ends with a newline that the file need not have */
  size_t vertex_lines; /* OBJ: how many vertices the parser has to come back with */
} mesh_file;

/** Read `path` into `memory` and check it. EXM_ERROR_IO names the file, and the line where there is one. */
exm_status mesh_file_load(const char *path, arena *memory, mesh_file *out);

#endif
