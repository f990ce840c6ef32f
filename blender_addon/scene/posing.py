# SPDX-License-Identifier: GPL-3.0-or-later
"""Move all empties of an object at once."""

import numpy

from ..native import Kind
from . import bindings, deformers, handles


def to_exemplar(obj, name):
    """Move the empties to where exemplar `name` has their handles. Returns the names of empties
    that are moved by something else, which may take them back."""
    state = bindings.ensure(obj)
    return _move(obj, deformers.bound(obj).handle_pose(obj, state, name))


def reset(obj):
    """Move the empties to where they were at Bind."""
    state = bindings.ensure(obj)
    rest = numpy.zeros((len(state.centres), 3, 4))
    rest[:, :, :3] = numpy.identity(3)
    rest[:, :, 3] = state.centres
    return _move(obj, rest)


def _move(obj, targets):
    left = []
    for item, target in zip(handles.bound_items(obj), targets):
        if handles.is_missing(item):
            continue
        handles.move_empty(obj, item, target, with_linear=item.bound_kind == Kind.ORIENTED)
        if handles.is_animated(item.empty):
            left.append(item.empty.name)
    return left
