/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/mesh_file.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>

exm_status mesh_file_bad_line(const mesh_file *file, const text_line *line, const char *expected)
{
  int const shown = (int)(line->end - line->begin > 60 ? 60 : line->end - line->begin);
  return status_set(EXM_ERROR_IO, "%s, line %zu: \"%.*s\" is not %s", file->path, line->number, shown, line->begin,
                    expected);
}

static exm_status read_bytes(FILE *stream, arena *memory, mesh_file *file)
{
  long const length = fseek(stream, 0, SEEK_END) == 0 ? ftell(stream) : -1;
  if (length < 0 || length == LONG_MAX || fseek(stream, 0, SEEK_SET) != 0) { /* LONG_MAX: a folder */
    return status_set(EXM_ERROR_IO, "%s cannot be read: it is not a regular file", file->path);
  }
  if (length == 0) {
    return status_set(EXM_ERROR_IO, "%s is empty", file->path);
  }
  file->size = (size_t)length;
  file->bytes = ARENA_NEW(memory, char, file->size + 1);
  if (!file->bytes) {
    return status_no_memory(file->path);
  }
  if (fread(file->bytes, 1, file->size, stream) != file->size) {
    return status_set(EXM_ERROR_IO, "%s cannot be read: %s", file->path, strerror(errno));
  }
  return EXM_OK;
}

static exm_status open_and_read(const char *path, arena *memory, mesh_file *file)
{
  errno = 0;
  FILE *const stream = fopen(path, "rb");
  if (!stream) {
    return errno == ENOMEM ? status_no_memory(path)
                           : status_set(EXM_ERROR_IO, "%s cannot be opened: %s", path, strerror(errno));
  }
  exm_status const status = read_bytes(stream, memory, file);
  fclose(stream);
  return status;
}

static exm_status prepare(mesh_file *file, arena *memory)
{
  char *const dot = strrchr(file->path, '.');
  text_word const extension = {dot ? dot + 1 : "", dot ? dot + strlen(dot) : ""};
  if (text_is(extension, "obj")) {
    return mesh_file_prepare_obj(file, memory);
  }
  if (text_is(extension, "off")) {
    return mesh_file_prepare_off(file, memory);
  }
  if (text_is(extension, "ply")) {
    return mesh_file_prepare_ply(file);
  }
  if (text_is(extension, "stl")) {
    return mesh_file_prepare_stl(file, memory);
  }
  return status_set(EXM_ERROR_IO, "%s: the format \".%s\" is not known; OBJ, PLY, OFF and STL are", file->path,
                    extension.begin);
}

exm_status mesh_file_load(const char *path, arena *memory, mesh_file *out)
{
  mesh_file file = {.path = path};
  TRY(open_and_read(path, memory, &file));
  TRY(prepare(&file, memory));
  *out = file;
  return EXM_OK;
}
