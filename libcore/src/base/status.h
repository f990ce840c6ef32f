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

/** Record the sentence and give `code`, so that a failure is one statement: `return status_set(...)`. Macros, so that
 *  compilers and analysers see that what comes back is the code: behind a call they would follow paths on which a
 *  failure looks like a success. */
#define status_set(code, ...) (status_record(EXM_ELEMENT_NONE, 0, __VA_ARGS__), (exm_status)(code))

/** The same, about one element that a user interface can select. */
#define status_set_at(code, kind, index, ...) (status_record((kind), (index), __VA_ARGS__), (exm_status)(code))

/** Record that `what` did not fit in memory; gives EXM_ERROR_OUT_OF_MEMORY. */
#define status_no_memory(what) status_set(EXM_ERROR_OUT_OF_MEMORY, "not enough memory for %s", (what))

void status_record(exm_element kind, size_t index, const char *format, ...) EXM_PRINTF(3, 4);

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
