# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes."""

import os
from ctypes import byref, c_size_t, c_void_p
from dataclasses import dataclass

import numpy

from .arrays import as_indices, as_input
from .declarations import CMeshReport, Flaw, initialised
from .errors import check
from .library import library


@dataclass(frozen=True)
class MeshReport:
    vertex_count: int
    triangle_count: int
    component_count: int
    boundary_edge_count: int
    non_manifold_edge_count: int
    degenerate_face_count: int
    loose_vertex_count: int
    diagonal: float


class Mesh:
    """A mesh in its reference pose: positions [V][3], triangles [F][3].

    `warning` is a sentence on flaws that were dealt with, or "".
    """

    def __init__(self, positions, triangles):
        positions = as_input("positions", positions, numpy.float32, (-1, 3))
        triangles = as_indices("triangles", triangles, numpy.uint32, (-1, 3))
        self._open(
            "exm_mesh_create",
            positions.ctypes.data,
            len(positions),
            triangles.ctypes.data,
            len(triangles),
        )

    @classmethod
    def read(cls, path):
        """From an OBJ, PLY, OFF or STL file."""
        mesh = cls.__new__(cls)
        mesh._open("exm_mesh_read", os.fsencode(path))
        return mesh

    def _open(self, create, *arguments):
        self._handle = None
        self._library = library()
        handle = c_void_p()
        status = getattr(self._library, create)(*arguments, byref(handle))
        self.warning = check(self._library, status)
        self._handle = handle
        self.report = self._read_report()

    def _read_report(self):
        report = initialised(self._library, CMeshReport, "exm_mesh_report_init")
        check(self._library, self._library.exm_mesh_get_report(self._handle, report))
        return MeshReport(*(getattr(report, name) for name in MeshReport.__dataclass_fields__))

    @property
    def handle(self):
        if self._handle is None:
            raise ValueError("the mesh was closed")
        return self._handle

    def arrays(self):
        """positions float32 [V][3], triangles uint32 [F][3]"""
        positions = numpy.empty((self.report.vertex_count, 3), numpy.float32)
        triangles = numpy.empty((self.report.triangle_count, 3), numpy.uint32)
        status = self._library.exm_mesh_get_arrays(
            self.handle, positions.ctypes.data, triangles.ctypes.data
        )
        check(self._library, status)
        return positions, triangles

    def flaws(self, flaw):
        """Faces or vertices, [n]; for edges pairs of vertices, [n][2]."""
        count = c_size_t()
        read = self._library.exm_mesh_flaws
        check(self._library, read(self.handle, flaw, None, 0, byref(count)))
        elements = numpy.empty(count.value, numpy.uint32)
        status = read(self.handle, flaw, elements.ctypes.data, len(elements), byref(count))
        check(self._library, status)
        return elements.reshape(-1, 2) if flaw == Flaw.NON_MANIFOLD_EDGE else elements

    def cotangents(self):
        """float64 [F][3]"""
        cotangents = numpy.empty((self.report.triangle_count, 3), numpy.float64)
        check(self._library, self._library.exm_mesh_cotangents(self.handle, cotangents.ctypes.data))
        return cotangents

    def disc(self, vertex, radius):
        """A geodesic disc as a row for Blended.add_rows(): (vertices, coefficients)."""
        return self._row("exm_mesh_disc", vertex, radius)

    def differential(self, vertex):
        """A differential coordinate as a row for Blended.add_rows(): (vertices, coefficients)."""
        return self._row("exm_mesh_differential", vertex)

    def _row(self, name, *arguments):
        count = c_size_t()
        read = getattr(self._library, name)
        check(self._library, read(self.handle, *arguments, 0, None, None, byref(count)))
        vertices = numpy.empty(count.value, numpy.uint32)
        coefficients = numpy.empty(count.value, numpy.float64)
        room = (len(vertices), vertices.ctypes.data, coefficients.ctypes.data)
        check(self._library, read(self.handle, *arguments, *room, byref(count)))
        return vertices, coefficients

    def close(self):
        handle, self._handle = self._handle, None
        if handle:
            self._library.exm_mesh_destroy(handle)

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.close()

    def __del__(self):
        if getattr(self, "_handle", None):
            self.close()
