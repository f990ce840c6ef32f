# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans: what a registration fits to."""

import os
from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_indices, as_input
from .declarations import CScanReport, CScanSettings, initialised
from .errors import check
from .library import library


@dataclass(frozen=True)
class ScanReport:
    point_count: int
    triangle_count: int
    boundary_point_count: int
    signed_normals: bool
    diagonal: float
    spacing: float


class Scan:
    """Points [P][3], with triangles [F][3] or a cloud, with normals [P][3] or without."""

    def __init__(self, points, triangles=None, normals=None, neighbor_count=None):
        points = as_input("points", points, numpy.float32, (-1, 3))
        values = {}
        if triangles is not None and len(triangles):
            triangles = as_indices("triangles", triangles, numpy.uint32, (-1, 3))
            values.update(triangles=triangles.ctypes.data, triangle_count=len(triangles))
        if normals is not None:
            normals = as_input("normals", normals, numpy.float32, (len(points), 3))
            values.update(normals=normals.ctypes.data)
        if neighbor_count is not None:
            values.update(neighbor_count=neighbor_count)
        settings = initialised(library(), CScanSettings, "exm_scan_settings_init", **values)
        self._open("exm_scan_create", points.ctypes.data, len(points), settings)

    @classmethod
    def read(cls, path):
        """From an OBJ, PLY, OFF or STL file; one without faces is a cloud."""
        scan = cls.__new__(cls)
        scan._open("exm_scan_read", os.fsencode(path))
        return scan

    def _open(self, create, *arguments):
        self._handle = None
        self._library = library()
        handle = c_void_p()
        check(self._library, getattr(self._library, create)(*arguments, byref(handle)))
        self._handle = handle
        report = initialised(self._library, CScanReport, "exm_scan_report_init")
        check(self._library, self._library.exm_scan_get_report(self._handle, report))
        found = {name: getattr(report, name) for name in ScanReport.__dataclass_fields__}
        found["signed_normals"] = bool(found["signed_normals"])
        self.report = ScanReport(**found)

    @property
    def handle(self):
        if self._handle is None:
            raise ValueError("the scan was closed")
        return self._handle

    def arrays(self):
        """points float32 [P][3], triangles uint32 [F][3], normals float32 [P][3],
        boundary bool [P]"""
        count = self.report.point_count
        points, normals = numpy.empty((2, count, 3), numpy.float32)
        triangles = numpy.empty((self.report.triangle_count, 3), numpy.uint32)
        boundary = numpy.empty(count, numpy.uint8)
        addresses = (array.ctypes.data for array in (points, triangles, normals, boundary))
        check(self._library, self._library.exm_scan_get_arrays(self.handle, *addresses))
        return points, triangles, normals, boundary.astype(bool)

    def nearest(self, queries):
        """(indices uint32 [n], distances float64 [n]) of the points nearest to queries [n][3]."""
        queries = as_input("queries", queries, numpy.float64, (-1, 3))
        indices = numpy.empty(len(queries), numpy.uint32)
        distances = numpy.empty(len(queries), numpy.float64)
        status = self._library.exm_scan_nearest(
            self.handle,
            queries.ctypes.data,
            len(queries),
            indices.ctypes.data,
            distances.ctypes.data,
        )
        check(self._library, status)
        return indices, distances

    def close(self):
        handle, self._handle = self._handle, None
        if handle:
            self._library.exm_scan_destroy(handle)

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.close()

    def __del__(self):
        if getattr(self, "_handle", None):
            self.close()
