/* SPDX-License-Identifier: GPL-3.0-or-later */
/* OpenMesh's readers trust their input. Found in version 9 and dealt with here:
 *
 *   OBJ  a line "v nan 0 0" is dropped, which renumbers all that follow; "f /1 /2 /3" aborts the process; "mtllib"
 *        opens other files. We check every v and f line and blank out all others.
 *   STL  the text reader repeats the last number where one is missing; the binary one welds NaN to any vertex.
 *   OFF  colours after a face are taken for the next face. We cut them off, and comments.
 *   PLY  a property before the first element is written to an empty list; a header without an end is read for ever,
 *        and a count of four thousand million for nearly as long.
 *
 * Truncation and garbage elsewhere fail the strict stream that the shim parses from. */
#include "mesh/mesh_file.h"

#include <errno.h>
#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#if !defined(_WIN32)
#  include <strings.h>
#else
#  define strcasecmp _stricmp
#  define strncasecmp _strnicmp
#endif

/* ---------------------------------------------------------------------------------------------------- lines, tokens */

typedef struct text_line {
  char *begin, *end; /* without the newline */
  size_t number;     /* from 1; 0 before the first */
} text_line;

static bool next_line(const mesh_file *file, text_line *line)
{
  char *const limit = file->bytes + file->size;
  char *const begin = line->number ? line->end + 1 : file->bytes;
  if (begin >= limit) {
    return false;
  }
  char *const newline = memchr(begin, '\n', (size_t)(limit - begin));
  line->begin = begin;
  line->end = newline ? newline : limit;
  ++line->number;
  return true;
}

