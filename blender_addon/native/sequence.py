# SPDX-License-Identifier: GPL-3.0-or-later
"""Deforming mesh sequences: time, pose and shape as three signals.

    with Sequence(mesh) as sequence:
        for positions in frames:
            sequence.add_frame(positions)
        sequence.fit(tolerance=1e-3)
        positions = sequence.evaluate(3.7)

Frames are counted from 0, and times are frames. `window` is 0 unless windows were asked for.
"""

import os
import threading
from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_indices, as_input, as_output
from .declarations import initialised
from .declarations.sequence import (
    CPins,
    CSequenceFileReport,
    CSequenceFitReport,
    CSequenceFitSettings,
    CSequenceInfo,
    CSequenceWindow,
    ShapeSpace,
)
from .errors import check
from .library import library
from .progress import ProgressCallback


def _record(kind, structure):
    return kind(*(getattr(structure, name) for name in kind.__dataclass_fields__))


@dataclass(frozen=True)
class SequenceInfo:
    vertex_count: int
    triangle_count: int
    held_frame_count: int
    dimension: int
    shape_space: int
    is_fitted: bool
    cyclic: bool
    window_count: int
    frame_count: int
    component_count: int


@dataclass(frozen=True)
class SequenceWindow:
    first_frame: int
    frame_count: int
    control_point_count: int
    knot_count: int
    site_count: int
    fitted_frame_count: int


@dataclass(frozen=True)
class FitReport:
    control_point_count: int
    site_count: int
    component_count: int
    diagonal: float
    shape_error: float
    pose_error: float
    error: float
    stress: float
    seconds: float
    saddle_count: int
    acceleration: float


@dataclass(frozen=True)
class FileReport:
    file_size: int
    frames_size: int
    ratio: float


class _Pins:
    """{frame: (x, y)} as the library wants it; keeps the arrays that the structure points into."""

    def __init__(self, pins):
        pins = dict(pins or {})
        self.frames = as_indices("pins", list(pins), numpy.uint32, (-1,))
        self.positions = as_input(
            "pins", numpy.array(list(pins.values()), float).reshape(-1, 2), numpy.float64, (-1, 2)
        )
        self.structure = CPins(
            len(self.frames), self.frames.ctypes.data, self.positions.ctypes.data
        )


