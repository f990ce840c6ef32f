/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Interpolation between solved poses of a Blended deformer. */
#include <math.h>
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"
#include "deform/blended/deformer.h"
#include "deform/blended/interpolate.h"

static const blended *solver_of(const exm_deformer *deformer)
{
  return &((const blended_deformer *)deformer)->solver;
}

exm_status exm_blended_key_size(const exm_deformer *deformer, size_t *size)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(size, "size"));
  *size = blended_key_size(solver_of(deformer));
  return EXM_OK;
}

exm_status exm_blended_get_key(const exm_deformer *deformer, double *key)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(key, "key"));
  if (!solver_of(deformer)->has_solution) {
    return status_set(EXM_ERROR_ARGUMENT, "deformer has no solved pose: only a solve makes a key");
  }
  blended_get_key(solver_of(deformer), key);
  return EXM_OK;
}

static exm_status check_keys(const blended *b, const double *keys, const double *times, size_t count)
{
  size_t const size = blended_key_size(b);
  for (size_t i = 0; i < count; i++) {
    if (!blended_key_is_valid(b, keys + i * size)) {
      return status_set(EXM_ERROR_ARGUMENT, "keys: key %zu is not one of this deformer's", i);
    }
    if (!isfinite(times[i])) {
      return status_set(EXM_ERROR_ARGUMENT, "times: time %zu is not finite", i);
    }
    if (i > 0 && !(times[i] > times[i - 1])) {
      return status_set(EXM_ERROR_ARGUMENT, "times: time %zu, %g, is not after time %zu, %g", i, times[i], i - 1,
                        times[i - 1]);
    }
  }
  return EXM_OK;
}

exm_status exm_blended_interpolate(exm_deformer *deformer, const double *keys, const double *times, size_t count,
                                   double time)
{
  TRY(check_kind(deformer, EXM_DEFORMER_BLENDED));
  TRY(check_pointer(keys, "keys"));
  TRY(check_pointer(times, "times"));
  if (count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "count is 0: there must be one key at least");
  }
  if (!isfinite(time)) {
    return status_set(EXM_ERROR_ARGUMENT, "time is not finite");
  }
  TRY(check_keys(solver_of(deformer), keys, times, count));
  blended_deformer *own = (blended_deformer *)deformer;
  TRY(blended_interpolate(&own->solver, keys, times, count, time));
  blended_deformer_place(own, own->heights[0]);
  return EXM_OK;
}
