/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "harness.h"

TEST(abi_is_the_headers)
{
  CHECK(exm_abi_version() == EXM_ABI_VERSION);
}

TEST(version_has_three_parts)
{
  unsigned major, minor, patch;
  char rest;
  CHECK(sscanf(exm_version(), "%u.%u.%u%c", &major, &minor, &patch, &rest) == 3);
}
