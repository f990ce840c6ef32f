# SPDX-License-Identifier: GPL-3.0-or-later
"""Move or key all empties of an object at once, and keep a pose that was found."""

import bpy
import numpy

from ..native import Element, ExemplarError, Kind
from . import bindings, fingerprint, handles, inputs, meshes, solving, versions

# Of the mesh's size: how well two handles have to mirror each other to be a pair.
PAIR_MISFIT = 0.03


def to_exemplar(obj, name):
    """Move the empties to where exemplar `name` has their handles. Returns the names of empties
    that are moved by something else, which may take them back."""
    state = bindings.ensure(obj)
    if fingerprint.names(obj):
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


def mirror(obj):
    """Exchange left and right, across the mesh's own X axis. Returns as to_exemplar()."""
    state = bindings.ensure(obj)
    flip = numpy.diag([-1.0, 1.0, 1.0])
    targets = handles.targets(obj, bpy.context.evaluated_depsgraph_get(), state.centres)
    pairs = _pairs(state.centres, flip, meshes.size(obj))
    mirrored = targets.copy()
    for index, other in enumerate(pairs):
        mirrored[index, :, :3] = flip @ targets[other, :, :3] @ flip
        # The way that the other has gone, not its place: a face is never quite symmetric.
        mirrored[index, :, 3] = state.centres[index] + flip @ (
            targets[other, :, 3] - state.centres[other]
        )
    return _move(obj, mirrored)


def _pairs(centres, flip, size):
    """For each handle the one on the other side; itself where it is in the middle."""
    apart = numpy.linalg.norm((centres @ flip)[:, None] - centres[None], axis=2)
    nearest = apart.argmin(axis=1)
    lonely = [i for i, other in enumerate(nearest) if apart[i, other] > PAIR_MISFIT * size]
    lonely += [i for i, other in enumerate(nearest) if nearest[other] != i]
    if lonely:
        count = len(set(lonely))
        have = "One handle has" if count == 1 else f"{count} handles have"
        raise ExemplarError(
            f"{have} no mirror image, so the pose cannot be mirrored. "
            "Press Mirror Handles, then Rebind.",
            element=Element.HANDLE,
            index=lonely[0],
        )
    return nearest


def key_all(obj, frame):
    """Keyframe what the mesh follows of every handle. Returns (how many, names of linked empties,
    which cannot be keyed)."""
    keyed, linked = 0, []
    for item in obj.exemplar.handles:
        if item.kind == "FREE" or handles.is_missing(item):
            continue
        if item.empty.library is not None:
            linked.append(item.empty.name)
            continue
        key_handle(item, frame)
        keyed += 1
    return keyed, linked


def key_handle(item, frame):
    for path in _keyed_paths(item):
        item.empty.keyframe_insert(path, frame=frame)


def _keyed_paths(item):
    if item.kind == "PINNED":
        return ("location",)
    rotation = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    return ("location", rotation.get(item.empty.rotation_mode, "rotation_euler"), "scale")


def result_to_key(obj, name):
    """Keep the result, as renders show it, in a new shape key. Returns the key."""
    if obj.data.library is not None:
        raise ExemplarError(f"The mesh of '{obj.name}' is linked, and can take no new shape key.")
    positions = solving.solve(obj).positions
    active = obj.active_shape_key_index
    key = obj.shape_key_add(name=name, from_mix=False)
    key.value = 0.0  # Blender 5 begins at 1
    key.relative_key = meshes.reference_key(obj)
    versions.set_key_positions(key, numpy.ascontiguousarray(positions, numpy.float32))
    obj.active_shape_key_index = active
    return key


def _move(obj, targets):
    left = []
    for item, target in zip(handles.bound_items(obj), targets):
        if handles.is_missing(item):
            continue
        handles.move_empty(obj, item, target, with_linear=item.bound_kind == Kind.ORIENTED)
        if handles.is_animated(item.empty):
            left.append(item.empty.name)
    return left
