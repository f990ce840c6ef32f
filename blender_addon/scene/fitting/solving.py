# SPDX-License-Identifier: GPL-3.0-or-later
"""The slow part, free of Blender's data: it may run in a thread."""

import threading
from dataclasses import dataclass, replace

import numpy

from ...native import ExemplarError, Mesh, Registration, Scan, ScanFitReport, ScanMatches, Start

# Preparing a mesh takes longer than fitting it: the last one is kept, since landmarks and settings
# are what an artist changes between two fits.
_lock = threading.Lock()
_kept = (None, None)  # (digest of its Shape, Registration)

PREPARING = 0.4  # share of the progress bar


@dataclass(frozen=True)
class Fitted:
    positions: numpy.ndarray  # float32 [V][3], in the mesh's own space
    report: ScanFitReport
    distances: numpy.ndarray  # float32 [V] from the scan, nan where unseen
    matches: ScanMatches
    residuals: numpy.ndarray  # float64 [n] of the landmarks


class Preview:
    """The shape so far, in world space, for the window to draw while a fit is at work."""

    points = None  # float32 [V][3]

    @classmethod
    def clear(cls):
        cls.points = None


def fit(gathered, report=None):
    """Fitted"""
    registration = _prepared(gathered.shape, _part(report, 0, PREPARING))
    rest = _part(report, PREPARING, 1)

    def show(fraction, stage):
        _preview(registration, gathered.world)
        return rest(fraction, stage)

    try:
        return _fit_frame(registration, gathered.scan, gathered.settings, show)
    finally:
        Preview.clear()


def fit_frames(shape, frames, settings, world, numbers, report=None):
    """Generator-free: float32 [n][V][3] and [ScanFitReport], each frame from the one before it.

    frames  [ScanFrame]
    """
    registration = _prepared(shape, _part(report, 0, 0.2))
    positions, reports = [], []
    try:
        for done, frame in enumerate(frames):
            part = _part(
                report, 0.2 + 0.8 * done / len(frames), 0.2 + 0.8 * (done + 1) / len(frames)
            )
            start = Start.WARM if done else Start.STATELESS
            try:
                fitted = _fit_frame(registration, frame, replace(settings, start=start), part)
            except ExemplarError as error:
                raise ExemplarError(
                    f"Frame {numbers[done]}: {error}", error.status, error.element, error.index
                ) from error
            positions.append(fitted.positions)
            reports.append(fitted.report)
            _preview(registration, world)
    finally:
        Preview.clear()
    return numpy.array(positions), reports


def match(gathered, groups, scale, report=None):
    """Which landmark is which: a MatchReport."""
    registration = _prepared(gathered.shape, _part(report, 0, PREPARING))
    with registration.lock:
        return registration.match(
            gathered.scan.vertices,
            gathered.scan.landmarks,
            groups,
            scale=scale,
            progress=_part(report, PREPARING, 1),
        )


def forget():
    """Give the memory back: before the add-on goes, and with another file."""
    global _kept
    with _lock:
        if _kept[1] is not None:
            _kept[1].close()
        _kept = (None, None)


def _fit_frame(registration, frame, settings, report):
    with registration.lock, Scan(frame.points, frame.triangles) as scan:
        found = registration.fit(scan, frame.vertices, frame.landmarks, settings, progress=report)
        return Fitted(
            registration.positions(),
            found,
            registration.vertex_matches()[1],
            registration.scan_matches(),
            registration.landmark_residuals(),
        )


def _prepared(shape, report):
    global _kept
    digest = shape.digest()
    with _lock:
        if _kept[0] == digest:
            return _kept[1]
    with Mesh(shape.reference, shape.triangles) as mesh:
        registration = Registration(mesh, shape.exemplars, progress=report)
    with _lock:
        if _kept[1] is not None:
            _kept[1].close()
        _kept = (digest, registration)
    return registration


def _preview(registration, world):
    positions = registration.positions().astype(numpy.float64)
    Preview.points = (positions @ world[:3, :3].T + world[:3, 3]).astype(numpy.float32)


def _part(report, begin, end):
    """A share of someone's progress bar."""

    def of_part(fraction, stage):
        return report is not None and report(begin + (end - begin) * fraction, stage)

    return of_part
