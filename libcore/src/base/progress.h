/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_BASE_PROGRESS_H
#define EXM_BASE_PROGRESS_H

#include "exemplar.h"

/** A caller's callback and the share [begin, end] of its range that the current stage may use. */
typedef struct progress {
  exm_progress callback;
  void *user;
  double begin, end;
} progress;

/** The part [from, to] (of 0..1) of a stage, to be handed to a function it calls. */
progress progress_part(const progress *whole, double from, double to);

/** Report; EXM_ERROR_CANCELLED where the caller asked to stop. `whole` may be NULL. */
exm_status progress_report(const progress *whole, double fraction, const char *stage);

#endif
