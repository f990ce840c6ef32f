# SPDX-License-Identifier: GPL-3.0-or-later
"""Bound characters, and drags of them timed inside and outside of the library."""

import ctypes
import sys

import numpy

import inputs
from measure import clock

sys.path.insert(0, str(inputs.ROOT))

from blender_addon import native  # noqa: E402
from blender_addon.native.declarations import (  # noqa: E402
    CAmrapSolveSettings,
    CSolveReport,
    initialised,
)


def bind(character, weights=None):
    """Every handle pinned."""
    mesh = native.Mesh(character.positions, character.triangles)
    return native.Amrap(mesh, character.exemplars, handles_of(character), weights=weights)


def handles_of(character):
    return native.Handles([native.Kind.PINNED] * len(character.handles), character.handles)


def bind_seconds(character, weights=None):
    """A measurement for interleave(): (seconds by the wall clock). The mesh is made before."""
    mesh = native.Mesh(character.positions, character.triangles)
    handles = handles_of(character)

    def run():
        start = clock()
        deformer = native.Amrap(mesh, character.exemplars, handles, weights=weights)
        seconds = clock() - start
        deformer.close()
        return seconds

    return run


class Drag:
    """Frame after frame of a drag, in one mode, for one deformer that nobody else solves with.

    solve() is a measurement for interleave(): processor time, seen from outside. The C function is
    called as directly as can be, for the clock to see little but the library. report.seconds, which
    is time on the wall, is kept beside it: on an idle machine they agree.
    """

    def __init__(self, deformer, targets, start):
        self.deformer = deformer
        self.targets = targets
        self.frame = -1
        self.inside, self.outside = [], []
        self._library = native.library()
        self._settings = initialised(
            self._library, CAmrapSolveSettings, "exm_amrap_solve_settings_init", start=start
        )
        self._report = initialised(self._library, CSolveReport, "exm_solve_report_init")
        self._handle = deformer._handle  # the door's own method costs as much as a small solve
        self._positions = numpy.empty((deformer.info.vertex_count, 3), numpy.float32)
        # The first solve of a warm drag has nothing to go on from.
        self.solve()
        self.inside.clear()
        self.outside.clear()

    def solve(self):
        self.frame = (self.frame + 1) % len(self.targets)
        targets = self.targets[self.frame].ctypes.data
        settings, report = ctypes.byref(self._settings), ctypes.byref(self._report)
        start = clock()
        status = self._library.exm_amrap_solve(self._handle, targets, settings, report)
        self.outside.append(clock() - start)
        self._expect(status)
        self.inside.append(self._report.seconds)
        return self.outside[-1]

    def positions(self):
        start = clock()
        status = self._library.exm_deformer_positions(self._handle, 1, self._positions.ctypes.data)
        seconds = clock() - start
        self._expect(status)
        return seconds

    def positions_of_next(self):
        """Seconds of positions alone: what they cost depends on the frame."""
        self.solve()
        return self.positions()

    def frame_with_positions(self):
        """Seconds of a whole frame by the outside clock."""
        self.solve()
        return self.outside[-1] + self.positions()

    def _expect(self, status):
        if status != 0:
            raise RuntimeError(self._library.exm_last_error().decode())

    def notes(self):
        """How frames spread, and what the library's own clock says of them."""
        inside = numpy.median(self.inside) * 1e3
        within = numpy.percentile(self.outside, 95) * 1e3
        return f"95 % of frames within {within:.3g} ms; report.seconds {inside:.3g} ms"


def drag_of(deformer, character, frames):
    """Targets of inputs.drag() through this deformer's own exemplars."""
    poses = [deformer.handle_pose(s) for s in range(deformer.info.exemplar_count)]
    return inputs.drag(poses, character.diagonal, frames)
