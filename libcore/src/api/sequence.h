/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the functions about sequences check alike. */
#ifndef EXM_API_SEQUENCE_H
#define EXM_API_SEQUENCE_H

#include "base/status.h"

/** There is a sequence, and it has been fitted. */
exm_status check_fitted(const exm_sequence *sequence);
/** The same, and it has that window. */
exm_status check_window(const exm_sequence *sequence, size_t window);
/** points [count][2] are finite. */
exm_status check_points(const double *points, size_t count, const char *name);

#endif
