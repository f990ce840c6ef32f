# SPDX-License-Identifier: GPL-3.0-or-later
"""Fast blended transformations."""

from ctypes import byref, c_size_t, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_indices, as_input
from .declarations import (
    Begin,
    CBlendedBindSettings,
    CBlendedInfo,
    CBlendedOutcome,
    CBlendedSolveSettings,
    CRows,
    Dictionary,
    Scale,
    Start,
    initialised,
)
from .deformer import Deformer, given
from .errors import ExemplarError, check
from .library import library
from .progress import ProgressCallback


@dataclass(frozen=True)
class BlendedBinding:
    """Bind-time settings; None leaves the library's default."""

    dictionary: Dictionary = None
    dimension: int = None
    start_eigenfunction_count: int = None
    eigenfunction_count: int = None
    bone_count: int = None
    cluster_count: int = None
    atoms_kept: float = None
    dictionary_exemplar_count: int = None
    compared_exemplar_count: int = None
    smoothness: float = None
    constraint_weight: float = None


@dataclass(frozen=True)
class BlendedSettings:
    """Solve-time settings; None leaves the library's default."""

    sparsity: float = None
    begin: Begin = None
    scale: Scale = None
    start: Start = Start.STATELESS
    average_iterations: int = None
    minimal_iterations: int = None
    final_iterations: int = None
    tolerance: float = None


@dataclass(frozen=True)
class BlendedOutcome:
    scale: float
    exemplar: int
    average_energy: float
    minimal_energy: float
    final_energy: float
    average_history: slice  # of the report's history
    minimal_history: slice
    final_history: slice
    begin_atom_count: int


@dataclass(frozen=True)
class BlendedInfo:
    row_count: int
    bone_count: int
    weight_count: int
    start_atom_count: int
    atom_count: int
    whole_atom_count: int
    reduction_error: float
    decomposition_error: float


class Blended(Deformer):
    """Fast blended transformations of `mesh` in the space of `exemplars` [S][V][3].

    handles   Handles
    binding   BlendedBinding
    weights   float32 [bones][V]: skinning weights to use instead of a decomposition
    progress  called with (fraction, stage); returns True to cancel
    """

    def __init__(
        self, mesh, exemplars, handles, binding=BlendedBinding(), weights=None, progress=None
    ):
        loaded = library()
        vertex_count = mesh.report.vertex_count
        exemplars = as_input("exemplars", exemplars, numpy.float32, (-1, vertex_count, 3))
        values = given(binding)
        if weights is not None:
            weights = as_input("weights", weights, numpy.float32, (-1, vertex_count))
            values.update(weights=weights.ctypes.data, bone_count=len(weights))
        settings = initialised(
            loaded, CBlendedBindSettings, "exm_blended_bind_settings_init", **values
        )
        handle = c_void_p()
        with ProgressCallback(progress) as callback:
            status = loaded.exm_blended_create(
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

    def solve(self, targets, settings=BlendedSettings(), history_capacity=0, row_targets=None):
        """Solve for targets [H][3][4], and [rows][3] of the rows added; returns a SolveReport."""
        values = given(settings)
        with self.lock:
            if row_targets is not None:
                shape = (self.blended_info().row_count, 3)
                row_targets = as_input("row_targets", row_targets, numpy.float64, shape)
                values.update(row_targets=row_targets.ctypes.data)
            native = initialised(
                self._library,
                CBlendedSolveSettings,
                "exm_blended_solve_settings_init",
                **values,
            )
            return self._solve("exm_blended_solve", targets, native, history_capacity)

    def outcome(self):
        """BlendedOutcome of the last solve."""
        found = initialised(self._library, CBlendedOutcome, "exm_blended_outcome_init")
        self._call("exm_blended_get_outcome", byref(found))
        values = (getattr(found, name) for name in BlendedOutcome.__dataclass_fields__)
        return BlendedOutcome(
            *(v if isinstance(v, (int, float)) else slice(v[0], v[1]) for v in values)
        )

    def blended_info(self):
        found = initialised(self._library, CBlendedInfo, "exm_blended_info_init")
        self._call("exm_blended_get_info", byref(found))
        return BlendedInfo(*(getattr(found, name) for name in BlendedInfo.__dataclass_fields__))

    def add_rows(self, rows, weights=None):
        """Further linear constraints: pairs (vertices, coefficients), each a row."""
        vertices = [as_indices("vertices", row[0], numpy.uint32, (-1,)) for row in rows]
        coefficients = [as_input("coefficients", row[1], numpy.float64, (-1,)) for row in rows]
        for i, (own, values) in enumerate(zip(vertices, coefficients)):
            if len(own) != len(values):
                raise ExemplarError(
                    f"row {i} has {len(own)} vertices and {len(values)} coefficients"
                )
        if not rows:
            return
        offsets = numpy.zeros(len(rows) + 1, numpy.uintp)
        numpy.cumsum([len(own) for own in vertices], out=offsets[1:])
        vertices, coefficients = numpy.concatenate(vertices), numpy.concatenate(coefficients)
        if weights is not None:
            weights = as_input("weights", weights, numpy.float64, (len(rows),))
        native = CRows(
            len(rows),
            offsets.ctypes.data,
            vertices.ctypes.data,
            coefficients.ctypes.data,
            None if weights is None else weights.ctypes.data,
        )
        self._call("exm_blended_add_rows", byref(native))

    def remove_rows(self, first, count):
        self._call("exm_blended_remove_rows", first, count)

    def weigh_rows(self, first, weights):
        weights = as_input("weights", weights, numpy.float64, (-1,))
        self._call("exm_blended_weigh_rows", first, len(weights), weights.ctypes.data)

    def weigh_handles(self, weights=None):
        """[H]; 0 for a point that is not seen. None: all 1."""
        if weights is not None:
            weights = as_input("weights", weights, numpy.float64, (self.info.handle_count,))
        self._call("exm_blended_weigh_handles", None if weights is None else weights.ctypes.data)

    def set_energies(self, constraint_weight, smoothness):
        self._call("exm_blended_set_energies", constraint_weight, smoothness)

    def functions(self):
        """float32 [weight_count][V]: the constant, then eigenfunctions or the bones' weights."""
        shape = (self.blended_info().weight_count, self.info.vertex_count)
        return self._read("exm_blended_weights", numpy.float32, shape)

    def clusters(self):
        """uint32 [V]"""
        return self._read("exm_blended_clusters", numpy.uint32, self.info.vertex_count)

    def result_pose(self):
        """Where the last result has the handles, as targets: float64 [H][3][4]."""
        shape = (self.info.handle_count, 3, 4)
        return self._read("exm_blended_result_pose", numpy.float64, shape)

    def key(self):
        """The last solve's pose for interpolate(): float64, a one-dimensional array."""
        size = c_size_t()
        self._call("exm_blended_key_size", byref(size))
        return self._read("exm_blended_get_key", numpy.float64, size.value)

    def interpolate(self, keys, times, time):
        """The pose at `time` between keys of this deformer at rising times, smooth over all of
        them; read it with positions()."""
        keys = as_input("keys", keys, numpy.float64, (-1, -1))
        size = c_size_t()
        self._call("exm_blended_key_size", byref(size))
        keys = as_input("keys", keys, numpy.float64, (-1, size.value))
        times = as_input("times", times, numpy.float64, (len(keys),))
        self._call("exm_blended_interpolate", keys.ctypes.data, times.ctypes.data, len(keys), time)
