/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "mesh/mesh_file.h"

typedef struct ply_header {
  bool ended, is_text;
  enum { PLY_NONE, PLY_VERTEX, PLY_FACE, PLY_OTHER } element;
  size_t properties; /* of this element, so far */
} ply_header;

static bool is_one_of(text_word word, const char *const *names)
{
  while (*names && !text_is(word, *names)) {
    ++names;
  }
  return *names != NULL;
}

static bool is_integer_type(text_word word)
{
  static const char *const names[] = {"int8",   "char",  "uint8", "uchar",  "int16", "short", "uint16",
                                      "ushort", "int32", "int",   "uint32", "uint",  NULL};
  return is_one_of(word, names);
}

static bool is_real_type(text_word word)
{
  static const char *const names[] = {"float", "float32", "double", "float64", NULL};
  return is_one_of(word, names);
}

/* The list of a face's corners has to come first, or OpenMesh forgets what came before it. */
static exm_status check_list(const mesh_file *file, const text_line *line, char *cursor, const ply_header *header)
{
  static const char *const names[] = {"vertex_index", "vertex_indices", NULL};
  static const char *const count_types[] = {"uint8", "uchar", "uint16", "int", NULL};
  text_word const count_type = text_next_word(&cursor, line->end), type = text_next_word(&cursor, line->end);
  bool const is_corners = header->element == PLY_FACE && is_one_of(text_next_word(&cursor, line->end), names);
  if (!is_one_of(count_type, count_types) || !(is_integer_type(type) || (is_real_type(type) && !is_corners))) {
    return mesh_file_bad_line(file, line, "a list of types that can be read");
  }
  if (is_corners ? header->properties > 0 : header->is_text) {
    return mesh_file_bad_line(file, line, "readable: only one list, the first of a face's properties, is");
  }
  return EXM_OK;
}

/* Coordinates are real; what else a vertex has is given a name that means nothing, so that it is skipped. */
static exm_status check_property(const mesh_file *file, const text_line *line, char *cursor, const ply_header *header)
{
  static const char *const coordinates[] = {"x", "y", "z", NULL};
  text_word const type = text_next_word(&cursor, line->end);
  if (header->element == PLY_NONE) {
    return mesh_file_bad_line(file, line, "allowed before the first element");
  }
  if (text_is(type, "list")) {
    return check_list(file, line, cursor, header);
  }
  text_word const name = text_next_word(&cursor, line->end);
  bool const is_coordinate = header->element == PLY_VERTEX && is_one_of(name, coordinates);
  if (text_is_empty(name) || !(is_real_type(type) || (is_integer_type(type) && !is_coordinate))) {
    return mesh_file_bad_line(file, line, "a property of a type that can be read");
  }
  if (header->element == PLY_VERTEX && !is_coordinate) {
    memset(name.begin, '_', (size_t)(name.end - name.begin));
  }
  return EXM_OK;
}

static exm_status check_element(const mesh_file *file, const text_line *line, char *cursor, ply_header *header)
{
  text_word const name = text_next_word(&cursor, line->end), size = text_next_word(&cursor, line->end);
  long long count;
  const char *rest;
  if (!text_integer(size.begin, size.end, &count, &rest) || rest != size.end || count < 0 ||
      (size_t)count > file->size) { /* OpenMesh would count up to it */
    return mesh_file_bad_line(file, line, "an element with a count that the file has room for");
  }
  header->element = text_is(name, "vertex") ? PLY_VERTEX : text_is(name, "face") ? PLY_FACE : PLY_OTHER;
  header->properties = 0;
  return EXM_OK;
}

static exm_status check_line(const mesh_file *file, const text_line *line, ply_header *header)
{
  char *cursor = line->begin;
  text_word const keyword = text_next_word(&cursor, line->end);
  if (line->number == 1) {
    return text_is(keyword, "ply") ? EXM_OK : mesh_file_bad_line(file, line, "the header of a PLY file");
  }
  if (text_is(keyword, "format")) {
    header->is_text = text_is(text_next_word(&cursor, line->end), "ascii");
  } else if (text_is(keyword, "element")) {
    return check_element(file, line, cursor, header);
  } else if (text_is(keyword, "property")) {
    TRY(check_property(file, line, cursor, header));
    ++header->properties;
  } else if (text_is(keyword, "end_header")) {
    header->ended = true;
  } else if (!text_is(keyword, "comment") && !text_is(keyword, "obj_info")) {
    return mesh_file_bad_line(file, line, "a line of a PLY header");
  }
  return EXM_OK;
}

exm_status mesh_file_prepare_ply(mesh_file *file)
{
  file->format = MESH_FORMAT_PLY;
  ply_header header = {.element = PLY_NONE};
  text_line line = {0};
  while (!header.ended && text_next_line(file->bytes, file->size, &line)) {
    TRY(check_line(file, &line, &header));
  }
  if (!header.ended) {
    return status_set(EXM_ERROR_IO, "%s: the header has no end_header", file->path);
  }
  file->bytes[file->size++] = '\n'; /* or the last number would end with the file, which counts as too early */
  return EXM_OK;
}
