# SPDX-License-Identifier: GPL-3.0-or-later
"""exemplar.h in ctypes: constants, structures and, beside each C signature, its types.

One file a noun of the header. Each has its structures and a table FUNCTIONS {name: (result,
*arguments)}; a new noun is a file of its own and a line in NOUNS.
"""

from . import (
    amrap,
    blended,
    common,
    deformer,
    handles,
    mesh,
    registration,
    rigidity,
    sequence,
    weights,
)
from .amrap import Blend, CAmrapBindSettings, CAmrapSolveSettings, Descent
from .blended import (
    Begin,
    CBlendedBindSettings,
    CBlendedInfo,
    CBlendedOutcome,
    CBlendedSolveSettings,
    CRows,
    Dictionary,
    Scale,
)
from .common import ABI_VERSION, Element, Progress, Status, initialised
from .deformer import CDeformerInfo, CSolveReport, DeformerKind, Start
from .handles import CHandles, Kind
from .mesh import CMeshReport, Flaw
from .registration import (
    UNSEEN,
    CFitReport,
    CFitSettings,
    CLandmarks,
    CMatchReport,
    CMatchSettings,
    CRegistrationInfo,
    CScanReport,
    CScanSettings,
)
from .rigidity import (
    RADIUS_MAX,
    CRigidityBindSettings,
    CRigidityLearnSettings,
    CRigiditySolveSettings,
)
from .sequence import ShapeSpace
from .weights import CDecomposeReport, CDecomposeSettings

NOUNS = (
    common,
    mesh,
    handles,
    deformer,
    amrap,
    blended,
    rigidity,
    registration,
    weights,
    sequence,
)

__all__ = (
    "ABI_VERSION",
    "Begin",
    "Blend",
    "CAmrapBindSettings",
    "CAmrapSolveSettings",
    "CBlendedBindSettings",
    "CBlendedInfo",
    "CBlendedOutcome",
    "CBlendedSolveSettings",
    "CDecomposeReport",
    "CDecomposeSettings",
    "CDeformerInfo",
    "CFitReport",
    "CFitSettings",
    "CHandles",
    "CLandmarks",
    "CMatchReport",
    "CMatchSettings",
    "CMeshReport",
    "CRegistrationInfo",
    "CRigidityBindSettings",
    "CRigidityLearnSettings",
    "CRigiditySolveSettings",
    "CRows",
    "CScanReport",
    "CScanSettings",
    "CSolveReport",
    "DeformerKind",
    "Descent",
    "Dictionary",
    "Element",
    "Flaw",
    "Kind",
    "Progress",
    "RADIUS_MAX",
    "Scale",
    "ShapeSpace",
    "Start",
    "Status",
    "UNSEEN",
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
