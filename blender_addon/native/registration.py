# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration: a mesh and its exemplars fitted to scans."""

import threading
from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_indices, as_input, as_output
from .blended import BlendedBinding
from .declarations import (
    CBlendedBindSettings,
    CFitReport,
    CFitSettings,
    CLandmarks,
    CMatchReport,
    CMatchSettings,
    CRegistrationInfo,
    Start,
    initialised,
)
from .deformer import given
from .errors import check
from .library import library
from .progress import ProgressCallback


@dataclass(frozen=True)
class ScanFitSettings:
    """None leaves the library's default. scale: is it unknown?"""

    scale: bool = None
    known_scale: float = None
    start: Start = Start.STATELESS
    disc_radius: float = None
    disc_count: int = None
    iterations: int = None
    sample_count: int = None
    reach: float = None
    max_angle: float = None
    tightness: float = None
    landmark_share: float = None
    finish: bool = None
    detail: float = None
    thread_count: int = None
    reject_landmarks: bool = None


@dataclass(frozen=True)
class ScanFitReport:
    quality: float
    scale: float
    exemplar: int
    seen: float
    residual: float
    landmark_residual: float
    worst_landmark: int
    worst_residual: float
    energy: float
    iterations: int
    converged: bool
    seconds: float
    start_seconds: float
    icp_seconds: float
    finish_seconds: float
    match_seconds: float
    rejected_count: int
    warning: str  # "" or a sentence


@dataclass(frozen=True)
class MatchReport:
    order: numpy.ndarray  # uint32 [count]: the point of vertices[i] is points[order[i]]
    second_order: numpy.ndarray  # the next best
    energy: float
    second: float
    margin: float
    mirrored: bool
    permissible: int
    solved: int
    seconds: float
    warning: str


@dataclass(frozen=True)
class ScanMatches:
    vertices: numpy.ndarray  # uint32 [P], UNSEEN where nothing corresponds
    triangles: numpy.ndarray  # uint32 [P]
    barycentric: numpy.ndarray  # float32 [P][3]
    distances: numpy.ndarray  # float32 [P]


