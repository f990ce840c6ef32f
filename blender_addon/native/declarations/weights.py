# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights that belong to the mesh rather than to handles."""

from ctypes import POINTER, Structure, c_double, c_int32, c_size_t, c_void_p

from .common import ARRAY, MESH, STATUS, Progress


class CDecomposeSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("bone_count", c_size_t),
        ("tolerance", c_double),
        ("bone_limit", c_size_t),
        ("influences", c_int32),
        ("iterations", c_int32),
    ]


class CDecomposeReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("bone_count", c_size_t),
        ("begin_error", c_double),
        ("error", c_double),
        ("max_error", c_double),
        ("iterations", c_int32),
    ]


FUNCTIONS = {
    # exm_status exm_weights_eigenfunctions(const exm_mesh *mesh, size_t count,
    #                                       exm_progress progress, void *user, double *values,
    #                                       double *functions);
    "exm_weights_eigenfunctions": (STATUS, MESH, c_size_t, Progress, c_void_p, ARRAY, ARRAY),
    # void exm_decompose_settings_init(exm_decompose_settings *settings);
    "exm_decompose_settings_init": (None, POINTER(CDecomposeSettings)),
    # void exm_decompose_report_init(exm_decompose_report *report);
    "exm_decompose_report_init": (None, POINTER(CDecomposeReport)),
    # exm_status exm_weights_decompose(const exm_mesh *mesh, const float *exemplars,
    #                                  size_t exemplar_count,
    #                                  const exm_decompose_settings *settings,
    #                                  exm_progress progress, void *user, size_t capacity,
    #                                  float *weights, double *transforms, uint32_t *labels,
    #                                  exm_decompose_report *report);
    "exm_weights_decompose": (
        STATUS,
        MESH,
        ARRAY,
        c_size_t,
        POINTER(CDecomposeSettings),
        Progress,
        c_void_p,
        c_size_t,
        ARRAY,
        ARRAY,
        ARRAY,
        POINTER(CDecomposeReport),
    ),
}
