/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_BASE_CLOCK_H
#define EXM_BASE_CLOCK_H

/** Seconds since some moment, never going back. */
double clock_seconds(void);

#endif
