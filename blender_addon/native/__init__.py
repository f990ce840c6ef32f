# SPDX-License-Identifier: GPL-3.0-or-later
"""The Exemplar library for Python with numpy; nothing here knows Blender.

    mesh = Mesh(positions, triangles)
    with Amrap(mesh, exemplars, Handles(kinds, vertex_sets)) as deformer:
        deformer.solve(targets)
        positions = deformer.positions()

Sizes are those of exemplar.h: V vertices, F triangles, S exemplars, H handles, G edge groups.
"""

from .declarations import ABI_VERSION, Blend, Descent, Element, Flaw, Kind, Start, Status
from .deformer import Amrap, AmrapSettings, Deformer, DeformerInfo, SolveReport
from .errors import ExemplarError, LibraryError
from .handles import Handles, bounded_biharmonic
from .library import library, library_path, library_version
from .mesh import Mesh, MeshReport

__all__ = (
    "ABI_VERSION",
    "Amrap",
    "AmrapSettings",
    "Blend",
    "Deformer",
    "DeformerInfo",
    "Descent",
    "Element",
    "ExemplarError",
    "Flaw",
    "Handles",
    "Kind",
    "LibraryError",
    "Mesh",
    "MeshReport",
    "SolveReport",
    "Start",
    "Status",
    "bounded_biharmonic",
    "library",
    "library_path",
    "library_version",
)
