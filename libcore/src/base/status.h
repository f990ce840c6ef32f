/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Errors as values. A function that can fail returns exm_status; the sentence that explains a failure is recorded where
 * it happens, in the thread's own storage, and travels no further than that. */
#ifndef EXM_BASE_STATUS_H
#define EXM_BASE_STATUS_H

#include "exemplar.h"

#if defined(__GNUC__)
#  define EXM_PRINTF(position, first) __attribute__((format(printf, position, first)))
#else
#  define EXM_PRINTF(position, first)
#endif

/** Record the sentence and return `code`, so that a failure is one statement: `return status_set(...)`. */
exm_status status_set(exm_status code, const char *format, ...) EXM_PRINTF(2, 3);

/** The same, about one element that a user interface can select. */
exm_status status_set_at(exm_status code, exm_element kind, size_t index, const char *format, ...) EXM_PRINTF(4, 5);

/** Record that `what` did not fit in memory; returns EXM_ERROR_OUT_OF_MEMORY. */
exm_status status_no_memory(const char *what);

const char *status_message(void);
void status_element(exm_element *kind, size_t *index);

/** Leave the calling function with the status of a call that failed. For functions that own nothing; others
 *  `goto done`. */
#define TRY(call)                                                                                                      \
  do {                                                                                                                 \
    exm_status status_of_ = (call);                                                                                    \
    if (status_of_ < 0) {                                                                                              \
      return status_of_;                                                                                               \
    }                                                                                                                  \
  } while (0)

#endif
