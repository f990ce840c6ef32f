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
from .blended import Blended, BlendedBinding, BlendedInfo, BlendedOutcome, BlendedSettings
from .declarations import (
    ABI_VERSION,
    RADIUS_MAX,
    UNSEEN,
    Begin,
    Blend,
    DeformerKind,
    Descent,
    Dictionary,
    Element,
    Flaw,
    Kind,
    Scale,
    ShapeSpace,
    Start,
    Status,
)
from .deformer import Deformer, DeformerInfo, SolveReport
from .errors import ExemplarError, LibraryError
from .handles import Handles, bounded_biharmonic
from .library import library, library_path, library_version
from .mesh import Mesh, MeshReport
from .registration import (
    MatchReport,
    Registration,
    ScanFitReport,
    ScanFitSettings,
    ScanMatches,
)
from .rigidity import Rigidity, RigiditySettings, learn_radii, radius_energies
from .scan import Scan, ScanReport
from .sequence import FileReport, FitReport, Sequence, SequenceInfo, SequenceWindow
from .weights import Decomposition, decompose, eigenfunctions

__all__ = (
    "ABI_VERSION",
    "Amrap",
    "AmrapSettings",
    "Begin",
    "Blend",
    "Blended",
    "BlendedBinding",
    "BlendedInfo",
    "BlendedOutcome",
    "BlendedSettings",
    "Decomposition",
    "Deformer",
    "DeformerInfo",
    "DeformerKind",
    "Descent",
    "Dictionary",
    "Element",
    "ExemplarError",
    "FileReport",
    "FitReport",
    "Flaw",
    "Handles",
    "Kind",
    "LibraryError",
    "MatchReport",
    "Mesh",
    "MeshReport",
    "RADIUS_MAX",
    "Registration",
    "Rigidity",
    "RigiditySettings",
    "Scale",
    "Scan",
    "ScanFitReport",
    "ScanFitSettings",
    "ScanMatches",
    "ScanReport",
    "Sequence",
    "SequenceInfo",
    "SequenceWindow",
    "ShapeSpace",
    "SolveReport",
    "Start",
    "Status",
    "UNSEEN",
    "bounded_biharmonic",
    "decompose",
    "eigenfunctions",
    "learn_radii",
    "library",
    "library_path",
    "library_version",
    "radius_energies",
)
