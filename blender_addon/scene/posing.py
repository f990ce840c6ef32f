# SPDX-License-Identifier: GPL-3.0-or-later
"""Move all empties of an object at once."""

import numpy

from ..native import Element, ExemplarError, Kind
from . import bindings, deformers, fingerprint, handles, inputs, meshes, versions


def to_exemplar(obj, name):
    """Move the empties to where exemplar `name` has their handles. Returns the names of empties
    that are moved by something else, which may take them back."""
    state = bindings.ensure(obj)
    if deformers.bound(obj).exemplars_needed:
        return _move(obj, _pose_of_exemplar(obj, state, name))
    return _move(obj, _pose_of_key(obj, name))


def _pose_of_exemplar(obj, state, name):
    """Where the deformer says that an exemplar has the handles, float64 [H][3][4]."""
    names = fingerprint.names(obj)
    if name not in names:
        raise ExemplarError(
            f"'{name}' was not an exemplar at Bind. Choose one that was, or switch it on and "
            "press Rebind.",
            element=Element.EXEMPLAR,
        )
    return state.deformer.handle_pose(names.index(name))


def _pose_of_key(obj, name):
    """The same for deformers that know no exemplars: the rigid motion of each handle."""
    keys = {key.name: key for key in meshes.exemplar_keys(obj)}
    if name not in keys:
        raise ExemplarError(f"'{obj.name}' has no shape key '{name}'.", element=Element.EXEMPLAR)
    gathered = inputs.as_bound(obj, [])
    pose = versions.get_key_positions(keys[name]).astype(numpy.float64)
    targets = numpy.empty((len(gathered.vertex_sets), 3, 4))
    for target, vertices, centre in zip(targets, gathered.vertex_sets, gathered.centres):
        posed = pose[vertices]
        target[:, 3] = posed.mean(axis=0)
        target[:, :3] = _rotation(gathered.reference[vertices] - centre, posed - target[:, 3])
    return targets


def _rotation(rest, posed):
    """The rotation that takes vectors [n][3] to others best; identity where they span no area."""
    u, sizes, v = numpy.linalg.svd(posed.T @ rest)
    if sizes[1] <= 1e-9 * sizes[0]:
        return numpy.identity(3)
    signs = [1.0, 1.0, numpy.sign(numpy.linalg.det(u @ v))]
    return (u * signs) @ v


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
