/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_REGISTRATION_RESULT_H
#define EXM_REGISTRATION_RESULT_H

#include "registration/shape.h"

/** The quality of a fit, from the shape before its finish. */
exm_status result_judge(const shape *surface, const fit_request *request, exm_registration_fit_report *report);

/** Positions and correspondences both ways, and the report's residuals. */
exm_status result_fill(const shape *surface, const fit_request *request, exm_registration_fit_report *report,
                       registered_fit *fit);

/** EXM_WARNING_FIT where the report gives reason. */
exm_status result_warn(const exm_registration_fit_report *report);

#endif
