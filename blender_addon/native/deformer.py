# SPDX-License-Identifier: GPL-3.0-or-later
"""Deformers: bind once, solve often."""

import threading
from ctypes import byref, c_void_p
from dataclasses import dataclass, field

import numpy

from .arrays import as_input, as_output
from .declarations import (
    Blend,
    CAmrapBindSettings,
    CAmrapSolveSettings,
    CDeformerInfo,
    CSolveReport,
    Descent,
    Start,
    initialised,
)
from .errors import check
from .library import library
from .progress import ProgressCallback


@dataclass(frozen=True)
class DeformerInfo:
    vertex_count: int
    handle_count: int
    exemplar_count: int
    edge_group_count: int
    coefficient_count: int
    dimension: int
    bind_seconds: float
    weight_seconds: float
    kind: int  # DeformerKind


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


@dataclass(frozen=True)
class SolveReport:
    converged: bool
    iterations: int
    objective: float
    elastic_energy: float
    constraint_residual: float
    optimality_gap: float
    seconds: float
    history: numpy.ndarray = field(repr=False)
    warning: str  # "" or a sentence


class Deformer:
    """What every kind of deformer can do.

    The library allows a deformer one thread at a time, and ctypes lets other threads run during a
    call: `lock` is held around every call, and by callers who need two of them to belong together.
    """

    def __init__(self, handle, loaded):
        self._handle = handle
        self._library = loaded
        self.lock = threading.RLock()
        info = initialised(loaded, CDeformerInfo, "exm_deformer_info_init")
        check(loaded, loaded.exm_deformer_get_info(handle, info))
        self.info = DeformerInfo(
            *(getattr(info, name) for name in DeformerInfo.__dataclass_fields__)
        )

    def _call(self, name, *arguments):
        with self.lock:
            if not self._handle:
                raise ValueError("the deformer was closed")
            return check(self._library, getattr(self._library, name)(self._handle, *arguments))

    def _read(self, name, dtype, shape, *arguments):
        out = numpy.empty(shape, dtype)
        self._call(name, *arguments, out.ctypes.data)
        return out

    def positions(self, out=None, thread_count=0):
        """float32 [V][3]"""
        shape = (self.info.vertex_count, 3)
        out = as_output("out", out, numpy.float32, shape)
        self._call("exm_deformer_positions", thread_count, out.ctypes.data)
        return out

    def positions_f64(self):
        return self._read("exm_deformer_positions_f64", numpy.float64, (self.info.vertex_count, 3))

    def handle_pose(self, exemplar):
        """Targets that exemplar `exemplar` meets: float64 [H][3][4]."""
        shape = (self.info.handle_count, 3, 4)
        return self._read("exm_deformer_handle_pose", numpy.float64, shape, exemplar)

    def weights(self):
        """float32 [H][V]"""
        shape = (self.info.handle_count, self.info.vertex_count)
        return self._read("exm_deformer_weights", numpy.float32, shape)

    def close(self):
        with self.lock:
            handle, self._handle = self._handle, None
            if handle:
                self._library.exm_deformer_destroy(handle)

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.close()

    def __del__(self):
        if getattr(self, "_handle", None):
            self.close()


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
        targets = as_input("targets", targets, numpy.float64, (self.info.handle_count, 3, 4))
        history = numpy.empty(history_capacity, numpy.float64)
        report = initialised(
            self._library,
            CSolveReport,
            "exm_solve_report_init",
            history=history.ctypes.data if history_capacity else None,
            history_capacity=history_capacity,
        )
        native = initialised(
            self._library,
            CAmrapSolveSettings,
            "exm_amrap_solve_settings_init",
            **{name: value for name, value in vars(settings).items() if value is not None},
        )
        warning = self._call("exm_amrap_solve", targets.ctypes.data, native, report)
        return SolveReport(
            bool(report.converged),
            report.iterations,
            report.objective,
            report.elastic_energy,
            report.constraint_residual,
            report.optimality_gap,
            report.seconds,
            history[: report.history_count],
            warning,
        )

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
