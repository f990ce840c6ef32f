/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The cyclic redundancy check of PNG and zip (CRC-32, polynomial 0xEDB88320 reflected): finds every change within four
 * bytes in a row, and all but one in four thousand million of the others. */
#ifndef EXM_BASE_CRC_H
#define EXM_BASE_CRC_H

#include <stddef.h>
#include <stdint.h>

/** The check of what came before, `crc` (0 at the beginning), and of `size` bytes more. */
uint32_t crc_add(uint32_t crc, const void *bytes, size_t size);

#endif
