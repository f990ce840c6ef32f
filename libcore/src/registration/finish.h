/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_REGISTRATION_FINISH_H
#define EXM_REGISTRATION_FINISH_H

#include "registration/shape.h"

/** The full-resolution finish: vertices that are seen go to the scan's surface, the rest follow as rigidly as possible.
 */
exm_status finish_shape(shape *surface, const fit_request *request, double scale, const progress *report);

#endif
