/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/status.h"

#include <stdarg.h>
#include <stdio.h>

static _Thread_local char message[512];
static _Thread_local exm_element element_kind;
static _Thread_local size_t element_index;

void status_record(exm_element kind, size_t index, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  element_kind = kind;
  element_index = index;
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
