/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "registration/finish.h"

exm_status finish_shape(shape *surface, const fit_request *request, double scale, const progress *report)
{
  (void)surface;
  (void)request;
  (void)scale;
  return progress_report(report, 1, "finishing");
}
