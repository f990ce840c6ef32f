/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OFF as text to binary PLY. What follows the coordinates of a vertex (normal, colour) and the corners of a face
 * (colour) on their lines is not read. */
#include "mesh/ply_writer.h"

/* The next line that says something. */
static bool next_content(const mesh_file *file, text_line *line)
{
  while (text_next_line(file->bytes, file->size, line)) {
    text_strip_comment(line);
    char *cursor = line->begin;
    if (!text_is_empty(text_next_word(&cursor, line->end))) {
      return true;
    }
  }
  return false;
}

static bool is_header(const text_line *line)
{
  char *cursor = line->begin;
  text_word const keyword = text_next_word(&cursor, line->end);
  return (text_is(keyword, "OFF") || text_is(keyword, "COFF") || text_is(keyword, "NOFF") ||
          text_is(keyword, "CNOFF")) &&
         text_is_empty(text_next_word(&cursor, line->end));
}

/* The next word as a whole number that is not negative. */
static bool next_count(char **cursor, const char *end, size_t *out)
{
  text_word const word = text_next_word(cursor, end);
  long long value;
  const char *rest;
  bool const is_count = text_integer(word.begin, word.end, &value, &rest) && rest == word.end && value >= 0;
  *out = is_count ? (size_t)value : 0;
  return is_count;
}

static exm_status transcribe_face(const mesh_file *file, const text_line *line, ply_writer *writer)
{
  char *cursor = line->begin;
  size_t corners, vertex;
  if (!next_count(&cursor, line->end, &corners)) {
    return mesh_file_bad_line(file, line, "a face: a count and as many vertices");
  }
  ply_writer_begin_face(writer);
  while (corners-- > 0) {
    if (!next_count(&cursor, line->end, &vertex)) {
      return mesh_file_bad_line(file, line, "a face: a count and as many vertices");
    }
    if (vertex >= writer->vertex_count) {
      return status_set(EXM_ERROR_IO, "%s, line %zu: there is no vertex %zu, there are %zu", file->path, line->number,
                        vertex, writer->vertex_count);
    }
    ply_writer_corner(writer, (int32_t)vertex);
  }
  ply_writer_end_face(writer);
  return EXM_OK;
}

static exm_status transcribe(const mesh_file *file, text_line *line, ply_writer *writer)
{
  while (writer->vertices_written < writer->vertex_count && next_content(file, line)) {
    char *cursor = line->begin;
    float position[3];
    if (!text_floats(&cursor, line->end, position)) {
      return mesh_file_bad_line(file, line, "a vertex with three finite coordinates");
    }
    ply_writer_vertex(writer, position);
  }
  while (writer->faces_written < writer->face_count && next_content(file, line)) {
    TRY(transcribe_face(file, line, writer));
  }
  if (writer->vertices_written < writer->vertex_count || writer->faces_written < writer->face_count) {
    return status_set(EXM_ERROR_IO, "%s ends after vertex %zu of %zu and face %zu of %zu", file->path,
                      writer->vertices_written, writer->vertex_count, writer->faces_written, writer->face_count);
  }
  return EXM_OK;
}

exm_status mesh_file_prepare_off(mesh_file *file, arena *memory)
{
  text_line line = {0};
  if (!next_content(file, &line) || !is_header(&line)) {
    return mesh_file_bad_line(file, &line,
                              "the header of a text OFF file: OFF, COFF, NOFF or CNOFF, alone on its line");
  }
  size_t vertices = 0, faces = 0;
  char *cursor = next_content(file, &line) ? line.begin : line.end;
  if (!next_count(&cursor, line.end, &vertices) || !next_count(&cursor, line.end, &faces)) {
    return mesh_file_bad_line(file, &line, "the counts of vertices and faces");
  }
  ply_writer writer;
  TRY(ply_writer_begin(&writer, file, vertices, faces, memory));
  TRY(transcribe(file, &line, &writer));
  ply_writer_end(&writer, file);
  return EXM_OK;
}
