/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lines and words of a text in memory, and numbers whatever the locale. Words are separated by blanks; a line ends with
 * a newline, and a carriage return counts as a blank. */
#ifndef EXM_MESH_TEXT_H
#define EXM_MESH_TEXT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct text_line {
  char *begin, *end; /* without the newline */
  size_t number;     /* from 1 */
} text_line;

/** The next line of [bytes, bytes + size); begin with a line of zeros. */
bool text_next_line(char *bytes, size_t size, text_line *line);

typedef struct text_word {
  char *begin, *end; /* empty at the end of the line */
} text_word;

/** The next word in [*cursor, end); moves the cursor behind it. */
text_word text_next_word(char **cursor, const char *end);

bool text_is_empty(text_word word);

/** Is the word `text`, but for upper and lower case? */
bool text_is(text_word word, const char *text);

/** A finite decimal number; false for "nan", "inf", hexadecimal ones and those beyond a float. */
bool text_float(text_word word, float *out);

/** Three of them, the next in the line. */
bool text_floats(char **cursor, const char *end, float out[3]);

/** The integer that [begin, end) begins with; *rest is what follows it. False where there is none or it is too large.
 */
bool text_integer(const char *begin, const char *end, long long *out, const char **rest);

void text_blank(char *begin, const char *end);

/** Blank out a comment that begins with '#'. */
void text_strip_comment(const text_line *line);

#endif
