/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A bar that walks through its poses, in frames of its own making. Beside the tests that include it: inline functions,
 * for not every test uses every one. */
#ifndef EXM_TESTS_SEQUENCE_FIXTURE_H
#define EXM_TESTS_SEQUENCE_FIXTURE_H

#include "harness.h"
#include "zoo.h"

typedef struct walk {
  zoo_mesh shape;
  exm_mesh *mesh;
  size_t frame_count, size; /* size: 3 V */
  float *frames;            /* [n][V][3] */
  double diagonal;
} walk;

/** Bend by one angle, twist by another, and let the tip tremble: a motion that no few components have exactly. */
static inline void walk_pose(const walk *w, double bend, double twist, double tremble, float *out)
{
  for (size_t v = 0; v < w->shape.vertex_count; v++) {
    const float *p = w->shape.positions[v];
    double const x = (double)p[0], share = x / 8, angle = bend * share, turn = twist * share;
    double const y = cos(turn) * ((double)p[1] - 0.5) - sin(turn) * ((double)p[2] - 0.5);
    double const z = sin(turn) * ((double)p[1] - 0.5) + cos(turn) * ((double)p[2] - 0.5);
    double const radius = fabs(bend) > 1e-9 ? 8 / bend : 0;
    out[3 * v] = (float)(fabs(bend) > 1e-9 ? (radius - y) * sin(angle) : x);
    out[3 * v + 1] = (float)(fabs(bend) > 1e-9 ? radius - (radius - y) * cos(angle) : y);
    out[3 * v + 2] = (float)(z + 0.05 * share * share * tremble);
  }
}

/** n frames; every `period` frames the motion comes by its beginning again. */
static inline void walk_begin(walk *w, size_t frame_count, double period)
{
  *w = (walk){.shape = zoo_bar(8, 1), .frame_count = frame_count};
  exm_mesh_report report;
  exm_mesh_report_init(&report);
  w->mesh = zoo_create(&w->shape);
  exm_mesh_get_report(w->mesh, &report);
  w->diagonal = report.diagonal;
  w->size = 3 * w->shape.vertex_count;
  w->frames = test_array(frame_count * w->size, sizeof(float));
  for (size_t i = 0; i < frame_count; i++) {
    double const phase = 2 * M_PI * (double)i / period;
    walk_pose(w, 1.2 * sin(phase), 0.9 * cos(phase), sin(5 * phase) + cos(3 * phase), w->frames + i * w->size);
  }
}

static inline exm_sequence *walk_sequence(const walk *w, int32_t space)
{
  exm_sequence *sequence = NULL;
  CHECK_STATUS(exm_sequence_create(w->mesh, space, &sequence), EXM_OK);
  for (size_t i = 0; i < w->frame_count && sequence; i++) {
    CHECK_STATUS(exm_sequence_add_frame(sequence, w->frames + i * w->size, w->shape.vertex_count, NULL, 0), EXM_OK);
  }
  return sequence;
}

static inline exm_sequence_fit_settings walk_settings(size_t k, size_t l, size_t m)
{
  exm_sequence_fit_settings settings;
  exm_sequence_fit_settings_init(&settings);
  settings.control_point_count = k;
  settings.site_count = l;
  settings.component_count = m;
  return settings;
}

static inline exm_sequence_window walk_window(const exm_sequence *sequence, size_t window)
{
  exm_sequence_window found;
  exm_sequence_window_init(&found);
  CHECK_STATUS(exm_sequence_get_window(sequence, window, &found), EXM_OK);
  return found;
}

/** Largest distance of a coordinate, over the diagonal. */
static inline double walk_distance(const walk *w, const double *positions, const float *frame)
{
  double most = 0;
  for (size_t i = 0; i < w->size; i++) {
    most = fmax(most, fabs(positions[i] - (double)frame[i]));
  }
  return most / w->diagonal;
}

/** The largest distance of any frame from where the sequence has it at its time. */
static inline double walk_error(const walk *w, exm_sequence *sequence)
{
  double *positions = test_array(w->size, sizeof(double)), most = 0;
  for (size_t i = 0; i < w->frame_count; i++) {
    CHECK_STATUS(exm_sequence_evaluate_f64(sequence, (double)i, positions), EXM_OK);
    most = fmax(most, walk_distance(w, positions, w->frames + i * w->size));
  }
  free(positions);
  return most;
}

static inline void walk_end(walk *w)
{
  exm_mesh_destroy(w->mesh);
  zoo_free(&w->shape);
  free(w->frames);
}

#endif
