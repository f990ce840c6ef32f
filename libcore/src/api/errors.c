/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/status.h"

const char *exm_last_error(void)
{
  return status_message();
}

void exm_last_error_element(exm_element *kind, size_t *index)
{
  status_element(kind, index);
}