static bool is_space(char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/* The next run of non-blanks in [*cursor, end); empty at the end. */
typedef struct token {
  char *begin, *end;
} token;

static token next_token(char **cursor, char *end)
{
  token word;
  while (*cursor < end && is_space(**cursor)) {
    ++*cursor;
  }
  word.begin = *cursor;
  while (*cursor < end && !is_space(**cursor)) {
    ++*cursor;
  }
  word.end = *cursor;
  return word;
}

static bool token_is(token word, const char *text)
{
  size_t const length = strlen(text);
  return (size_t)(word.end - word.begin) == length && strncasecmp(word.begin, text, length) == 0;
}

static const char *skip_digits(const char *p, const char *end)
{
  while (p < end && *p >= '0' && *p <= '9') {
    ++p;
  }
  return p;
}

static const char *skip_sign(const char *p, const char *end)
{
  return p < end && (*p == '-' || *p == '+') ? p + 1 : p;
}

/* A decimal number, by its spelling: "nan", "inf" and hexadecimal ones are not. strtod would ask the locale. */
static bool is_number(token word)
{
  const char *const digits = skip_sign(word.begin, word.end);
  const char *p = skip_digits(digits, word.end);
  size_t count = (size_t)(p - digits);
  if (p < word.end && *p == '.') {
    const char *const fraction = p + 1;
    p = skip_digits(fraction, word.end);
    count += (size_t)(p - fraction);
  }
  if (count > 0 && p < word.end && (*p == 'e' || *p == 'E')) {
    const char *const exponent = skip_sign(p + 1, word.end);
    p = skip_digits(exponent, word.end);
    count = (size_t)(p - exponent);
  }
  return count > 0 && p == word.end;
}

static bool three_numbers(char **cursor, char *end)
{
  for (int i = 0; i < 3; ++i) {
    if (!is_number(next_token(cursor, end))) {
      return false;
    }
  }
  return true;
}

static exm_status bad_line(const mesh_file *file, const text_line *line, const char *expected)
{
  int const shown = (int)(line->end - line->begin > 60 ? 60 : line->end - line->begin);
  return status_set(EXM_ERROR_IO, "%s, line %zu: \"%.*s\" is not %s", file->path, line->number, shown, line->begin,
                    expected);
}

/* -------------------------------------------------------------------------------------------------------------- OBJ */

/* "7", "7/1", "7//2", "-3/1/2": the number of a vertex, then anything. */
static bool is_obj_corner(token word)
{
  const char *const digits = skip_sign(word.begin, word.end);
  const char *const rest = skip_digits(digits, word.end);
  return rest > digits && (rest == word.end || *rest == '/');
}

static bool is_obj_face(char *cursor, char *end)
{
  size_t corners = 0;
  for (token word = next_token(&cursor, end); word.begin < word.end; word = next_token(&cursor, end)) {
    if (!is_obj_corner(word)) {
      return false;
    }
    ++corners;
  }
  return corners >= 3;
}

static void blank(char *begin, char *end)
{
  memset(begin, ' ', (size_t)(end - begin));
}

static exm_status check_obj(mesh_file *file)
{
  text_line line = {0};
  while (next_line(file, &line)) {
    char *const comment = memchr(line.begin, '#', (size_t)(line.end - line.begin));
    if (comment) {
      blank(comment, line.end);
    }
    char *cursor = line.begin;
    token const keyword = next_token(&cursor, line.end);
    if (token_is(keyword, "v")) {
      ++file->vertex_lines;
      if (!three_numbers(&cursor, line.end)) {
        return bad_line(file, &line, "a vertex with three finite coordinates");
      }
    } else if (token_is(keyword, "f")) {
      if (!is_obj_face(cursor, line.end)) {
        return bad_line(file, &line, "a face with three or more vertex numbers");
      }
    } else {
      blank(line.begin, line.end);
    }
  }
  return EXM_OK;
}

/* -------------------------------------------------------------------------------------------------------------- STL */

static exm_status check_stl_text(const mesh_file *file)
{
  size_t loops = 0, vertices = 0;
  text_line line = {0};
  while (next_line(file, &line)) {
    char *cursor = line.begin;
    token const keyword = next_token(&cursor, line.end);
    if (token_is(keyword, "outer")) {
      ++loops;
    } else if (token_is(keyword, "vertex")) {
      ++vertices;
      if (!three_numbers(&cursor, line.end)) {
        return bad_line(file, &line, "a vertex with three finite coordinates");
      }
    }
    if (vertices > 3 * loops || (token_is(keyword, "endloop") && vertices != 3 * loops)) {
      return bad_line(file, &line, "where a loop of three vertices should end");
    }
  }
  if (vertices != 3 * loops) {
    return status_set(EXM_ERROR_IO, "%s ends in the middle of a facet", file->path);
  }
  return EXM_OK;
}

enum { STL_HEADER = 84, STL_FACET = 50 };

static uint32_t little_endian(const char *bytes)
{
  const unsigned char *b = (const unsigned char *)bytes;
  return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static bool is_stl_binary(const mesh_file *file)
{
  return file->size >= STL_HEADER && (uint64_t)little_endian(file->bytes + 80) * STL_FACET == file->size - STL_HEADER;
}

static exm_status check_stl_binary(const mesh_file *file)
{
  size_t const facets = (file->size - STL_HEADER) / STL_FACET;
  for (size_t f = 0; f < facets; ++f) {
    const char *const corners = file->bytes + STL_HEADER + f * STL_FACET + 12; /* after the normal */
    for (size_t i = 0; i < 9; ++i) {
      uint32_t const bits = little_endian(corners + 4 * i);
      if ((bits & 0x7f800000U) == 0x7f800000U) { /* the exponent of infinities and NaN */
        return status_set(EXM_ERROR_IO, "%s, facet %zu: vertex %zu is not finite", file->path, f, i / 3);
      }
    }
  }
  return EXM_OK;
}

/* -------------------------------------------------------------------------------------------------------------- OFF */

/* How many numbers the header promises on a vertex line before its colour; 0 where it is none that we read. */
static size_t off_vertex_numbers(const text_line *line)
{
  char *cursor = line->begin;
  token const keyword = next_token(&cursor, line->end);
  token const rest = next_token(&cursor, line->end);
  if (rest.begin < rest.end) {
    return 0;
  }
  if (token_is(keyword, "OFF") || token_is(keyword, "COFF")) {
    return 3;
  }
  return token_is(keyword, "NOFF") || token_is(keyword, "CNOFF") ? 6 : 0;
}

/* Digits to a number that stops growing where no count could be that large. */
static size_t parse_count(token word)
{
  size_t count = 0;
  for (const char *p = word.begin; p < word.end && *p >= '0' && *p <= '9' && count < SIZE_MAX / 16; ++p) {
    count = 10 * count + (size_t)(*p - '0');
  }
  return count;
}

/* Blank out what follows `count` more tokens. */
static void cut_after(size_t count, char *cursor, char *end)
{
  while (count > 0 && cursor < end) {
    next_token(&cursor, end);
    --count;
  }
  blank(cursor, end);
}

static exm_status check_off(const mesh_file *file)
{
  text_line line = {0};
  size_t const vertex_numbers = next_line(file, &line) ? off_vertex_numbers(&line) : 0;
  if (vertex_numbers == 0) {
    return bad_line(file, &line, "the header of a text OFF file: OFF, COFF, NOFF or CNOFF, alone on its line");
  }
  size_t content = 0, vertices = 0; /* lines that are not blank, from that of the counts on */
  while (next_line(file, &line)) {
    char *const comment = memchr(line.begin, '#', (size_t)(line.end - line.begin));
    if (comment) {
      blank(comment, line.end);
    }
    char *cursor = line.begin;
    token const first = next_token(&cursor, line.end);
    if (first.begin == first.end) {
      continue;
    }
    if (content == 0) {
      vertices = parse_count(first);
    } else {
      cut_after(content <= vertices ? vertex_numbers - 1 : parse_count(first), cursor, line.end);
    }
    ++content;
  }
  return EXM_OK;
}

/* -------------------------------------------------------------------------------------------------------------- PLY */

static exm_status check_ply(const mesh_file *file)
{
  text_line line = {0};
  bool in_element = false;
  while (next_line(file, &line)) {
    char *cursor = line.begin;
    token const keyword = next_token(&cursor, line.end);
    if (line.number == 1 && !token_is(keyword, "ply")) {
      return bad_line(file, &line, "the header of a PLY file");
    }
    if (token_is(keyword, "end_header")) {
      return EXM_OK;
    }
    if (token_is(keyword, "element")) {
      in_element = true;
      next_token(&cursor, line.end);
      if (parse_count(next_token(&cursor, line.end)) > file->size) { /* OpenMesh would count to it */
        return bad_line(file, &line, "possible: the file has fewer bytes than that");
      }
    }
    if (token_is(keyword, "property") && !in_element) {
      return bad_line(file, &line, "allowed before the first element");
    }
  }
  return status_set(EXM_ERROR_IO, "%s: the header has no end_header", file->path);
}

/* ------------------------------------------------------------------------------------------------------------- doors
 */

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

static exm_status find_format(mesh_file *file)
{
  const char *const dot = strrchr(file->path, '.');
  const char *const extension = dot ? dot + 1 : "";
  if (strcasecmp(extension, "obj") == 0) {
    file->format = MESH_FORMAT_OBJ;
  } else if (strcasecmp(extension, "off") == 0) {
    file->format = MESH_FORMAT_OFF;
  } else if (strcasecmp(extension, "ply") == 0) {
    file->format = MESH_FORMAT_PLY;
  } else if (strcasecmp(extension, "stl") == 0) {
    /* By size: there are binary files whose header begins with "solid", as text does. */
    file->format = is_stl_binary(file) ? MESH_FORMAT_STL_BINARY : MESH_FORMAT_STL_TEXT;
  } else {
    return status_set(EXM_ERROR_IO, "%s: the format \".%s\" is not known; OBJ, PLY, OFF and STL are", file->path,
                      extension);
  }
  return EXM_OK;
}

static exm_status check_content(mesh_file *file)
{
  switch (file->format) {
  case MESH_FORMAT_OBJ:
    return check_obj(file);
  case MESH_FORMAT_OFF:
    return check_off(file);
  case MESH_FORMAT_PLY:
    return check_ply(file);
  case MESH_FORMAT_STL_BINARY:
    return check_stl_binary(file);
  case MESH_FORMAT_STL_TEXT:
    return check_stl_text(file);
  }
  return EXM_OK;
}

exm_status mesh_file_load(const char *path, arena *memory, mesh_file *out)
{
  mesh_file file = {.path = path};
  errno = 0;
  FILE *const stream = fopen(path, "rb");
  if (!stream) {
    return errno == ENOMEM ? status_no_memory(path)
                           : status_set(EXM_ERROR_IO, "%s cannot be opened: %s", path, strerror(errno));
  }
  exm_status const status = read_bytes(stream, memory, &file);
  fclose(stream);
  TRY(status);
  TRY(find_format(&file));
  TRY(check_content(&file));
  file.bytes[file.size++] = '\n'; /* a last line without one makes streams report the end of the file too early */
  *out = file;
  return EXM_OK;
}
