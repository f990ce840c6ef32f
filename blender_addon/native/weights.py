# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions on a mesh that belong to it rather than to handles."""

import numpy

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
