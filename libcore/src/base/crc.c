/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/crc.h"

/* Remainders of the sixteen half-bytes: a table of 1 KiB would be twice as fast, and there is no global state to fill.
 */
static const uint32_t REMAINDERS[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                        0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                        0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};

uint32_t crc_add(uint32_t crc, const void *bytes, size_t size)
{
  const unsigned char *at = bytes;
  crc = ~crc;
  for (size_t i = 0; i < size; i++) {
    crc ^= at[i];
    crc = REMAINDERS[crc & 15] ^ (crc >> 4);
    crc = REMAINDERS[crc & 15] ^ (crc >> 4);
  }
  return ~crc;
}
