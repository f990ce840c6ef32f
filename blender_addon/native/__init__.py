# SPDX-License-Identifier: GPL-3.0-or-later
"""The Exemplar library for Python with numpy; nothing here knows Blender.

    mesh = Mesh(positions, triangles)
    with Amrap(mesh, exemplars, Handles(kinds, vertex_sets)) as deformer:
        deformer.solve(targets)
        positions = deformer.positions()

A file a noun, here and in declarations/; each kind of deformer is a noun of its own.
Sizes are those of exemplar.h: V vertices, F triangles, S exemplars, H handles, G edge groups.
"""

from .amrap import Amrap, AmrapSettings
from .declarations import (
    ABI_VERSION,
    RADIUS_MAX,
    Blend,
    DeformerKind,
    Descent,
    Element,
    Flaw,
    Kind,
    Start,
    Status,
)
from .deformer import Deformer, DeformerInfo, SolveReport
from .errors import ExemplarError, LibraryError
from .handles import Handles, bounded_biharmonic
from .library import library, library_path, library_version
from .mesh import Mesh, MeshReport
from .rigidity import Rigidity, RigiditySettings, learn_radii, radius_energies

__all__ = (
    "ABI_VERSION",
    "Amrap",
    "AmrapSettings",
    "Blend",
    "Deformer",
    "DeformerInfo",
    "DeformerKind",
    "Descent",
    "Element",
    "ExemplarError",
    "Flaw",
    "Handles",
    "Kind",
    "LibraryError",
    "Mesh",
    "MeshReport",
    "RADIUS_MAX",
    "Rigidity",
    "RigiditySettings",
    "SolveReport",
    "Start",
    "Status",
    "bounded_biharmonic",
    "learn_radii",
    "library",
    "library_path",
    "library_version",
    "radius_energies",
)
