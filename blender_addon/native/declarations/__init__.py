# SPDX-License-Identifier: GPL-3.0-or-later
"""exemplar.h in ctypes: constants, structures and, beside each C signature, its types.

One file a noun of the header. Each has its structures and a table FUNCTIONS {name: (result,
*arguments)}; a new noun is a file of its own and a line in NOUNS.
"""

from . import amrap, common, deformer, handles, mesh, rigidity
from .amrap import Blend, CAmrapBindSettings, CAmrapSolveSettings, Descent
from .common import ABI_VERSION, Element, Progress, Status, initialised
from .deformer import CDeformerInfo, CSolveReport, DeformerKind, Start
from .handles import CHandles, Kind
from .mesh import CMeshReport, Flaw
from .rigidity import (
    RADIUS_MAX,
    CRigidityBindSettings,
    CRigidityLearnSettings,
    CRigiditySolveSettings,
)

NOUNS = (
    common,
    mesh,
    handles,
    deformer,
    amrap,
    rigidity,
)

__all__ = (
    "ABI_VERSION",
    "Blend",
    "CAmrapBindSettings",
    "CAmrapSolveSettings",
    "CDeformerInfo",
    "CHandles",
    "CMeshReport",
    "CRigidityBindSettings",
    "CRigidityLearnSettings",
    "CRigiditySolveSettings",
    "CSolveReport",
    "DeformerKind",
    "Descent",
    "Element",
    "Flaw",
    "Kind",
    "Progress",
    "RADIUS_MAX",
    "Start",
    "Status",
    "declare",
    "initialised",
)


def declare(library):
    """Give every function its types. Raises AttributeError where the library lacks one."""
    for noun in NOUNS:
        for name, (result, *arguments) in noun.FUNCTIONS.items():
            function = getattr(library, name)
            function.restype = result
            function.argtypes = arguments
