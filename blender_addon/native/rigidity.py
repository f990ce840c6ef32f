# SPDX-License-Identifier: GPL-3.0-or-later
"""As-rigid-as-possible deformation of adjustable stiffness, and learning that stiffness."""

from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_input
from .declarations import (
    CRigidityBindSettings,
    CRigidityLearnSettings,
    CRigiditySolveSettings,
    Start,
    initialised,
)
from .deformer import Deformer, given
from .errors import check
from .library import library
from .progress import ProgressCallback


@dataclass(frozen=True)
class RigiditySettings:
    """Solve-time settings; None leaves the library's default.

    coarse_start  -1: chosen by the mesh's size, 0: never, 1: always
    """

    start: Start = Start.STATELESS
    tolerance: float = None
    iterations: int = None
    acceleration: bool = None
    coarse_start: int = None
    thread_count: int = None


class Rigidity(Deformer):
    """As-rigid-as-possible deformation of `mesh` with neighbourhoods `radii` rings wide.

    handles      Handles
    radii        one integer, or [V] of them, from 1 to RADIUS_MAX
    handle_size  share of the mesh's diagonal that small handles spread over; None: the default
    progress     called with (fraction, stage); returns True to cancel

    Its one exemplar is the reference: handle_pose(0).
    """

    def __init__(self, mesh, handles, radii=1, handle_size=None, progress=None):
        loaded = library()
        each, radius = _radii(radii, mesh.report.vertex_count)
        settings = initialised(
            loaded,
            CRigidityBindSettings,
            "exm_rigidity_bind_settings_init",
            radii=None if each is None else each.ctypes.data,
            radius=radius,
        )
        if handle_size is not None:
            settings.handle_size = handle_size
        handle = c_void_p()
        with ProgressCallback(progress) as callback:
            status = loaded.exm_rigidity_create(
                mesh.handle, handles.as_struct(), settings, callback, None, byref(handle)
            )
            self.warning = check(loaded, status)
        super().__init__(handle, loaded)

    def solve(self, targets, settings=RigiditySettings(), history_capacity=0, positions=None):
        """Solve for targets [H][3][4]; returns a SolveReport.

        positions  [V][3] to start from with Start.POSITIONS
        """
        native = initialised(
            self._library,
            CRigiditySolveSettings,
            "exm_rigidity_solve_settings_init",
            **given(settings),
        )
        if positions is not None:
            shape = (self.info.vertex_count, 3)
            positions = as_input("positions", positions, numpy.float32, shape)
            native.positions = positions.ctypes.data
        return self._solve("exm_rigidity_solve", targets, native, history_capacity)

    def set_radii(self, radii, progress=None):
        """Other radii, without a bind. Keeps the last result."""
        each, radius = _radii(radii, self.info.vertex_count)
        address = None if each is None else each.ctypes.data
        with ProgressCallback(progress) as callback:
            self._call("exm_rigidity_set_radii", address, radius, callback, None)

    def set_handles(self, handles, progress=None):
        """Other handles, without a bind. Keeps the last result."""
        with self.lock, ProgressCallback(progress) as callback:
            self._call("exm_rigidity_set_handles", handles.as_struct(), callback, None)
            self._read_info()

    def radii(self):
        """int32 [V]"""
        return self._read("exm_rigidity_get_radii", numpy.int32, self.info.vertex_count)

    def rotations(self):
        """float64 [V][3][3]"""
        shape = (self.info.vertex_count, 3, 3)
        return self._read("exm_rigidity_rotations", numpy.float64, shape)

    def energies(self):
        """float64 [V]"""
        return self._read("exm_rigidity_energies", numpy.float64, self.info.vertex_count)


def _radii(radii, vertex_count):
    """(int32 [V], any) or (None, one for all)"""
    if numpy.ndim(radii) == 0:
        return None, int(radii)
    return as_input("radii", radii, numpy.int32, (vertex_count,)), 1


def learn_radii(mesh, poses, radius_min=None, radius_max=None, omega=None, progress=None):
    """Radii int32 [V] from poses [M][V][3] of the mesh, the reference not among them."""
    return _learn(mesh, poses, radius_min, radius_max, omega, progress)[0]


def radius_energies(mesh, poses, radius_min=None, radius_max=None, progress=None):
    """E_ARAP by radius, float64 [radius_max - radius_min + 1][V]: what learn_radii weighs."""
    return _learn(mesh, poses, radius_min, radius_max, None, progress)[1]


def _learn(mesh, poses, radius_min, radius_max, omega, progress):
    loaded = library()
    vertex_count = mesh.report.vertex_count
    poses = as_input("poses", poses, numpy.float32, (-1, vertex_count, 3))
    values = {"radius_min": radius_min, "radius_max": radius_max, "omega": omega}
    settings = initialised(
        loaded,
        CRigidityLearnSettings,
        "exm_rigidity_learn_settings_init",
        **{name: value for name, value in values.items() if value is not None},
    )
    radii = numpy.empty(vertex_count, numpy.int32)
    count = max(0, settings.radius_max - settings.radius_min + 1)
    energies = numpy.empty((count, vertex_count))
    with ProgressCallback(progress) as callback:
        status = loaded.exm_rigidity_learn(
            mesh.handle,
            poses.ctypes.data,
            len(poses),
            settings,
            callback,
            None,
            radii.ctypes.data,
            energies.ctypes.data,
        )
        check(loaded, status)
    return radii, energies
