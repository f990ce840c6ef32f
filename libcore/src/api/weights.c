/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "api/structs.h"
#include "weights/bounded_biharmonic.h"
#include "weights/eigenfunctions.h"
#include "weights/handles.h"

exm_status exm_weights_bounded_biharmonic(const exm_mesh *m, const exm_handles *handles, exm_progress callback,
                                          void *user, float *weights)
{
  progress const whole = {.callback = callback, .user = user, .begin = 0, .end = 1};
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(handles, "handles"));
  TRY(check_pointer(weights, "weights"));
  TRY(handles_check_vertices(m, handles));
  return weights_bounded_biharmonic(m, handles, &whole, weights);
}

exm_status exm_weights_eigenfunctions(const exm_mesh *m, size_t count, exm_progress callback, void *user,
                                      double *values, double *functions)
{
  progress const whole = {.callback = callback, .user = user, .begin = 0, .end = 1};
  TRY(check_pointer(m, "mesh"));
  TRY(check_pointer(values, "values"));
  TRY(check_pointer(functions, "functions"));
  if (count < 1 || count > m->vertex_count) {
    return status_set(EXM_ERROR_ARGUMENT, "count is %zu, not 1 to the %zu vertices", count, m->vertex_count);
  }
  return weights_eigenfunctions(m, count, &whole, values, functions);
}
