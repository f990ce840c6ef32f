# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles, each a set of vertices, and the weights between them."""

import numpy

from .arrays import as_indices
from .declarations import CHandles
from .errors import ExemplarError, check
from .library import library
from .progress import ProgressCallback


class Handles:
    """kinds [H], vertex_sets: for each handle its vertices."""

    def __init__(self, kinds, vertex_sets):
        if len(kinds) != len(vertex_sets):
            raise ExemplarError(f"{len(kinds)} handle kinds for {len(vertex_sets)} vertex sets")
        sets = [as_indices("vertices", vertices, numpy.uint32, (-1,)) for vertices in vertex_sets]
        self.kinds = numpy.ascontiguousarray(kinds, numpy.int32)
        self.offsets = numpy.zeros(len(sets) + 1, numpy.uintp)
        numpy.cumsum([len(vertices) for vertices in sets], out=self.offsets[1:])
        self.vertices = numpy.concatenate(sets) if sets else numpy.empty(0, numpy.uint32)

    def __len__(self):
        return len(self.kinds)

    def as_struct(self):
        """Points into this object's arrays, which the caller keeps alive."""
        return CHandles(
            len(self.kinds),
            self.kinds.ctypes.data,
            self.offsets.ctypes.data,
            self.vertices.ctypes.data,
        )


def bounded_biharmonic(mesh, handles, progress=None):
    """Weights, float32 [H][V]."""
    weights = numpy.empty((len(handles), mesh.report.vertex_count), numpy.float32)
    with ProgressCallback(progress) as callback:
        status = library().exm_weights_bounded_biharmonic(
            mesh.handle, handles.as_struct(), callback, None, weights.ctypes.data
        )
        check(library(), status)
    return weights
