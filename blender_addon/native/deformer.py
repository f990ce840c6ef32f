# SPDX-License-Identifier: GPL-3.0-or-later
"""Deformers: bind once, solve often. What all kinds share; each has a file of its own."""

import threading
from dataclasses import dataclass, field

import numpy

from .arrays import as_input, as_output
from .declarations import CDeformerInfo, CSolveReport, Status, initialised
from .errors import check


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
    capped: bool = False  # a tolerance was asked for, and the iteration cap came first


def given(settings):
    """{field: value} of a settings dataclass; None stands for the library's default."""
    return {name: value for name, value in vars(settings).items() if value is not None}


class Deformer:
    """What every kind of deformer can do.

    The library allows a deformer one thread at a time, and ctypes lets other threads run during a
    call: `lock` is held around every call, and by callers who need two of them to belong together.
    """

    def __init__(self, handle, loaded):
        self._handle = handle
        self._library = loaded
        self.lock = threading.RLock()
        self._read_info()

    def _read_info(self):
        info = initialised(self._library, CDeformerInfo, "exm_deformer_info_init")
        self._call("exm_deformer_get_info", info)
        self.info = DeformerInfo(
            *(getattr(info, name) for name in DeformerInfo.__dataclass_fields__)
        )

    def _call(self, name, *arguments):
        with self.lock:
            return check(self._library, self._status(name, *arguments))

    def _status(self, name, *arguments):
        if not self._handle:
            raise ValueError("the deformer was closed")
        return getattr(self._library, name)(self._handle, *arguments)

    def _read(self, name, dtype, shape, *arguments):
        out = numpy.empty(shape, dtype)
        self._call(name, *arguments, out.ctypes.data)
        return out

    def _solve(self, name, targets, settings, history_capacity):
        """Call a kind's solve function; `settings` is its structure."""
        targets = as_input("targets", targets, numpy.float64, (self.info.handle_count, 3, 4))
        history = numpy.empty(history_capacity, numpy.float64)
        report = initialised(
            self._library,
            CSolveReport,
            "exm_solve_report_init",
            history=history.ctypes.data if history_capacity else None,
            history_capacity=history_capacity,
        )
        with self.lock:
            status = self._status(name, targets.ctypes.data, settings, report)
            warning = check(self._library, status)
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
            status == Status.WARNING_NOT_CONVERGED,
        )

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
