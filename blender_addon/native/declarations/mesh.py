# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes."""

from ctypes import POINTER, Structure, c_char_p, c_double, c_int, c_size_t, c_uint32
from enum import IntEnum

from .common import ARRAY, MESH, STATUS


class Flaw(IntEnum):
    NON_MANIFOLD_EDGE = 0
    DEGENERATE_FACE = 1
    LOOSE_VERTEX = 2


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


FUNCTIONS = {
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
    # exm_status exm_mesh_disc(const exm_mesh *mesh, uint32_t vertex, double radius,
    #                          size_t capacity, uint32_t *vertices, double *coefficients,
    #                          size_t *count);
    "exm_mesh_disc": (
        STATUS,
        MESH,
        c_uint32,
        c_double,
        c_size_t,
        ARRAY,
        ARRAY,
        POINTER(c_size_t),
    ),
    # exm_status exm_mesh_differential(const exm_mesh *mesh, uint32_t vertex, size_t capacity,
    #                                  uint32_t *vertices, double *coefficients, size_t *count);
    "exm_mesh_differential": (
        STATUS,
        MESH,
        c_uint32,
        c_size_t,
        ARRAY,
        ARRAY,
        POINTER(c_size_t),
    ),
}
