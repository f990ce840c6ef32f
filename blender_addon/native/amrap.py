# SPDX-License-Identifier: GPL-3.0-or-later
"""As-multi-rigid-as-possible deformation."""

from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_input
from .declarations import (
    Blend,
    CAmrapBindSettings,
    CAmrapSolveSettings,
    Descent,
    Start,
    initialised,
)
from .deformer import Deformer, given
from .errors import check
from .library import library
from .progress import ProgressCallback


@dataclass(frozen=True)
class AmrapSettings:
    """Solve-time settings; None leaves the library's default."""

    lambda_: float = None
    blend: Blend = None
    rotations: bool = None
    start: Start = Start.STATELESS
    descent: Descent = None
    iterations: int = None
    tolerance: float = None


class Amrap(Deformer):
    """As-multi-rigid-as-possible deformation of `mesh` in the space of `exemplars` [S][V][3].

    handles           Handles
    edge_group_count  0: twice the handle count
    dimension         0: 2 for a flat mesh with flat exemplars, else 3
    weights           float32 [H][V] instead of bounded biharmonic ones
    progress          called with (fraction, stage); returns True to cancel
    """

    def __init__(
        self,
        mesh,
        exemplars,
        handles,
        edge_group_count=0,
        dimension=0,
        weights=None,
        progress=None,
    ):
        loaded = library()
        vertex_count = mesh.report.vertex_count
        exemplars = as_input("exemplars", exemplars, numpy.float32, (-1, vertex_count, 3))
        if weights is not None:
            weights = as_input("weights", weights, numpy.float32, (len(handles), vertex_count))
        settings = initialised(
            loaded,
            CAmrapBindSettings,
            "exm_amrap_bind_settings_init",
            edge_group_count=edge_group_count,
            dimension=dimension,
            weights=None if weights is None else weights.ctypes.data,
        )
        handle = c_void_p()
        with ProgressCallback(progress) as callback:
            status = loaded.exm_amrap_create(
                mesh.handle,
                exemplars.ctypes.data,
                len(exemplars),
                handles.as_struct(),
                settings,
                callback,
                None,
                byref(handle),
            )
            self.warning = check(loaded, status)
        super().__init__(handle, loaded)

    def solve(self, targets, settings=AmrapSettings(), history_capacity=0):
        """Solve for targets [H][3][4]; returns a SolveReport."""
        native = initialised(
            self._library, CAmrapSolveSettings, "exm_amrap_solve_settings_init", **given(settings)
        )
        return self._solve("exm_amrap_solve", targets, native, history_capacity)

    def blend_weights(self):
        """float64 [G][S]"""
        shape = (self.info.edge_group_count, self.info.exemplar_count)
        return self._read("exm_amrap_blend_weights", numpy.float64, shape)

    def blend_average(self):
        """float64 [S]"""
        return self._read("exm_amrap_blend_average", numpy.float64, self.info.exemplar_count)

    def edge_groups(self):
        """uint32 [V]"""
        return self._read("exm_amrap_edge_groups", numpy.uint32, self.info.vertex_count)

    def rotations(self):
        """float64 [G][S][3][3]"""
        shape = (self.info.edge_group_count, self.info.exemplar_count, 3, 3)
        return self._read("exm_amrap_rotations", numpy.float64, shape)

    def exemplar_energies(self):
        """float64 [G][S]"""
        shape = (self.info.edge_group_count, self.info.exemplar_count)
        return self._read("exm_amrap_exemplar_energies", numpy.float64, shape)

    def exemplar_positions(self, exemplar):
        """float64 [V][3]"""
        shape = (self.info.vertex_count, 3)
        return self._read("exm_amrap_exemplar_positions", numpy.float64, shape, exemplar)
