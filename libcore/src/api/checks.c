/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "api/checks.h"

#include <math.h>

#include "api/structs.h"

exm_status check_kind(const exm_deformer *deformer, exm_deformer_kind kind)
{
  static const char *const names[] = {"AMRAP", "Blended", "Rigidity"};
  TRY(check_pointer(deformer, "deformer"));
  if (deformer->info.kind != (int32_t)kind) {
    return status_set(EXM_ERROR_ARGUMENT, "deformer is of the kind %s, and the call is for %s",
                      names[deformer->info.kind], names[kind]);
  }
  return EXM_OK;
}

exm_status check_exemplar(const exm_deformer *deformer, size_t exemplar)
{
  if (exemplar >= deformer->info.exemplar_count) {
    return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_EXEMPLAR, exemplar,
                         "exemplar is %zu, but the deformer has %zu", exemplar, deformer->info.exemplar_count);
  }
  return EXM_OK;
}

exm_status check_shapes(const float *shapes, size_t count, size_t vertex_count, const char *several, const char *one)
{
  if (count == 0) {
    return status_set(EXM_ERROR_ARGUMENT, "%s_count is 0: there must be one at least", one);
  }
  if (count > SIZE_MAX / (3 * sizeof(double)) / vertex_count) {
    return status_no_memory(several);
  }
  for (size_t i = 0; i < count * vertex_count * 3; i++) {
    if (!isfinite(shapes[i])) {
      size_t const vertex = i / 3 % vertex_count;
      return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_VERTEX, vertex,
                           "%s: %s %zu has a coordinate that is not finite at vertex %zu", several, one,
                           i / 3 / vertex_count, vertex);
    }
  }
  return EXM_OK;
}

exm_status check_exemplars(const float *exemplars, size_t exemplar_count, size_t vertex_count)
{
  return check_shapes(exemplars, exemplar_count, vertex_count, "exemplars", "exemplar");
}

exm_status check_poses(const float *poses, size_t pose_count, size_t vertex_count)
{
  return check_shapes(poses, pose_count, vertex_count, "poses", "pose");
}

exm_status check_targets(const exm_deformer *deformer, const double *targets)
{
  for (size_t h = 0; h < deformer->info.handle_count; h++) {
    for (size_t i = 0; i < 12 && deformer->handle_kinds[h] != EXM_HANDLE_FREE; i++) {
      int const counts = i % 4 == 3 || deformer->handle_kinds[h] == EXM_HANDLE_ORIENTED;
      if (counts && !isfinite(targets[h * 12 + i])) {
        return status_set_at(EXM_ERROR_ARGUMENT, EXM_ELEMENT_HANDLE, h,
                             "targets: row %zu, column %zu of handle %zu is not finite", i / 4, i % 4, h);
      }
    }
  }
  return EXM_OK;
}

exm_status report_begin(exm_solve_report *ours, const exm_solve_report *theirs)
{
  exm_solve_report_init(ours);
  TRY(settings_read(ours, sizeof *ours, theirs, "report"));
  *ours = (exm_solve_report){
      .struct_size = sizeof *ours, .history = ours->history, .history_capacity = ours->history_capacity};
  return EXM_OK;
}
