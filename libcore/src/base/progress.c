/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/progress.h"

#include "base/status.h"

progress progress_part(const progress *whole, double from, double to)
{
  progress part = {0};
  if (whole) {
    double const length = whole->end - whole->begin;
    part = *whole;
    part.begin = whole->begin + from * length;
    part.end = whole->begin + to * length;
  }
  return part;
}

exm_status progress_report(const progress *whole, double fraction, const char *stage)
{
  if (!whole || !whole->callback) {
    return EXM_OK;
  }
  double const done = whole->begin + fraction * (whole->end - whole->begin);
  if (whole->callback(whole->user, done, stage) != 0) {
    return status_set(EXM_ERROR_CANCELLED, "cancelled while %s", stage);
  }
  return EXM_OK;
}
