/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What every function of the API begins with: pointers that are there, and structs that grow.
 *
 * A caller's struct begins with struct_size, the size that its header gave it; ours may be larger or
 * smaller. Fields are only ever added at the end, so the common prefix is what both sides understand.
 *
 *   exm_x_settings own;                      exm_x_report found = {.struct_size = sizeof found, ...};
 *   exm_x_settings_init(&own);               return report_write(report, &found, sizeof found, "report");
 *   TRY(settings_read(&own, sizeof own, settings, "settings"));
 */
#ifndef EXM_API_STRUCTS_H
#define EXM_API_STRUCTS_H

#include "base/status.h"

/** EXM_ERROR_ARGUMENT that names the argument where it is NULL. */
exm_status check_pointer(const void *argument, const char *name);

/** Overwrite our defaults by what the caller's header knew of. `theirs` may be NULL: the defaults stay. */
exm_status settings_read(void *ours, size_t our_size, const void *theirs, const char *name);

/** Write as much of `ours` as the caller's struct has room for, and leave its struct_size as it is. `theirs` may be
 *  NULL where the report is optional. */
exm_status report_write(void *theirs, const void *ours, size_t our_size, const char *name);

/** Check struct_size of a report before the work is done rather than after it. NULL passes. */
exm_status report_check(const void *theirs, const char *name);

#endif
