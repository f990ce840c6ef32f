# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights that belong to the mesh rather than to handles."""

from ctypes import c_size_t, c_void_p

from .common import ARRAY, MESH, STATUS, Progress

FUNCTIONS = {
    # exm_status exm_weights_eigenfunctions(const exm_mesh *mesh, size_t count,
    #                                       exm_progress progress, void *user, double *values,
    #                                       double *functions);
    "exm_weights_eigenfunctions": (STATUS, MESH, c_size_t, Progress, c_void_p, ARRAY, ARRAY),
}
