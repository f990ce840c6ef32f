# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions on a mesh that belong to it rather than to handles."""

from ctypes import byref
from dataclasses import dataclass

import numpy

from .arrays import as_input
from .declarations import CDecomposeReport, CDecomposeSettings, initialised
from .errors import check
from .library import library
from .progress import ProgressCallback


def eigenfunctions(mesh, count, progress=None):
    """The first Laplace-Beltrami eigenvalues [count] and functions [count][V], float64; functions
    are orthonormal in the vertices' masses, thirds of the areas of their triangles."""
    values = numpy.empty(count, numpy.float64)
    functions = numpy.empty((count, mesh.report.vertex_count), numpy.float64)
    with ProgressCallback(progress) as callback:
        status = library().exm_weights_eigenfunctions(
            mesh.handle, count, callback, None, values.ctypes.data, functions.ctypes.data
        )
        check(library(), status)
    return values, functions


@dataclass(frozen=True)
class Decomposition:
    weights: numpy.ndarray  # float32 [bones][V]
    transforms: numpy.ndarray  # float64 [S][bones][3][4], rest pose to exemplar
    labels: numpy.ndarray  # uint32 [V] the bone of the largest weight
    begin_error: float
    error: float
    max_error: float
    iterations: int


def decompose(mesh, exemplars, progress=None, **settings):
    """Skinning weights and rigid bones from exemplars [S][V][3]: a Decomposition.

    settings: bone_count (0: chosen), tolerance, bone_limit, influences, iterations
    """
    loaded, vertex_count = library(), mesh.report.vertex_count
    exemplars = as_input("exemplars", exemplars, numpy.float32, (-1, vertex_count, 3))
    native = initialised(loaded, CDecomposeSettings, "exm_decompose_settings_init", **settings)
    report = initialised(loaded, CDecomposeReport, "exm_decompose_report_init")
    capacity = native.bone_count or native.bone_limit
    weights = numpy.empty((capacity, vertex_count), numpy.float32)
    transforms = numpy.empty((len(exemplars), capacity, 3, 4), numpy.float64)
    labels = numpy.empty(vertex_count, numpy.uint32)
    with ProgressCallback(progress) as callback:
        status = loaded.exm_weights_decompose(
            mesh.handle,
            exemplars.ctypes.data,
            len(exemplars),
            byref(native),
            callback,
            None,
            capacity,
            weights.ctypes.data,
            transforms.ctypes.data,
            labels.ctypes.data,
            byref(report),
        )
        check(loaded, status)
    found = report.bone_count
    return Decomposition(
        weights[:found],
        numpy.ascontiguousarray(transforms[:, :found]),
        labels,
        report.begin_error,
        report.error,
        report.max_error,
        report.iterations,
    )
