# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of deformers, each behind the interface of base.py. Nothing else in the add-on asks
which of them it has before it.

A new kind is a file here (what it binds, how it solves), one in properties/ (what is saved), one in
ui/settings/ (what the panel shows), and a line in each of their tables.
"""

from .. import fingerprint
from .amrap import Amrap
from .blended import Blended
from .rigidity import Rigidity

ALL = (
    Amrap(),
    Blended(),
    Rigidity(),
)
TYPES = {type_.identifier: type_ for type_ in ALL}


def chosen(obj):
    """The kind that the artist wants; takes effect at the next Bind."""
    return TYPES[obj.exemplar.deformer]


def bound(obj):
    """The kind that a bound object has."""
    return TYPES[fingerprint.read(obj)["deformer"]]


def current(obj):
    """The kind that solves, or would solve."""
    return bound(obj) if obj.exemplar.bound else chosen(obj)
