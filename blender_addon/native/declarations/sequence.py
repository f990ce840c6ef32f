# SPDX-License-Identifier: GPL-3.0-or-later
"""Deforming mesh sequences."""

from ctypes import (
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_int32,
    c_size_t,
    c_uint64,
    c_void_p,
)
from enum import IntEnum

from .common import ARRAY, MESH, STATUS, Progress


class ShapeSpace(IntEnum):
    POSITIONS = 0
    GRADIENTS = 1
    LINEAR_ROTATION_INVARIANT = 2
    LENGTHS_ANGLES = 3
    PATCHES = 4


class CPins(Structure):
    _fields_ = [
        ("count", c_size_t),
        ("frames", c_void_p),
        ("positions", c_void_p),
    ]


class CSequenceFitSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("control_point_count", c_size_t),
        ("site_count", c_size_t),
        ("component_count", c_size_t),
        ("tolerance", c_double),
        ("cyclic", c_int32),
        ("pins", CPins),
        ("examples", c_void_p),
        ("example_count", c_size_t),
        ("cure_saddles", c_int32),
        ("window_size", c_size_t),
        ("window_overlap", c_size_t),
    ]


class CSequenceFitReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("control_point_count", c_size_t),
        ("site_count", c_size_t),
        ("component_count", c_size_t),
        ("diagonal", c_double),
        ("shape_error", c_double),
        ("pose_error", c_double),
        ("error", c_double),
        ("stress", c_double),
        ("seconds", c_double),
        ("saddle_count", c_size_t),
        ("acceleration", c_double),
    ]


class CSequenceInfo(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("vertex_count", c_size_t),
        ("triangle_count", c_size_t),
        ("held_frame_count", c_size_t),
        ("dimension", c_size_t),
        ("shape_space", c_int32),
        ("is_fitted", c_int32),
        ("cyclic", c_int32),
        ("window_count", c_size_t),
        ("frame_count", c_size_t),
        ("component_count", c_size_t),
    ]


class CSequenceWindow(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("first_frame", c_size_t),
        ("frame_count", c_size_t),
        ("control_point_count", c_size_t),
        ("knot_count", c_size_t),
        ("site_count", c_size_t),
        ("fitted_frame_count", c_size_t),
    ]


class CSequenceFileReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("file_size", c_uint64),
        ("frames_size", c_uint64),
        ("ratio", c_double),
    ]


SEQUENCE = c_void_p

