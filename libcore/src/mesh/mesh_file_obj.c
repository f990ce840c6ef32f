/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Wavefront OBJ, of which "v" and "f" are read, to binary PLY. */
#include "mesh/ply_writer.h"

typedef enum obj_line { OBJ_OTHER, OBJ_VERTEX, OBJ_FACE } obj_line;

/* What a line is; the cursor is left behind its keyword. */
static obj_line classify(const text_line *line, char **cursor)
{
  *cursor = line->begin;
  text_word const keyword = text_next_word(cursor, line->end);
  if (text_is(keyword, "v")) {
    return OBJ_VERTEX;
  }
  return text_is(keyword, "f") ? OBJ_FACE : OBJ_OTHER;
}

static void count(const mesh_file *file, size_t *vertices, size_t *faces)
{
  text_line line = {0};
  char *cursor;
  *vertices = *faces = 0;
  while (text_next_line(file->bytes, file->size, &line)) {
    text_strip_comment(&line);
    obj_line const kind = classify(&line, &cursor);
    *vertices += kind == OBJ_VERTEX;
    *faces += kind == OBJ_FACE;
  }
}

/* "7", "7/1", "7//2", "-3/1/2": the number of a vertex, from 1, or from the last one so far backwards. */
static exm_status transcribe_corner(const mesh_file *file, const text_line *line, text_word word, ply_writer *writer)
{
  long long number;
  const char *rest;
  if (!text_integer(word.begin, word.end, &number, &rest) || (rest < word.end && *rest != '/')) {
    return mesh_file_bad_line(file, line, "a face of vertex numbers");
  }
  long long const index = number < 0 ? (long long)writer->vertices_written + number : number - 1;
  if (index < 0 || index >= (long long)writer->vertex_count) {
    return status_set(EXM_ERROR_IO, "%s, line %zu: there is no vertex %lld, there are %zu", file->path, line->number,
                      number, writer->vertex_count);
  }
  ply_writer_corner(writer, (int32_t)index);
  return EXM_OK;
}

static exm_status transcribe_line(const mesh_file *file, const text_line *line, ply_writer *writer)
{
  char *cursor;
  float position[3];
  switch (classify(line, &cursor)) {
  case OBJ_VERTEX:
    if (!text_floats(&cursor, line->end, position)) {
      return mesh_file_bad_line(file, line, "a vertex with three finite coordinates");
    }
    ply_writer_vertex(writer, position);
    return EXM_OK;
  case OBJ_FACE:
    ply_writer_begin_face(writer);
    for (text_word word; !text_is_empty(word = text_next_word(&cursor, line->end));) {
      TRY(transcribe_corner(file, line, word, writer));
    }
    return ply_writer_end_face(writer) >= 3 ? EXM_OK
                                            : mesh_file_bad_line(file, line, "a face of three or more vertex numbers");
  case OBJ_OTHER:
    return EXM_OK;
  }
  return EXM_OK;
}

exm_status mesh_file_prepare_obj(mesh_file *file, arena *memory)
{
  size_t vertices, faces;
  ply_writer writer;
  count(file, &vertices, &faces);
  TRY(ply_writer_begin(&writer, file, vertices, faces, memory));
  text_line line = {0};
  while (text_next_line(file->bytes, file->size, &line)) {
    TRY(transcribe_line(file, &line, &writer));
  }
  ply_writer_end(&writer, file);
  return EXM_OK;
}
