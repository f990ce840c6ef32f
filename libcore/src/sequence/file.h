/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The file of a fitted sequence. docs/sequences.md describes it; file_write.c and file_read.c go through its fields in
 * one and the same order. Numbers are little-endian whatever the machine is. */
#ifndef EXM_SEQUENCE_FILE_H
#define EXM_SEQUENCE_FILE_H

#include <errno.h>

#include "sequence/sequence.h"

enum { FILE_MAGIC_SIZE = 8, FILE_LARGEST_COUNT = INT32_MAX };

#define FILE_MAGIC                                                                                                     \
  "\x93"                                                                                                               \
  "EXMSEQ\n"

/** The status of a failure that the C library tells by a number. */
static inline exm_status file_failure(int number)
{
  return number == ENOMEM ? EXM_ERROR_OUT_OF_MEMORY : EXM_ERROR_IO;
}

/** What the file saves its reader to hold. */
static inline uint64_t file_frames_size(const exm_sequence *sequence)
{
  return (uint64_t)sequence->fitted->shape.row_count * sequence->reference->vertex_count * 3 * sizeof(float);
}

#endif