FUNCTIONS = {
    # exm_status exm_sequence_create(const exm_mesh *mesh, int32_t shape_space,
    #                                exm_sequence **out);
    "exm_sequence_create": (STATUS, MESH, c_int32, POINTER(SEQUENCE)),
    # void exm_sequence_destroy(exm_sequence *sequence);
    "exm_sequence_destroy": (None, SEQUENCE),
    # exm_status exm_sequence_add_frame(exm_sequence *sequence, const float *positions,
    #                                   size_t vertex_count, const uint32_t *triangles,
    #                                   size_t triangle_count);
    "exm_sequence_add_frame": (STATUS, SEQUENCE, ARRAY, c_size_t, ARRAY, c_size_t),
    # exm_status exm_sequence_drop_frames(exm_sequence *sequence);
    "exm_sequence_drop_frames": (STATUS, SEQUENCE),
    # void exm_sequence_fit_settings_init(exm_sequence_fit_settings *settings);
    "exm_sequence_fit_settings_init": (None, POINTER(CSequenceFitSettings)),
    # void exm_sequence_fit_report_init(exm_sequence_fit_report *report);
    "exm_sequence_fit_report_init": (None, POINTER(CSequenceFitReport)),
    # exm_status exm_sequence_fit(exm_sequence *sequence,
    #                             const exm_sequence_fit_settings *settings,
    #                             exm_progress progress, void *user,
    #                             exm_sequence_fit_report *report);
    "exm_sequence_fit": (
        STATUS,
        SEQUENCE,
        POINTER(CSequenceFitSettings),
        Progress,
        c_void_p,
        POINTER(CSequenceFitReport),
    ),
    # void exm_sequence_info_init(exm_sequence_info *info);
    "exm_sequence_info_init": (None, POINTER(CSequenceInfo)),
    # exm_status exm_sequence_get_info(const exm_sequence *sequence, exm_sequence_info *info);
    "exm_sequence_get_info": (STATUS, SEQUENCE, POINTER(CSequenceInfo)),
    # void exm_sequence_window_init(exm_sequence_window *window);
    "exm_sequence_window_init": (None, POINTER(CSequenceWindow)),
    # exm_status exm_sequence_get_window(const exm_sequence *sequence, size_t window,
    #                                    exm_sequence_window *out);
    "exm_sequence_get_window": (STATUS, SEQUENCE, c_size_t, POINTER(CSequenceWindow)),
    # exm_status exm_sequence_evaluate(exm_sequence *sequence, double time, float *positions);
    "exm_sequence_evaluate": (STATUS, SEQUENCE, c_double, ARRAY),
    # exm_status exm_sequence_evaluate_f64(exm_sequence *sequence, double time,
    #                                      double *positions);
    "exm_sequence_evaluate_f64": (STATUS, SEQUENCE, c_double, ARRAY),
    # exm_status exm_sequence_derivative(exm_sequence *sequence, double time, int32_t order,
    #                                    double *derivative);
    "exm_sequence_derivative": (STATUS, SEQUENCE, c_double, c_int32, ARRAY),
    # exm_status exm_sequence_pose(exm_sequence *sequence, size_t window, const double *point,
    #                              float *positions);
    "exm_sequence_pose": (STATUS, SEQUENCE, c_size_t, ARRAY, ARRAY),
    # exm_status exm_sequence_curve(const exm_sequence *sequence, size_t window, double time,
    #                               double *point);
    "exm_sequence_curve": (STATUS, SEQUENCE, c_size_t, c_double, ARRAY),
    # exm_status exm_sequence_measure(exm_sequence *sequence, double *rms, double *largest);
    "exm_sequence_measure": (STATUS, SEQUENCE, ARRAY, ARRAY),
    # exm_status exm_sequence_get_frames(const exm_sequence *sequence, size_t window,
    #                                    double *positions, double *parameters,
    #                                    int32_t *pinned);
    "exm_sequence_get_frames": (STATUS, SEQUENCE, c_size_t, ARRAY, ARRAY, ARRAY),
    # exm_status exm_sequence_get_sites(const exm_sequence *sequence, size_t window,
    #                                   uint32_t *sites);
    "exm_sequence_get_sites": (STATUS, SEQUENCE, c_size_t, ARRAY),
    # exm_status exm_sequence_place(exm_sequence *sequence, const exm_pins *pins,
    #                               int32_t iterations, exm_sequence_fit_report *report);
    "exm_sequence_place": (
        STATUS,
        SEQUENCE,
        POINTER(CPins),
        c_int32,
        POINTER(CSequenceFitReport),
    ),
    # exm_status exm_sequence_get_curve(const exm_sequence *sequence, size_t window,
    #                                   double *points, double *knots);
    "exm_sequence_get_curve": (STATUS, SEQUENCE, c_size_t, ARRAY, ARRAY),
    # exm_status exm_sequence_move_control_points(exm_sequence *sequence, size_t window,
    #                                             size_t first, size_t count,
    #                                             const double *points);
    "exm_sequence_move_control_points": (
        STATUS,
        SEQUENCE,
        c_size_t,
        c_size_t,
        c_size_t,
        ARRAY,
    ),
    # exm_status exm_sequence_insert_control_point(exm_sequence *sequence, size_t window,
    #                                              size_t index, const double *point);
    "exm_sequence_insert_control_point": (STATUS, SEQUENCE, c_size_t, c_size_t, ARRAY),
    # exm_status exm_sequence_delete_control_point(exm_sequence *sequence, size_t window,
    #                                              size_t index);
    "exm_sequence_delete_control_point": (STATUS, SEQUENCE, c_size_t, c_size_t),
    # exm_status exm_sequence_draw(exm_sequence *sequence, size_t control_point_count,
    #                              const double *points, const double *knots,
    #                              size_t frame_count);
    "exm_sequence_draw": (STATUS, SEQUENCE, c_size_t, ARRAY, ARRAY, c_size_t),
    # exm_status exm_sequence_resample(exm_sequence *sequence, const double *times, size_t count);
    "exm_sequence_resample": (STATUS, SEQUENCE, ARRAY, c_size_t),
    # exm_status exm_sequence_convert_rate(exm_sequence *sequence, double ratio);
    "exm_sequence_convert_rate": (STATUS, SEQUENCE, c_double),
    # exm_status exm_sequence_loop(exm_sequence *sequence, double from, double to, size_t count);
    "exm_sequence_loop": (STATUS, SEQUENCE, c_double, c_double, c_size_t),
    # exm_status exm_sequence_add_pose(exm_sequence *sequence, const float *positions,
    #                                  const double *point);
    "exm_sequence_add_pose": (STATUS, SEQUENCE, ARRAY, ARRAY),
    # exm_status exm_sequence_transfer(exm_sequence *sequence, const float *source_examples,
    #                                  const exm_mesh *target, int32_t shape_space,
    #                                  const float *target_examples, size_t count,
    #                                  exm_sequence **out);
    "exm_sequence_transfer": (
        STATUS,
        SEQUENCE,
        ARRAY,
        MESH,
        c_int32,
        ARRAY,
        c_size_t,
        POINTER(SEQUENCE),
    ),
    # void exm_sequence_file_report_init(exm_sequence_file_report *report);
    "exm_sequence_file_report_init": (None, POINTER(CSequenceFileReport)),
    # exm_status exm_sequence_save(const exm_sequence *sequence, const char *path,
    #                              exm_sequence_file_report *report);
    "exm_sequence_save": (STATUS, SEQUENCE, c_char_p, POINTER(CSequenceFileReport)),
    # exm_status exm_sequence_load(const char *path, exm_sequence_file_report *report,
    #                              exm_sequence **out);
    "exm_sequence_load": (STATUS, c_char_p, POINTER(CSequenceFileReport), POINTER(SEQUENCE)),
}
