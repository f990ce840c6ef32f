/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "exemplar.h"

uint32_t exm_abi_version(void)
{
  return EXM_ABI_VERSION;
}

const char *exm_version(void)
{
  return EXM_VERSION_STRING; /* from CMakeLists.txt */
}
