# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast the mesh follows, for who asks: measured as it happens, kept for the last second."""

import time
from collections import deque
from dataclasses import dataclass

import bpy

SPAN = 1.0  # seconds

_frames = deque()  # (when it was done, our own seconds, seconds in the solver, iterations)


@dataclass(frozen=True)
class Figures:
    frames: int
    per_second: float  # 0.0 where there was but one
    own: float  # seconds a frame: empties, solve, positions, write
    solve: float  # of these in the solver
    iterations: float


def wanted():
    manager = bpy.context.window_manager
    return manager is not None and manager.exemplar_display.show_figures


def note(began, report):
    """A frame that began at `began` (perf_counter) is written."""
    now = time.perf_counter()
    _frames.append((now, now - began, report.seconds, report.iterations))
    while now - _frames[0][0] > SPAN:
        _frames.popleft()


def of_late():
    """Figures of the last second in which anything moved; None before the first."""
    if not _frames:
        return None
    count = len(_frames)
    span = _frames[-1][0] - _frames[0][0]
    own, solve, iterations = (sum(f[k] for f in _frames) / count for k in (1, 2, 3))
    return Figures(count, (count - 1) / span if span else 0.0, own, solve, iterations)


def forget():
    _frames.clear()
