# SPDX-License-Identifier: GPL-3.0-or-later
"""AMRAP."""

from ctypes import POINTER, Structure, c_double, c_int32, c_size_t, c_void_p
from enum import IntEnum

from .common import ARRAY, DEFORMER, MESH, STATUS, Progress
from .deformer import CSolveReport
from .handles import CHandles


class Blend(IntEnum):
    LOCAL = 0
    GLOBAL = 1


class Descent(IntEnum):
    AUTO = 0
    PLAIN = 1
    TRUST_REGION = 2


class CAmrapBindSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("edge_group_count", c_size_t),
        ("dimension", c_int32),
        ("weights", c_void_p),
    ]


class CAmrapSolveSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("lambda_", c_double),
        ("blend", c_int32),
        ("rotations", c_int32),
        ("start", c_int32),
        ("descent", c_int32),
        ("iterations", c_int32),
        ("tolerance", c_double),
    ]


FUNCTIONS = {
    # void exm_amrap_bind_settings_init(exm_amrap_bind_settings *settings);
    "exm_amrap_bind_settings_init": (None, POINTER(CAmrapBindSettings)),
    # exm_status exm_amrap_create(const exm_mesh *mesh, const float *exemplars,
    #                             size_t exemplar_count, const exm_handles *handles,
    #                             const exm_amrap_bind_settings *settings,
    #                             exm_progress progress, void *user, exm_deformer **out);
    "exm_amrap_create": (
        STATUS,
        MESH,
        ARRAY,
        c_size_t,
        POINTER(CHandles),
        POINTER(CAmrapBindSettings),
        Progress,
        c_void_p,
        POINTER(DEFORMER),
    ),
    # void exm_amrap_solve_settings_init(exm_amrap_solve_settings *settings);
    "exm_amrap_solve_settings_init": (None, POINTER(CAmrapSolveSettings)),
    # exm_status exm_amrap_solve(exm_deformer *deformer, const double *targets,
    #                            const exm_amrap_solve_settings *settings,
    #                            exm_solve_report *report);
    "exm_amrap_solve": (
        STATUS,
        DEFORMER,
        ARRAY,
        POINTER(CAmrapSolveSettings),
        POINTER(CSolveReport),
    ),
    # exm_status exm_amrap_blend_weights(const exm_deformer *deformer, double *blend);
    "exm_amrap_blend_weights": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_amrap_blend_average(const exm_deformer *deformer, double *average);
    "exm_amrap_blend_average": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_amrap_edge_groups(const exm_deformer *deformer, uint32_t *groups);
    "exm_amrap_edge_groups": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_amrap_rotations(const exm_deformer *deformer, double *rotations);
    "exm_amrap_rotations": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_amrap_exemplar_energies(const exm_deformer *deformer, double *energies);
    "exm_amrap_exemplar_energies": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_amrap_exemplar_positions(const exm_deformer *deformer, size_t exemplar,
    #                                         double *positions);
    "exm_amrap_exemplar_positions": (STATUS, DEFORMER, c_size_t, ARRAY),
}