class Sequence:
    """A sequence of `mesh`'s shapes, without frames. A handle of the library: close it, or use
    it in a `with`.

    `lock` is held around every call: the library allows a sequence one thread at a time.
    """

    def __init__(self, mesh, shape_space=ShapeSpace.POSITIONS):
        handle = c_void_p()
        self._open(library())
        check(
            self._library,
            self._library.exm_sequence_create(mesh.handle, shape_space, byref(handle)),
        )
        self._handle = handle

    def _open(self, loaded):
        self._handle = None
        self._library = loaded
        self.lock = threading.RLock()

    @classmethod
    def load(cls, path):
        """From a file that save() wrote. `file_report` says how much smaller than frames it is."""
        sequence = cls.__new__(cls)
        sequence._open(library())
        report = initialised(
            sequence._library, CSequenceFileReport, "exm_sequence_file_report_init"
        )
        handle = c_void_p()
        status = sequence._library.exm_sequence_load(os.fsencode(path), report, byref(handle))
        check(sequence._library, status)
        sequence._handle = handle
        sequence.file_report = _record(FileReport, report)
        return sequence

    def save(self, path):
        """The mesh and the signals, not the frames. Returns a FileReport."""
        report = initialised(self._library, CSequenceFileReport, "exm_sequence_file_report_init")
        self._call("exm_sequence_save", os.fsencode(path), report)
        return _record(FileReport, report)

    def _call(self, name, *arguments):
        with self.lock:
            if not self._handle:
                raise ValueError("the sequence was closed")
            return check(self._library, getattr(self._library, name)(self._handle, *arguments))

    # ------------------------------------------------------------------------------- frames

    def add_frame(self, positions, triangles=None):
        """positions [V][3]; triangles [F][3] of this frame have a change of connectivity
        noticed."""
        positions = as_input("positions", positions, numpy.float32, (-1, 3))
        if triangles is not None:
            triangles = as_indices("triangles", triangles, numpy.uint32, (-1, 3))
        self._call(
            "exm_sequence_add_frame",
            positions.ctypes.data,
            len(positions),
            None if triangles is None else triangles.ctypes.data,
            0 if triangles is None else len(triangles),
        )

    def drop_frames(self):
        self._call("exm_sequence_drop_frames")

    def fit(
        self,
        control_point_count=0,
        site_count=0,
        component_count=0,
        tolerance=None,
        cyclic=False,
        pins=None,
        examples=None,
        cure_saddles=False,
        window_size=0,
        window_overlap=0,
        progress=None,
    ):
        """Fit the three signals. Counts of 0 are chosen by the tolerance, an RMS distance as a
        share of the diagonal.

        pins      {frame: (x, y)} in the pose plane
        examples  [E][V][3] that span the shape signal instead of principal components
        cure_saddles  try layouts with less violent motion between frames, without a user
        window_size, window_overlap  frames of overlapping windows for a long sequence
        progress  called with (fraction, stage); returns True to cancel
        """
        pinned = _Pins(pins)
        settings = initialised(
            self._library,
            CSequenceFitSettings,
            "exm_sequence_fit_settings_init",
            control_point_count=control_point_count,
            site_count=site_count,
            component_count=component_count,
            cyclic=int(cyclic),
            cure_saddles=int(cure_saddles),
            window_size=window_size,
            window_overlap=window_overlap,
            pins=pinned.structure,
        )
        if tolerance is not None:
            settings.tolerance = tolerance
        if examples is not None:
            examples = self._poses("examples", examples)
            settings.examples = examples.ctypes.data
            settings.example_count = len(examples)
        report = initialised(self._library, CSequenceFitReport, "exm_sequence_fit_report_init")
        with ProgressCallback(progress) as callback:
            self._call("exm_sequence_fit", settings, callback, None, report)
        return _record(FitReport, report)

    def place(self, pins, iterations=0):
        """Pin frames, {frame: (x, y)}, and fit pose and time anew; quick."""
        pinned = _Pins(pins)
        report = initialised(self._library, CSequenceFitReport, "exm_sequence_fit_report_init")
        self._call("exm_sequence_place", pinned.structure, iterations, report)
        return _record(FitReport, report)

    # ----------------------------------------------------------------------------- sampling

    @property
    def info(self):
        info = initialised(self._library, CSequenceInfo, "exm_sequence_info_init")
        self._call("exm_sequence_get_info", info)
        return _record(SequenceInfo, info)

    def window(self, window=0):
        found = initialised(self._library, CSequenceWindow, "exm_sequence_window_init")
        self._call("exm_sequence_get_window", window, found)
        return _record(SequenceWindow, found)

    def _positions(self, name, dtype, out, *arguments):
        out = as_output("out", out, dtype, (self.info.vertex_count, 3))
        self._call(name, *arguments, out.ctypes.data)
        return out

    def evaluate(self, time, out=None):
        """float32 [V][3]"""
        return self._positions("exm_sequence_evaluate", numpy.float32, out, time)

    def evaluate_f64(self, time, out=None):
        return self._positions("exm_sequence_evaluate_f64", numpy.float64, out, time)

    def derivative(self, time, order=1, out=None):
        """float64 [V][3], in units per frame**order."""
        return self._positions("exm_sequence_derivative", numpy.float64, out, time, order)

    def pose(self, point, window=0, out=None):
        """The shape at a point of the pose plane: float32 [V][3]."""
        point = as_input("point", point, numpy.float64, (2,))
        return self._positions("exm_sequence_pose", numpy.float32, out, window, point.ctypes.data)

    def curve_point(self, time, window=0):
        """Where the curve is at a time: float64 [2]."""
        point = numpy.empty(2)
        self._call("exm_sequence_curve", window, time, point.ctypes.data)
        return point

    def measure(self):
        """RMS and largest distances from the held frames, [n] each, as shares of the diagonal."""
        rms = numpy.empty(self.info.frame_count)
        largest = numpy.empty(len(rms))
        self._call("exm_sequence_measure", rms.ctypes.data, largest.ctypes.data)
        return rms, largest

    # --------------------------------------------------------------------------- pose plane

    def marks(self, window=0):
        """Where the fitted frames lie in the plane, float64 [n][2], and which of them are
        pinned, bool [n]."""
        count = self.window(window).fitted_frame_count
        positions, pinned = numpy.empty((count, 2)), numpy.empty(count, numpy.int32)
        self._call(
            "exm_sequence_get_frames",
            window,
            positions.ctypes.data,
            None,
            pinned.ctypes.data,
        )
        return positions, pinned.astype(bool)

    def parameters(self, window=0):
        """Of the time signal's frames on the curve, in the unit of its knots."""
        parameters = numpy.empty(self.window(window).frame_count)
        self._call("exm_sequence_get_frames", window, None, parameters.ctypes.data, None)
        return parameters

    def sites(self, window=0):
        """Numbers of the fitted frames that are sites, in the order they were chosen."""
        sites = numpy.empty(self.window(window).site_count, numpy.uint32)
        self._call("exm_sequence_get_sites", window, sites.ctypes.data)
        return sites

    # -------------------------------------------------------------------------------- curve

    def control_points(self, window=0):
        """float64 [k][2]"""
        points = numpy.empty((self.window(window).control_point_count, 2))
        self._call("exm_sequence_get_curve", window, points.ctypes.data, None)
        return points

    def knots(self, window=0):
        knots = numpy.empty(self.window(window).knot_count)
        self._call("exm_sequence_get_curve", window, None, knots.ctypes.data)
        return knots

    def move_control_points(self, first, points, window=0):
        points = as_input("points", points, numpy.float64, (-1, 2))
        self._call(
            "exm_sequence_move_control_points", window, first, len(points), points.ctypes.data
        )

    def insert_control_point(self, index, point=None, window=0):
        """Before control point `index`; without a point the curve stays as it is."""
        if point is not None:
            point = as_input("point", point, numpy.float64, (2,))
        self._call(
            "exm_sequence_insert_control_point",
            window,
            index,
            None if point is None else point.ctypes.data,
        )

    def delete_control_point(self, index, window=0):
        self._call("exm_sequence_delete_control_point", window, index)

    def draw(self, points, frame_count, knots=None):
        """Replace the curve; the frames lie at equal steps of its parameter."""
        points = as_input("points", points, numpy.float64, (-1, 2))
        if knots is not None:
            closing = 1 if self.info.cyclic else 2
            knots = as_input("knots", knots, numpy.float64, (len(points) + closing,))
        self._call(
            "exm_sequence_draw",
            len(points),
            points.ctypes.data,
            None if knots is None else knots.ctypes.data,
            frame_count,
        )

    # ------------------------------------------------------------------------------- frames

    def resample(self, times):
        """New frame j is what was at times[j]."""
        times = as_input("times", times, numpy.float64, (-1,))
        self._call("exm_sequence_resample", times.ctypes.data, len(times))

    def convert_rate(self, ratio):
        """`ratio` times as many frames, at the same speed."""
        self._call("exm_sequence_convert_rate", ratio)

    def loop(self, start, end, count=1):
        """Play what lies between two times `count` times more."""
        self._call("exm_sequence_loop", start, end, count)

    def add_pose(self, positions, point):
        """Put a shape [V][3] at a point of the pose plane."""
        positions = self._poses("positions", numpy.asarray(positions)[None])
        point = as_input("point", point, numpy.float64, (2,))
        self._call("exm_sequence_add_pose", positions.ctypes.data, point.ctypes.data)

    def transfer(self, examples, mesh, mesh_examples, shape_space=ShapeSpace.POSITIONS):
        """The same motion on another mesh, by matched examples [E][V][3] and [E][V'][3]: a
        Sequence."""
        examples = self._poses("examples", examples)
        others = as_input(
            "mesh_examples",
            mesh_examples,
            numpy.float32,
            (len(examples), mesh.report.vertex_count, 3),
        )
        made = type(self).__new__(type(self))
        made._open(self._library)
        handle = c_void_p()
        self._call(
            "exm_sequence_transfer",
            examples.ctypes.data,
            mesh.handle,
            shape_space,
            others.ctypes.data,
            len(examples),
            byref(handle),
        )
        made._handle = handle
        return made

    def _poses(self, name, poses):
        return as_input(name, poses, numpy.float32, (-1, self.info.vertex_count, 3))

    def close(self):
        with self.lock:
            handle, self._handle = self._handle, None
            if handle:
                self._library.exm_sequence_destroy(handle)

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.close()

    def __del__(self):
        if getattr(self, "_handle", None):
            self.close()
