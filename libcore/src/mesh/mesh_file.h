/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Mesh files in memory, made fit for OpenMesh.
 *
 * The readers of OpenMesh 9 trust their input, and its line-based ones pass over in silence what they cannot read, a
 * failed allocation included: a mesh would come back with a vertex missing, or with another one's coordinates. So
 *
 *   OBJ  is written anew as binary PLY: "v nan 0 0" would be dropped, which renumbers all that follow, "f /1 /2 /3"
 *        aborts the process, and "mtllib" opens other files.
 *   OFF  likewise: a face's colour would be taken for the next face.
 *   STL  in text form is written anew as binary STL: a missing number would be the last one again. In binary form a
 *        coordinate that is not a number would be welded to any vertex.
 *   PLY  has its header checked: properties before the first element are written to an empty list, a header without an
 *        end is read for ever, types out of place are complained about on standard error.
 *
 * Truncation and garbage in the numbers of PLY fail the strict stream that the shim reads from. */
#ifndef EXM_MESH_MESH_FILE_H
#define EXM_MESH_MESH_FILE_H

#include "base/memory.h"
#include "base/status.h"
#include "mesh/text.h"

typedef enum mesh_format { MESH_FORMAT_PLY, MESH_FORMAT_STL } mesh_format;

typedef struct mesh_file {
  const char *path;
  mesh_format format; /* of the bytes, which need not be the file's */
  size_t size;
  char *bytes; /* [size]; room for one more, so that the last line can be given a newline */
} mesh_file;

/** Read `path` into `memory`, and prepare it. EXM_ERROR_IO names the file, and the line where there is one. */
exm_status mesh_file_load(const char *path, arena *memory, mesh_file *out);

/* One a format: check the bytes, rewrite them where needed. */
exm_status mesh_file_prepare_obj(mesh_file *file, arena *memory);
exm_status mesh_file_prepare_off(mesh_file *file, arena *memory);
exm_status mesh_file_prepare_ply(mesh_file *file);
exm_status mesh_file_prepare_stl(mesh_file *file, arena *memory);

/** EXM_ERROR_IO: "<path>, line <n>: "<the line>" is not <expected>". */
exm_status mesh_file_bad_line(const mesh_file *file, const text_line *line, const char *expected);

#endif
