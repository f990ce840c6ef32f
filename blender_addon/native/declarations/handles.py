# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles, and the weights between them."""

from ctypes import POINTER, Structure, c_size_t, c_void_p
from enum import IntEnum

from .common import ARRAY, MESH, STATUS, Progress


class Kind(IntEnum):
    PINNED = 0
    ORIENTED = 1
    FREE = 2


class CHandles(Structure):
    _fields_ = [
        ("count", c_size_t),
        ("kinds", c_void_p),
        ("vertex_offsets", c_void_p),
        ("vertices", c_void_p),
    ]


FUNCTIONS = {
    # exm_status exm_weights_bounded_biharmonic(const exm_mesh *mesh, const exm_handles *handles,
    #                                           exm_progress progress, void *user, float *weights);
    "exm_weights_bounded_biharmonic": (STATUS, MESH, POINTER(CHandles), Progress, c_void_p, ARRAY),
}
