# SPDX-License-Identifier: GPL-3.0-or-later
"""exemplar.h in ctypes: constants, structures and, beside each C signature, its types."""

from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_int,
    c_int32,
    c_size_t,
    c_uint32,
    c_void_p,
)
from enum import IntEnum

ABI_VERSION = 1


class Status(IntEnum):
    OK = 0
    WARNING_NOT_CONVERGED = 1
    WARNING_MESH = 2
    ERROR_ARGUMENT = -1
    ERROR_OUT_OF_MEMORY = -2
    ERROR_CANCELLED = -3
    ERROR_TOPOLOGY = -4
    ERROR_UNCONSTRAINED = -5
    ERROR_NUMERIC = -6
    ERROR_IO = -7
    ERROR_INTERNAL = -8


class Element(IntEnum):
    NONE = 0
    VERTEX = 1
    FACE = 2
    HANDLE = 3
    EXEMPLAR = 4


class Flaw(IntEnum):
    NON_MANIFOLD_EDGE = 0
    DEGENERATE_FACE = 1
    LOOSE_VERTEX = 2


class Kind(IntEnum):
    PINNED = 0
    ORIENTED = 1
    FREE = 2


class DeformerKind(IntEnum):
    AMRAP = 0
    BLENDED = 1
    RIGIDITY = 2


class Start(IntEnum):
    STATELESS = 0
    WARM = 1


class Blend(IntEnum):
    LOCAL = 0
    GLOBAL = 1


class Descent(IntEnum):
    AUTO = 0
    PLAIN = 1
    TRUST_REGION = 2


class CMeshReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("vertex_count", c_size_t),
        ("triangle_count", c_size_t),
        ("component_count", c_size_t),
        ("boundary_edge_count", c_size_t),
        ("non_manifold_edge_count", c_size_t),
        ("degenerate_face_count", c_size_t),
        ("loose_vertex_count", c_size_t),
        ("diagonal", c_double),
    ]


class CHandles(Structure):
    _fields_ = [
        ("count", c_size_t),
        ("kinds", c_void_p),
        ("vertex_offsets", c_void_p),
        ("vertices", c_void_p),
    ]


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


# int (*exm_progress)(void *user, double fraction, const char *stage);
Progress = CFUNCTYPE(c_int, c_void_p, c_double, c_char_p)

# Arrays are passed as addresses (see arrays.py), because typed pointers cost more than the call.
ARRAY = c_void_p
MESH = c_void_p
DEFORMER = c_void_p
STATUS = c_int32

FUNCTIONS = {
    # uint32_t exm_abi_version(void);
    "exm_abi_version": (c_uint32,),
    # const char *exm_version(void);
    "exm_version": (c_char_p,),
    # const char *exm_last_error(void);
    "exm_last_error": (c_char_p,),
    # void exm_last_error_element(exm_element *kind, size_t *index);
    "exm_last_error_element": (None, POINTER(c_int), POINTER(c_size_t)),
    # void exm_mesh_report_init(exm_mesh_report *report);
    "exm_mesh_report_init": (None, POINTER(CMeshReport)),
    # exm_status exm_mesh_create(const float *positions, size_t vertex_count,
    #                            const uint32_t *triangles,
    #                            size_t triangle_count, exm_mesh **out);
    "exm_mesh_create": (STATUS, ARRAY, c_size_t, ARRAY, c_size_t, POINTER(MESH)),
    # exm_status exm_mesh_read(const char *path, exm_mesh **out);
    "exm_mesh_read": (STATUS, c_char_p, POINTER(MESH)),
    # void exm_mesh_destroy(exm_mesh *mesh);
    "exm_mesh_destroy": (None, MESH),
    # exm_status exm_mesh_get_report(const exm_mesh *mesh, exm_mesh_report *report);
    "exm_mesh_get_report": (STATUS, MESH, POINTER(CMeshReport)),
    # exm_status exm_mesh_get_arrays(const exm_mesh *mesh, float *positions, uint32_t *triangles);
    "exm_mesh_get_arrays": (STATUS, MESH, ARRAY, ARRAY),
    # exm_status exm_mesh_flaws(const exm_mesh *mesh, exm_mesh_flaw flaw, uint32_t *elements,
    #                           size_t capacity, size_t *count);
    "exm_mesh_flaws": (STATUS, MESH, c_int, ARRAY, c_size_t, POINTER(c_size_t)),
    # exm_status exm_mesh_cotangents(const exm_mesh *mesh, double *cotangents);
    "exm_mesh_cotangents": (STATUS, MESH, ARRAY),
    # exm_status exm_weights_bounded_biharmonic(const exm_mesh *mesh, const exm_handles *handles,
    #                                           exm_progress progress, void *user, float *weights);
    "exm_weights_bounded_biharmonic": (STATUS, MESH, POINTER(CHandles), Progress, c_void_p, ARRAY),
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


def declare(library):
    """Give every function its types. Raises AttributeError where the library lacks one."""
    for name, (result, *arguments) in FUNCTIONS.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = arguments


def initialised(library, structure, initialise, **values):
    """A structure as its _init function leaves it, then changed field by field."""
    filled = structure()
    getattr(library, initialise)(filled)
    for name, value in values.items():
        setattr(filled, name, value)
    return filled
