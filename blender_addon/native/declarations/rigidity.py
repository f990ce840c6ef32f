# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigidity."""

from ctypes import POINTER, Structure, c_double, c_int32, c_size_t, c_void_p

from .common import ARRAY, DEFORMER, MESH, STATUS, Progress
from .deformer import CSolveReport
from .handles import CHandles

RADIUS_MAX = 64


class CRigidityBindSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("radii", c_void_p),
        ("radius", c_int32),
        ("handle_size", c_double),
    ]


class CRigiditySolveSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("start", c_int32),
        ("positions", c_void_p),
        ("tolerance", c_double),
        ("iterations", c_int32),
        ("acceleration", c_int32),
        ("coarse_start", c_int32),
        ("thread_count", c_int32),
    ]


class CRigidityLearnSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("radius_min", c_int32),
        ("radius_max", c_int32),
        ("omega", c_double),
    ]


FUNCTIONS = {
    # void exm_rigidity_bind_settings_init(exm_rigidity_bind_settings *settings);
    "exm_rigidity_bind_settings_init": (None, POINTER(CRigidityBindSettings)),
    # exm_status exm_rigidity_create(const exm_mesh *mesh, const exm_handles *handles,
    #                                const exm_rigidity_bind_settings *settings,
    #                                exm_progress progress, void *user, exm_deformer **out);
    "exm_rigidity_create": (
        STATUS,
        MESH,
        POINTER(CHandles),
        POINTER(CRigidityBindSettings),
        Progress,
        c_void_p,
        POINTER(DEFORMER),
    ),
    # exm_status exm_rigidity_set_radii(exm_deformer *deformer, const int32_t *radii,
    #                                   int32_t radius, exm_progress progress, void *user);
    "exm_rigidity_set_radii": (STATUS, DEFORMER, ARRAY, c_int32, Progress, c_void_p),
    # exm_status exm_rigidity_set_handles(exm_deformer *deformer, const exm_handles *handles,
    #                                     exm_progress progress, void *user);
    "exm_rigidity_set_handles": (STATUS, DEFORMER, POINTER(CHandles), Progress, c_void_p),
    # exm_status exm_rigidity_get_radii(const exm_deformer *deformer, int32_t *radii);
    "exm_rigidity_get_radii": (STATUS, DEFORMER, ARRAY),
    # void exm_rigidity_solve_settings_init(exm_rigidity_solve_settings *settings);
    "exm_rigidity_solve_settings_init": (None, POINTER(CRigiditySolveSettings)),
    # exm_status exm_rigidity_solve(exm_deformer *deformer, const double *targets,
    #                               const exm_rigidity_solve_settings *settings,
    #                               exm_solve_report *report);
    "exm_rigidity_solve": (
        STATUS,
        DEFORMER,
        ARRAY,
        POINTER(CRigiditySolveSettings),
        POINTER(CSolveReport),
    ),
    # exm_status exm_rigidity_rotations(const exm_deformer *deformer, double *rotations);
    "exm_rigidity_rotations": (STATUS, DEFORMER, ARRAY),
    # exm_status exm_rigidity_energies(const exm_deformer *deformer, double *energies);
    "exm_rigidity_energies": (STATUS, DEFORMER, ARRAY),
    # void exm_rigidity_learn_settings_init(exm_rigidity_learn_settings *settings);
    "exm_rigidity_learn_settings_init": (None, POINTER(CRigidityLearnSettings)),
    # exm_status exm_rigidity_learn(const exm_mesh *mesh, const float *poses, size_t pose_count,
    #                               const exm_rigidity_learn_settings *settings,
    #                               exm_progress progress, void *user,
    #                               int32_t *radii, double *energies);
    "exm_rigidity_learn": (
        STATUS,
        MESH,
        ARRAY,
        c_size_t,
        POINTER(CRigidityLearnSettings),
        Progress,
        c_void_p,
        ARRAY,
        ARRAY,
    ),
}
