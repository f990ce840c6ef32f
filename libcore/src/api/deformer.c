/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <string.h>

#include "api/checks.h"
#include "api/structs.h"

void exm_solve_report_init(exm_solve_report *report)
{
  if (report) {
    *report = (exm_solve_report){.struct_size = sizeof *report};
  }
}

void exm_deformer_info_init(exm_deformer_info *info)
{
  if (info) {
    *info = (exm_deformer_info){.struct_size = sizeof *info};
  }
}

exm_status exm_deformer_get_info(const exm_deformer *deformer, exm_deformer_info *info)
{
  TRY(check_pointer(deformer, "deformer"));
  TRY(check_pointer(info, "info"));
  return report_write(info, &deformer->info, sizeof deformer->info, "info");
}

exm_status exm_deformer_handle_pose(const exm_deformer *deformer, size_t exemplar, double *targets)
{
  TRY(check_pointer(deformer, "deformer"));
  TRY(check_pointer(targets, "targets"));
  TRY(check_exemplar(deformer, exemplar));
  deformer->methods->handle_pose(deformer, exemplar, targets);
  return EXM_OK;
}

exm_status exm_deformer_positions(const exm_deformer *deformer, int32_t thread_count, float *positions)
{
  TRY(check_pointer(deformer, "deformer"));
  TRY(check_pointer(positions, "positions"));
  if (thread_count < 0) {
    return status_set(EXM_ERROR_ARGUMENT, "thread_count is %d, not 0 or more", thread_count);
  }
  if (deformer->has_result) {
    deformer->methods->positions(deformer, thread_count, positions);
  } else {
    memcpy(positions, deformer->reference, 3 * deformer->info.vertex_count * sizeof(float));
  }
  return EXM_OK;
}

exm_status exm_deformer_positions_f64(const exm_deformer *deformer, double *positions)
{
  TRY(check_pointer(deformer, "deformer"));
  TRY(check_pointer(positions, "positions"));
  if (deformer->has_result) {
    deformer->methods->positions_f64(deformer, positions);
    return EXM_OK;
  }
  for (size_t i = 0; i < 3 * deformer->info.vertex_count; i++) {
    positions[i] = (double)deformer->reference[i];
  }
  return EXM_OK;
}

exm_status exm_deformer_weights(const exm_deformer *deformer, float *weights)
{
  TRY(check_pointer(deformer, "deformer"));
  TRY(check_pointer(weights, "weights"));
  if (!deformer->weights) {
    return status_set(EXM_ERROR_ARGUMENT, "deformer moves every vertex by itself: it has no skinning weights");
  }
  memcpy(weights, deformer->weights, deformer->info.handle_count * deformer->info.vertex_count * sizeof(float));
  return EXM_OK;
}

void exm_deformer_destroy(exm_deformer *deformer)
{
  deformer_destroy(deformer);
}
