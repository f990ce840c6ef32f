/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "api/structs.h"

#include <string.h>

/* A struct on a caller's stack whose _init was forgotten holds anything here; no struct of ours comes near this size.
 */
enum { LARGEST_STRUCT = 4096 };

static size_t struct_size(const void *any)
{
  size_t size;
  memcpy(&size, any, sizeof size);
  return size;
}

exm_status check_pointer(const void *argument, const char *name)
{
  return argument ? EXM_OK : status_set(EXM_ERROR_ARGUMENT, "%s is NULL", name);
}

exm_status report_check(const void *theirs, const char *name)
{
  if (!theirs) {
    return EXM_OK;
  }
  size_t const size = struct_size(theirs);
  if (size <= sizeof size || size > LARGEST_STRUCT) {
    return status_set(EXM_ERROR_ARGUMENT, "%s->struct_size is %zu: call its _init function first", name, size);
  }
  return EXM_OK;
}

exm_status settings_read(void *ours, size_t our_size, const void *theirs, const char *name)
{
  TRY(report_check(theirs, name));
  if (theirs) {
    size_t const size = struct_size(theirs);
    memcpy(ours, theirs, size < our_size ? size : our_size);
    memcpy(ours, &our_size, sizeof our_size);
  }
  return EXM_OK;
}

exm_status report_write(void *theirs, const void *ours, size_t our_size, const char *name)
{
  TRY(report_check(theirs, name));
  if (theirs) {
    size_t const size = struct_size(theirs);
    size_t const common = size < our_size ? size : our_size;
    memcpy((char *)theirs + sizeof size, (const char *)ours + sizeof size, common - sizeof size);
  }
  return EXM_OK;
}
