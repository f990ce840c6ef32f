# SPDX-License-Identifier: GPL-3.0-or-later
"""What every kind of deformer shares."""

from ctypes import POINTER, Structure, c_double, c_int32, c_size_t, c_void_p
from enum import IntEnum

from .common import ARRAY, DEFORMER, STATUS


class DeformerKind(IntEnum):
    AMRAP = 0
    BLENDED = 1
    RIGIDITY = 2


class Start(IntEnum):
    STATELESS = 0
    WARM = 1
    POSITIONS = 2


class CSolveReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("converged", c_int32),
        ("iterations", c_int32),
        ("objective", c_double),
        ("elastic_energy", c_double),
        ("constraint_residual", c_double),
        ("optimality_gap", c_double),
        ("seconds", c_double),
        ("history", c_void_p),
        ("history_capacity", c_size_t),
        ("history_count", c_size_t),
    ]


class CDeformerInfo(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("vertex_count", c_size_t),
        ("handle_count", c_size_t),
        ("exemplar_count", c_size_t),
        ("edge_group_count", c_size_t),
        ("coefficient_count", c_size_t),
        ("dimension", c_int32),
        ("bind_seconds", c_double),
        ("weight_seconds", c_double),
        ("kind", c_int32),
    ]


FUNCTIONS = {
    # void exm_solve_report_init(exm_solve_report *report);
    "exm_solve_report_init": (None, POINTER(CSolveReport)),
    # void exm_deformer_info_init(exm_deformer_info *info);
    "exm_deformer_info_init": (None, POINTER(CDeformerInfo)),
    # exm_status exm_deformer_get_info(const exm_deformer *deformer, exm_deformer_info *info);
    "exm_deformer_get_info": (STATUS, DEFORMER, POINTER(CDeformerInfo)),
    # exm_status exm_deformer_handle_pose(const exm_deformer *deformer, size_t exemplar,
    #                                     double *targets);
    "exm_deformer_handle_pose": (STATUS, DEFORMER, c_size_t, ARRAY),
    # exm_status exm_deformer_positions(const exm_deformer *deformer, int32_t thread_count,
    #                                   float *positions);
    "exm_deformer_positions": (STATUS, DEFORMER, c_int32, ARRAY),
    # exm_status exm_deformer_positions_f64(const exm_deformer *deformer, double *positions);
    "exm_deformer_positions_f64": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_deformer_weights(const exm_deformer *deformer, float *weights);
    "exm_deformer_weights": (STATUS, DEFORMER, ARRAY),
    # void exm_deformer_destroy(exm_deformer *deformer);
    "exm_deformer_destroy": (None, DEFORMER),
}
