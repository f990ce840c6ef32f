/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "mesh/text.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#if !defined(_WIN32)
#  include <strings.h>
#else
#  define strncasecmp _strnicmp
#endif

bool text_next_line(char *bytes, size_t size, text_line *line)
{
  char *const limit = bytes + size;
  char *const begin = line->number ? line->end + 1 : bytes;
  if (begin >= limit) {
    return false;
  }
  char *const newline = memchr(begin, '\n', (size_t)(limit - begin));
  line->begin = begin;
  line->end = newline ? newline : limit;
  ++line->number;
  return true;
}

static bool is_blank(char c)
{
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

text_word text_next_word(char **cursor, const char *end)
{
  text_word word;
  while (*cursor < end && is_blank(**cursor)) {
    ++*cursor;
  }
  word.begin = *cursor;
  while (*cursor < end && !is_blank(**cursor)) {
    ++*cursor;
  }
  word.end = *cursor;
  return word;
}

bool text_is_empty(text_word word)
{
  return word.begin == word.end;
}

bool text_is(text_word word, const char *text)
{
  size_t const length = strlen(text);
  return (size_t)(word.end - word.begin) == length && strncasecmp(word.begin, text, length) == 0;
}

/* strtof understands more than we want, and a decimal point as the locale has it: so only the characters of a decimal
 * number pass, and the point is replaced by the locale's. */
bool text_float(text_word word, float *out)
{
  char copy[128];
  size_t const length = (size_t)(word.end - word.begin);
  if (length == 0 || length >= sizeof copy) {
    return false;
  }
  char const point = localeconv()->decimal_point[0];
  for (size_t i = 0; i < length; ++i) {
    char const c = word.begin[i];
    if (c == 0 || !strchr("0123456789.+-eE", c)) {
      return false;
    }
    copy[i] = c == '.' ? point : c;
  }
  copy[length] = 0;
  char *rest;
  *out = strtof(copy, &rest);
  return rest == copy + length && isfinite(*out);
}

bool text_floats(char **cursor, const char *end, float out[3])
{
  for (int i = 0; i < 3; ++i) {
    if (!text_float(text_next_word(cursor, end), &out[i])) {
      return false;
    }
  }
  return true;
}

bool text_integer(const char *begin, const char *end, long long *out, const char **rest)
{
  long long const too_large = 1000000000000;
  bool const negative = begin < end && *begin == '-';
  const char *const digits = begin + (begin < end && (*begin == '-' || *begin == '+'));
  const char *p = digits;
  long long value = 0;
  while (p < end && *p >= '0' && *p <= '9' && value < too_large) {
    value = 10 * value + (*p++ - '0');
  }
  *out = negative ? -value : value;
  *rest = p;
  return p > digits && value < too_large;
}

void text_blank(char *begin, const char *end)
{
  memset(begin, ' ', (size_t)(end - begin));
}

void text_strip_comment(const text_line *line)
{
  char *const comment = memchr(line->begin, '#', (size_t)(line->end - line->begin));
  if (comment) {
    text_blank(comment, line->end);
  }
}