class Registration:
    """`mesh` in the space of `exemplars` [S][V][3], to be fitted to scans.

    binding   BlendedBinding: the dictionary
    progress  called with (fraction, stage); returns True to cancel

    One thread at a time: `lock` is held around every call, but positions() may be called from a
    fit's own progress function, and gives the shape so far.
    """

    def __init__(self, mesh, exemplars, binding=BlendedBinding(), progress=None):
        self._handle = None
        self._library = library()
        self.lock = threading.RLock()
        shape = (-1, mesh.report.vertex_count, 3)
        exemplars = as_input("exemplars", exemplars, numpy.float32, shape)
        settings = initialised(
            self._library, CBlendedBindSettings, "exm_blended_bind_settings_init", **given(binding)
        )
        handle = c_void_p()
        with ProgressCallback(progress) as callback:
            status = self._library.exm_registration_create(
                mesh.handle,
                exemplars.ctypes.data,
                len(exemplars),
                settings,
                callback,
                None,
                byref(handle),
            )
            self.warning = check(self._library, status)
        self._handle = handle

    def _call(self, name, *arguments):
        with self.lock:
            if not self._handle:
                raise ValueError("the registration was closed")
            return check(self._library, getattr(self._library, name)(self._handle, *arguments))

    def info(self):
        found = initialised(self._library, CRegistrationInfo, "exm_registration_info_init")
        self._call("exm_registration_get_info", byref(found))
        return found

    def match(
        self, vertices, points, groups, scale=None, known_scale=None, margin=None, progress=None
    ):
        """Which landmark is which: points [n][3] of landmarks with one label >= 0 in `groups` [n]
        may change places. Returns a MatchReport."""
        landmarks, _kept = _landmarks(vertices, points, None)
        groups = as_input("groups", groups, numpy.int32, (landmarks.count,))
        values = {"scale": scale, "known_scale": known_scale, "margin": margin}
        settings = initialised(
            self._library,
            CMatchSettings,
            "exm_registration_match_settings_init",
            **{name: value for name, value in values.items() if value is not None},
        )
        report = initialised(self._library, CMatchReport, "exm_registration_match_report_init")
        order, second = numpy.empty((2, landmarks.count), numpy.uint32)
        with ProgressCallback(progress) as callback:
            warning = self._call(
                "exm_registration_match",
                byref(landmarks),
                groups.ctypes.data,
                settings,
                callback,
                None,
                order.ctypes.data,
                second.ctypes.data,
                report,
            )
        return MatchReport(
            order,
            second,
            report.energy,
            report.second,
            report.margin,
            bool(report.mirrored),
            report.permissible,
            report.solved,
            report.seconds,
            warning,
        )

    def fit(
        self, scan, vertices=(), points=(), settings=ScanFitSettings(), weights=None, progress=None
    ):
        """Fit to a Scan; vertices [n] of the mesh are known to lie at points [n][3].

        Returns a ScanFitReport; its `warning` says where the fit is doubtful.
        """
        landmarks, _kept = _landmarks(vertices, points, weights)
        native = initialised(
            self._library, CFitSettings, "exm_registration_fit_settings_init", **given(settings)
        )
        report = initialised(self._library, CFitReport, "exm_registration_fit_report_init")
        with self.lock, ProgressCallback(progress) as callback:
            warning = self._call(
                "exm_registration_fit",
                scan.handle,
                byref(landmarks),
                native,
                callback,
                None,
                report,
            )
        names = [name for name in ScanFitReport.__dataclass_fields__ if name != "warning"]
        values = {name: getattr(report, name) for name in names}
        values["converged"] = bool(values["converged"])
        return ScanFitReport(**values, warning=warning)

    def positions(self, out=None):
        """float32 [V][3]: of the last fit, or of the one at work."""
        out = as_output("out", out, numpy.float32, (self.info().vertex_count, 3))
        self._call("exm_registration_positions", out.ctypes.data)
        return out

    def vertex_matches(self):
        """(points uint32 [V] or UNSEEN, distances float32 [V] or nan)"""
        count = self.info().vertex_count
        points, distances = numpy.empty(count, numpy.uint32), numpy.empty(count, numpy.float32)
        self._call("exm_registration_vertex_matches", points.ctypes.data, distances.ctypes.data)
        return points, distances

    def scan_matches(self):
        """ScanMatches of the last fit."""
        count = self.info().point_count
        found = ScanMatches(
            numpy.empty(count, numpy.uint32),
            numpy.empty(count, numpy.uint32),
            numpy.empty((count, 3), numpy.float32),
            numpy.empty(count, numpy.float32),
        )
        addresses = (array.ctypes.data for array in vars(found).values())
        self._call("exm_registration_scan_matches", *addresses)
        return found

    def landmark_residuals(self):
        """float64 [n]"""
        residuals = numpy.empty(self.info().landmark_count, numpy.float64)
        self._call("exm_registration_landmark_residuals", residuals.ctypes.data)
        return residuals

    def close(self):
        with self.lock:
            handle, self._handle = self._handle, None
            if handle:
                self._library.exm_registration_destroy(handle)

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.close()

    def __del__(self):
        if getattr(self, "_handle", None):
            self.close()


def _landmarks(vertices, points, weights):
    """The structure, and the arrays that it points into."""
    vertices = as_indices("vertices", vertices, numpy.uint32, (-1,))
    points = numpy.zeros((0, 3)) if len(vertices) == 0 and not len(points) else points
    points = as_input("points", points, numpy.float64, (len(vertices), 3))
    if weights is not None:
        weights = as_input("weights", weights, numpy.float64, (len(vertices),))
    address = None if weights is None else weights.ctypes.data
    native = CLandmarks(len(vertices), vertices.ctypes.data, points.ctypes.data, address)
    return native, (vertices, points, weights)
