# SPDX-License-Identifier: GPL-3.0-or-later
"""What is baked: the positions of an object at the scene's present frame, whoever makes them."""

from dataclasses import dataclass
from typing import Any

from .. import solving
from ..sequences import owners
from ..sequences import solving as sequence_solving


@dataclass(frozen=True)
class Sample:
    positions: Any  # float32 [V][3], object space
    converged: bool = True
    iterations: int = 0


def sampler(obj):
    """A function of the depsgraph that gives a Sample; it writes nothing."""
    if owners.is_owner(obj):
        return lambda depsgraph: Sample(sequence_solving.solve(obj, depsgraph))
    return lambda depsgraph: _solved(obj, depsgraph)


def _solved(obj, depsgraph):
    solved = solving.solve(obj, depsgraph, stateless=True)
    return Sample(solved.positions, not solved.report.capped, solved.report.iterations)


def can_be_baked(obj):
    """Whether there is anything that moves it."""
    return obj.type == "MESH" and (obj.exemplar.bound or owners.is_owner(obj))


def set_live(obj, live):
    """Whether the object goes on following what moves it."""
    if owners.is_owner(obj):
        obj.exemplar_sequence.live = live
    else:
        obj.exemplar.live = live


def is_live(obj):
    return obj.exemplar_sequence.live if owners.is_owner(obj) else obj.exemplar.live
