# SPDX-License-Identifier: GPL-3.0-or-later
"""Bind and unbind: all that they change in the scene, in one place.

    gathered = prepare(obj)               # checks; changes nothing
    deformer, warnings = build(gathered)  # slow; may run in a thread; changes nothing
    commit(obj, gathered, deformer, warnings, depsgraph)
"""

from ..native import ExemplarError
from . import bindings, fingerprint, follow, handles, inputs, results, solving


def prepare(obj):
    """What to bind, or ExemplarError."""
    if obj.type != "MESH":
        raise ExemplarError(f"'{obj.name}' is not a mesh.")
    if obj.library is not None:
        raise ExemplarError(f"'{obj.name}' is linked. Make a library override or a local copy.")
    solving.refuse_paused(obj)
    gathered = inputs.for_bind(obj)
    results.refuse(obj, obj.exemplar.target)
    return gathered


def commit(obj, gathered, deformer, warnings):
    """Make a finished bind the object's own. Returns sentences that the artist should read."""
    rig = obj.exemplar
    if not rig.uuid:
        rig.uuid = bindings.new_uuid()
    _place_empties(obj, gathered, keep_pose=rig.bound)
    if rig.bound and results.shown_object(obj) is not None:
        follow.unfollow(results.shown_object(obj))
    results.create(obj, rig.target)
    for index, item in enumerate(rig.handles):
        item.bound_index = index
        item.bound_kind = gathered.kinds[index]
        item.bound_radius = gathered.radii[index]
    rig.fingerprint = fingerprint.of(gathered)
    rig.bound = True
    bindings.rigs.forget()
    bindings.install(obj, gathered, deformer, warnings)
    follow.follow(results.shown_object(obj), [item.empty for item in rig.handles])
    return lock_interface(obj) + [sentence for sentence, _ in warnings]


def _place_empties(obj, gathered, keep_pose):
    """A first Bind is at rest: the empties go to their vertices. A Rebind leaves the pose alone,
    and new empties go to where the pose has their vertices."""
    rest, posed = gathered.reference, None
    state = bindings.peek(obj)
    if keep_pose and state and state.result and len(state.result.positions) == len(rest):
        posed = state.result.positions
    for index, item in enumerate(obj.exemplar.handles):
        if keep_pose and item.bound_index >= 0:
            continue
        handles.record_rest(obj, item)
        centre = gathered.centres[index]
        if posed is not None:
            centre = posed[gathered.vertex_sets[index]].mean(axis=0)
        if not handles.is_animated(item.empty):
            matrix = item.empty.matrix_world.copy()
            matrix.translation = obj.matrix_world @ handles.vector(centre)
            item.empty.matrix_world = matrix


def lock_interface(obj):
    """A render has a thread of its own; the viewport must not draw a mesh that it is writing."""
    unlocked = [scene for scene in obj.users_scene if not scene.render.use_lock_interface]
    for scene in unlocked:
        scene.render.use_lock_interface = True
    return ["Render > Lock Interface was switched on, for safe renders."] if unlocked else []


def unbind(obj):
    """Remove the result; handles, their empties and the settings stay."""
    rig = obj.exemplar
    shown = results.shown_object(obj)
    if shown is not None:
        follow.unfollow(shown)
    bindings.discard(obj)
    results.remove(obj)
    for item in rig.handles:
        item.bound_index = -1
    rig.fingerprint = ""
    rig.bound = False
    bindings.rigs.forget()
