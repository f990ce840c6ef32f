/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Every allocation fails once. The test program's malloc stands in front of the C library's, so CHOLMOD's and C++'s
 * allocations fail as well as ours. Does nothing in sanitized builds and under valgrind, which bring their own. */
#ifndef EXM_TESTS_ALLOCATION_H
#define EXM_TESTS_ALLOCATION_H

#include "exemplar.h"

/** Can allocations be made to fail in this program? */
int allocation_can_fail(void);

/**
 * Run `run` again and again: once undisturbed, then with its first, its second, ... allocation failing, until it asks
 * for no more. Each run must return EXM_ERROR_OUT_OF_MEMORY with a message, or succeed in spite of it, and leave no
 * allocation behind: `run` destroys what it made. From the thousandth allocation on, one in a hundred is failed.
 *
 * Returns how many allocations were failed. Failures of the law are reported to the harness.
 */
size_t for_each_failed_allocation(exm_status (*run)(void *context), void *context);

/** Live allocations of this process; compare two to see a leak. */
long allocation_balance(void);

#endif
