# SPDX-License-Identifier: GPL-3.0-or-later
"""Blended."""

from ctypes import POINTER, Structure, c_double, c_int32, c_size_t, c_void_p
from enum import IntEnum

from .common import ARRAY, DEFORMER, MESH, STATUS, Progress
from .deformer import CSolveReport
from .handles import CHandles


class Dictionary(IntEnum):
    EIGENFUNCTIONS = 0
    SKELETON = 1


class Begin(IntEnum):
    SPARSE = 0
    PLAIN = 1


class Scale(IntEnum):
    HELD = 0
    BALANCED = 1
    LEAST_SQUARES = 2


class CBlendedBindSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("dictionary", c_int32),
        ("dimension", c_int32),
        ("start_eigenfunction_count", c_size_t),
        ("eigenfunction_count", c_size_t),
        ("bone_count", c_size_t),
        ("cluster_count", c_size_t),
        ("atoms_kept", c_double),
        ("dictionary_exemplar_count", c_size_t),
        ("compared_exemplar_count", c_size_t),
        ("weights", c_void_p),
        ("smoothness", c_double),
        ("constraint_weight", c_double),
    ]


class CBlendedSolveSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("sparsity", c_double),
        ("begin", c_int32),
        ("scale", c_int32),
        ("start", c_int32),
        ("average_iterations", c_int32),
        ("minimal_iterations", c_int32),
        ("final_iterations", c_int32),
        ("tolerance", c_double),
        ("row_targets", c_void_p),
    ]


class CBlendedOutcome(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("scale", c_double),
        ("exemplar", c_size_t),
        ("average_energy", c_double),
        ("minimal_energy", c_double),
        ("final_energy", c_double),
        ("average_history", c_size_t * 2),
        ("minimal_history", c_size_t * 2),
        ("final_history", c_size_t * 2),
        ("begin_atom_count", c_size_t),
    ]


class CRows(Structure):
    _fields_ = [
        ("count", c_size_t),
        ("offsets", c_void_p),
        ("vertices", c_void_p),
        ("coefficients", c_void_p),
        ("weights", c_void_p),
    ]


class CBlendedInfo(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("row_count", c_size_t),
        ("bone_count", c_size_t),
        ("weight_count", c_size_t),
        ("start_atom_count", c_size_t),
        ("atom_count", c_size_t),
        ("whole_atom_count", c_size_t),
        ("reduction_error", c_double),
        ("decomposition_error", c_double),
    ]


FUNCTIONS = {
    # void exm_blended_bind_settings_init(exm_blended_bind_settings *settings);
    "exm_blended_bind_settings_init": (None, POINTER(CBlendedBindSettings)),
    # exm_status exm_blended_create(const exm_mesh *mesh, const float *exemplars,
    #                               size_t exemplar_count, const exm_handles *handles,
    #                               const exm_blended_bind_settings *settings,
    #                               exm_progress progress, void *user, exm_deformer **out);
    "exm_blended_create": (
        STATUS,
        MESH,
        ARRAY,
        c_size_t,
        POINTER(CHandles),
        POINTER(CBlendedBindSettings),
        Progress,
        c_void_p,
        POINTER(DEFORMER),
    ),
    # void exm_blended_solve_settings_init(exm_blended_solve_settings *settings);
    "exm_blended_solve_settings_init": (None, POINTER(CBlendedSolveSettings)),
    # exm_status exm_blended_solve(exm_deformer *deformer, const double *targets,
    #                              const exm_blended_solve_settings *settings,
    #                              exm_solve_report *report);
    "exm_blended_solve": (
        STATUS,
        DEFORMER,
        ARRAY,
        POINTER(CBlendedSolveSettings),
        POINTER(CSolveReport),
    ),
    # void exm_blended_outcome_init(exm_blended_outcome *outcome);
    "exm_blended_outcome_init": (None, POINTER(CBlendedOutcome)),
    # exm_status exm_blended_get_outcome(const exm_deformer *deformer,
    #                                    exm_blended_outcome *outcome);
    "exm_blended_get_outcome": (STATUS, DEFORMER, POINTER(CBlendedOutcome)),
    # exm_status exm_blended_add_rows(exm_deformer *deformer, const exm_rows *rows);
    "exm_blended_add_rows": (STATUS, DEFORMER, POINTER(CRows)),
    # exm_status exm_blended_remove_rows(exm_deformer *deformer, size_t first, size_t count);
    "exm_blended_remove_rows": (STATUS, DEFORMER, c_size_t, c_size_t),
    # exm_status exm_blended_weigh_rows(exm_deformer *deformer, size_t first, size_t count,
    #                                   const double *weights);
    "exm_blended_weigh_rows": (STATUS, DEFORMER, c_size_t, c_size_t, ARRAY),
    # exm_status exm_blended_weigh_handles(exm_deformer *deformer, const double *weights);
    "exm_blended_weigh_handles": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_blended_set_energies(exm_deformer *deformer, double constraint_weight,
    #                                     double smoothness);
    "exm_blended_set_energies": (STATUS, DEFORMER, c_double, c_double),
    # void exm_blended_info_init(exm_blended_info *info);
    "exm_blended_info_init": (None, POINTER(CBlendedInfo)),
    # exm_status exm_blended_get_info(const exm_deformer *deformer, exm_blended_info *info);
    "exm_blended_get_info": (STATUS, DEFORMER, POINTER(CBlendedInfo)),
    # exm_status exm_blended_weights(const exm_deformer *deformer, float *weights);
    "exm_blended_weights": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_blended_clusters(const exm_deformer *deformer, uint32_t *clusters);
    "exm_blended_clusters": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_blended_result_pose(const exm_deformer *deformer, double *targets);
    "exm_blended_result_pose": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_blended_key_size(const exm_deformer *deformer, size_t *size);
    "exm_blended_key_size": (STATUS, DEFORMER, POINTER(c_size_t)),
    # exm_status exm_blended_get_key(const exm_deformer *deformer, double *key);
    "exm_blended_get_key": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_blended_interpolate(exm_deformer *deformer, const double *keys,
    #                                    const double *times, size_t count, double time);
    "exm_blended_interpolate": (STATUS, DEFORMER, ARRAY, ARRAY, c_size_t, c_double),
}
