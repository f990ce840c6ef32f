/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sequence/sequence.h"

#include <stdlib.h>
#include <string.h>

/** mesh_create takes single precision, in which the reference's positions came. */
static exm_status copy_mesh(const mesh *reference, mesh **out)
{
  arena scratch = {0};
  float(*positions)[3] = arena_array(&scratch, reference->vertex_count, sizeof *positions);
  exm_status status = positions ? EXM_OK : status_no_memory("the mesh");
  if (status >= 0) {
    for (size_t v = 0; v < reference->vertex_count; v++) {
      for (int k = 0; k < 3; k++) {
        positions[v][k] = (float)reference->positions[v][k];
      }
    }
    status = mesh_create((const float(*)[3])positions, reference->vertex_count,
                         (const uint32_t(*)[3])reference->triangles, reference->triangle_count, out);
  }
  arena_release(&scratch);
  return status < 0 ? status : EXM_OK;
}

exm_status sequence_create(const mesh *reference, int32_t kind, exm_sequence **out)
{
  exm_sequence *sequence = calloc(1, sizeof *sequence);
  if (!sequence) {
    return status_no_memory("the sequence");
  }
  sequence->kind = kind;
  exm_status status = copy_mesh(reference, &sequence->reference);
  if (status >= 0) {
    status = shape_space_create(kind, sequence->reference, &sequence->space);
  }
  if (status < 0) {
    sequence_destroy(sequence);
    return status;
  }
  *out = sequence;
  return EXM_OK;
}

exm_status sequence_add_frame(exm_sequence *sequence, const float *positions)
{
  size_t const bytes = 3 * sequence->reference->vertex_count * sizeof(float);
  if (sequence->frame_count == sequence->frame_capacity) {
    size_t const capacity = sequence->frame_capacity ? 2 * sequence->frame_capacity : 64;
    float **frames = realloc(sequence->frames, capacity * sizeof *frames);
    if (!frames) {
      return status_no_memory("the frames");
    }
    sequence->frames = frames;
    sequence->frame_capacity = capacity;
  }
  float *frame = malloc(bytes);
  if (!frame) {
    return status_set(EXM_ERROR_OUT_OF_MEMORY, "not enough memory for frame %zu", sequence->frame_count);
  }
  memcpy(frame, positions, bytes);
  sequence->frames[sequence->frame_count++] = frame;
  return EXM_OK;
}

void sequence_drop_frames(exm_sequence *sequence)
{
  for (size_t i = 0; i < sequence->frame_count; i++) {
    free(sequence->frames[i]);
  }
  free(sequence->frames);
  sequence->frames = NULL;
  sequence->frame_count = sequence->frame_capacity = 0;
}

void window_release(window *w)
{
  time_signal_release(&w->time);
  arena_release(&w->memory);
}

void signals_release(signals *fitted)
{
  if (fitted) {
    for (size_t i = 0; i < fitted->window_count; i++) {
      window_release(&fitted->windows[i]);
    }
    arena_release(&fitted->memory);
    free(fitted);
  }
}

static void release_scratch(exm_sequence *sequence)
{
  free(sequence->coordinates);
  free(sequence->more_coordinates);
  free(sequence->window_coordinates);
  free(sequence->encoded);
  free(sequence->positions);
}

exm_status sequence_adopt(exm_sequence *sequence, signals *fitted)
{
  int const is_decoded = sequence->space.methods != NULL;
  size_t const m = fitted->shape.component_count + 1, d = fitted->shape.dimension;
  exm_sequence fresh = *sequence;
  fresh.coordinates = calloc(m, sizeof(double));
  fresh.more_coordinates = calloc(m, sizeof(double));
  fresh.window_coordinates = calloc(m, sizeof(double));
  fresh.encoded = is_decoded ? calloc(d, sizeof(double)) : NULL;
  fresh.positions = is_decoded ? calloc(3 * sequence->reference->vertex_count, sizeof(double)) : NULL;
  if (!fresh.coordinates || !fresh.more_coordinates || !fresh.window_coordinates ||
      (is_decoded && (!fresh.encoded || !fresh.positions))) {
    release_scratch(&fresh);
    return status_no_memory("the sequence");
  }
  release_scratch(sequence);
  signals_release(sequence->fitted);
  fresh.fitted = fitted;
  *sequence = fresh;
  return EXM_OK;
}

void sequence_destroy(exm_sequence *sequence)
{
  if (sequence) {
    sequence_drop_frames(sequence);
    signals_release(sequence->fitted);
    release_scratch(sequence);
    shape_space_release(&sequence->space);
    mesh_destroy(sequence->reference);
    free(sequence);
  }
}
