/* SPDX-License-Identifier: GPL-3.0-or-later */
/* STL; in text form it is written anew in binary form. A facet there: normal, three corners, two bytes of nothing, all
 * numbers little-endian. */
#include <string.h>

#include "mesh/mesh_file.h"

enum { HEADER = 84, FACET = 50, COUNT_AT = 80, CORNERS_AT = 12 };

static uint32_t get_u32(const char *bytes)
{
  const unsigned char *b = (const unsigned char *)bytes;
  return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static void put_u32(char *bytes, uint32_t value)
{
  for (int i = 0; i < 4; ++i) {
    bytes[i] = (char)(value >> 8 * i & 0xff);
  }
}

/* By size: there are binary files whose header begins with "solid", as text does. */
static bool is_binary(const mesh_file *file)
{
  return file->size >= HEADER && (uint64_t)get_u32(file->bytes + COUNT_AT) * FACET == file->size - HEADER;
}

static exm_status check_binary(const mesh_file *file)
{
  size_t const facets = (file->size - HEADER) / FACET;
  for (size_t f = 0; f < facets; ++f) {
    for (size_t i = 0; i < 9; ++i) {
      uint32_t const bits = get_u32(file->bytes + HEADER + f * FACET + CORNERS_AT + 4 * i);
      if ((bits & 0x7f800000U) == 0x7f800000U) { /* the exponent of infinities and NaN */
        return status_set(EXM_ERROR_IO, "%s, facet %zu: vertex %zu is not finite", file->path, f, i / 3);
      }
    }
  }
  return EXM_OK;
}

/* A line of text; the cursor is left behind its keyword. */
typedef enum stl_line { STL_OTHER, STL_LOOP, STL_VERTEX, STL_LOOP_END } stl_line;

static stl_line classify(const text_line *line, char **cursor)
{
  *cursor = line->begin;
  text_word const keyword = text_next_word(cursor, line->end);
  if (text_is(keyword, "vertex")) {
    return STL_VERTEX;
  }
  if (text_is(keyword, "outer")) {
    return STL_LOOP;
  }
  return text_is(keyword, "endloop") ? STL_LOOP_END : STL_OTHER;
}

static size_t count_loops(const mesh_file *file)
{
  size_t loops = 0;
  text_line line = {0};
  char *cursor;
  while (text_next_line(file->bytes, file->size, &line)) {
    loops += classify(&line, &cursor) == STL_LOOP;
  }
  return loops;
}

static void put_vertex(char *facet, size_t corner, const float position[3])
{
  for (size_t k = 0; k < 3; ++k) {
    uint32_t bits;
    memcpy(&bits, &position[k], sizeof bits);
    put_u32(facet + CORNERS_AT + 4 * (3 * corner + k), bits);
  }
}

static exm_status transcribe(const mesh_file *file, char *facets)
{
  size_t loops = 0, corners = 3; /* of the current loop */
  text_line line = {0};
  while (text_next_line(file->bytes, file->size, &line)) {
    char *cursor;
    float position[3];
    stl_line const kind = classify(&line, &cursor);
    if (kind == STL_LOOP && corners == 3) {
      ++loops;
      corners = 0;
    } else if (kind == STL_VERTEX && corners < 3) {
      if (!text_floats(&cursor, line.end, position)) {
        return mesh_file_bad_line(file, &line, "a vertex with three finite coordinates");
      }
      put_vertex(facets + (loops - 1) * FACET, corners++, position);
    } else if (kind != STL_OTHER && !(kind == STL_LOOP_END && corners == 3)) {
      return mesh_file_bad_line(file, &line, "in its place: a loop has three vertices");
    }
  }
  return corners == 3 ? EXM_OK : status_set(EXM_ERROR_IO, "%s ends in the middle of a facet", file->path);
}

static exm_status text_to_binary(mesh_file *file, arena *memory)
{
  size_t const facets = count_loops(file);
  char *const bytes = facets < UINT32_MAX ? ARENA_NEW(memory, char, HEADER + facets * FACET) : NULL;
  if (!bytes) {
    return status_no_memory(file->path);
  }
  put_u32(bytes + COUNT_AT, (uint32_t)facets);
  TRY(transcribe(file, bytes + HEADER));
  file->bytes = bytes;
  file->size = HEADER + facets * FACET;
  return EXM_OK;
}

exm_status mesh_file_prepare_stl(mesh_file *file, arena *memory)
{
  file->format = MESH_FORMAT_STL;
  return is_binary(file) ? check_binary(file) : text_to_binary(file, memory);
}
