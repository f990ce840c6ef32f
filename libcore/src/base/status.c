/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/status.h"

#include <stdarg.h>
#include <stdio.h>

static _Thread_local char message[512];
static _Thread_local exm_element element_kind;
static _Thread_local size_t element_index;

static exm_status record(exm_status code, exm_element kind, size_t index, const char *format, va_list arguments)
{
  vsnprintf(message, sizeof message, format, arguments);
  element_kind = kind;
  element_index = index;
  return code;
}

exm_status status_set(exm_status code, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  record(code, EXM_ELEMENT_NONE, 0, format, arguments);
  va_end(arguments);
  return code;
}

exm_status status_set_at(exm_status code, exm_element kind, size_t index, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  record(code, kind, index, format, arguments);
  va_end(arguments);
  return code;
}

exm_status status_no_memory(const char *what)
{
  return status_set(EXM_ERROR_OUT_OF_MEMORY, "not enough memory for %s", what);
}

const char *status_message(void)
{
  return message;
}

void status_element(exm_element *kind, size_t *index)
{
  if (kind) {
    *kind = element_kind;
  }
  if (index) {
    *index = element_index;
  }
}
