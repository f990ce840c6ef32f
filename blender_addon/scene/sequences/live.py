# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh follows its sequence: Blender's handlers, and a timer for what can wait.

Every shape depends on time or playhead and on the pose space alone, never on the frame before: so
renders, sub-frames of motion blur and background mode show what the viewport shows.
"""

import threading
import time

import bpy
from bpy.app.handlers import persistent

from ...native import ExemplarError
from .. import event_handlers
from ..live import is_interactive, redraw_panels
from . import owners, solving, store, syncing

# The hand counts as still after this.
STILL_AFTER = 0.12
TICK = 0.04

_inside = threading.local()  # of a handler, in this thread
_waiting = set()  # names of owners whose pose space is to be settled and packed


# ---------------------------------------------------------------------------------------- handlers


@persistent
def on_frame_change(scene, depsgraph):
    """Also fires for the sub-frames of motion blur, in any order."""
    _update_scene(scene, depsgraph, frame_changed=True)


@persistent
def on_depsgraph_update(scene, depsgraph):
    _update_scene(scene, depsgraph, frame_changed=False)


@persistent
def on_load(*_):
    _waiting.clear()
    store.clear()


@persistent
def on_undo(*_):
    store.invalidate_all()


@persistent
def on_save(*_):
    """What was edited and not packed yet."""
    for owner in owners.every():
        state = store.peek(owner)
        if state is not None and owner.name in _waiting:
            _finish(owner, state)
    _waiting.clear()


def _update_scene(scene, depsgraph, frame_changed):
    # Our own writes make Blender call again.
    if getattr(_inside, "now", False):
        return
    found = owners.every()
    if not found:
        return
    _inside.now = True
    try:
        edited = {u.id.name for u in depsgraph.updates if isinstance(u.id, bpy.types.Mesh)}
        for owner in found:
            if owner.evaluated_get(depsgraph).is_evaluated:
                _update(owner, scene, depsgraph, frame_changed, edited)
    finally:
        _inside.now = False


def _update(owner, scene, depsgraph, frame_changed, edited):
    shown = store.shown(owner)
    shown.mode = solving.paused_by(owner)
    try:
        state = store.ensure(owner)
        _take_edits(owner, state, edited)
        if shown.mode or not owner.exemplar_sequence.live:
            return
        inputs = solving.read_inputs(owner, state, depsgraph)
        if _is_news(shown, scene, inputs, frame_changed):
            _show(owner, state, shown, inputs)
        _report(shown, None)
    except ExemplarError as error:
        _report(shown, error)


def _take_edits(owner, state, edited):
    """What is wrong with the pose space is said, and the mesh goes on with the last good one."""
    data = owner.exemplar_sequence
    meshes = [part.data.name for part in (data.curve, data.marks) if part is not None]
    in_edit_mode = any(
        part is not None and part.mode == "EDIT" for part in (data.curve, data.marks)
    )
    if in_edit_mode and not (state.undone or edited.intersection(meshes)):
        return
    before = state.edits
    try:
        syncing.sync(owner, state, in_hand=is_interactive())
    except ExemplarError:
        redraw_panels()
    if state.edits != before:
        _later(owner)


def _is_news(shown, scene, inputs, frame_changed):
    """Two scenes that share an object may each want another shape: the one that changed last has
    it. Without the memory of what each wanted they would overwrite one another for ever."""
    previous = shown.seen.get(scene.name)
    shown.seen[scene.name] = inputs
    if frame_changed:
        return inputs != shown.inputs
    return inputs != shown.inputs and inputs != previous


def _show(owner, state, shown, inputs):
    solving.show(owner, solving.evaluate(state, inputs))
    shown.inputs = inputs
    shown.updates += 1


def _report(shown, problem):
    if str(problem or "") != str(shown.problem or ""):
        redraw_panels()
    shown.problem = problem


# -------------------------------------------------------------------------------------------- work


def update(owner, depsgraph=None):
    """Show the shape now, whether something changed or not. Raises ExemplarError."""
    shown = store.shown(owner)
    try:
        mode = solving.paused_by(owner)
        if mode:
            raise ExemplarError(f"'{owner.name}' is in {mode}, where its mesh is held still.")
        state = store.ensure(owner)
        if syncing.plane_is_whole(owner):
            syncing.sync(owner, state)
        if depsgraph is None:
            depsgraph = bpy.context.evaluated_depsgraph_get()
        _show(owner, state, shown, solving.read_inputs(owner, state, depsgraph))
        _report(shown, None)
    except ExemplarError as error:
        _report(shown, error)
        raise


# ------------------------------------------------------------------------------------------- timer


def _later(owner):
    _waiting.add(owner.name)
    if not bpy.app.background and not bpy.app.timers.is_registered(on_timer):
        bpy.app.timers.register(on_timer, first_interval=TICK)


def on_timer():
    """Pack what the last edit changed, once the hand is still."""
    if bpy.app.is_job_running("RENDER"):
        return TICK
    for name in list(_waiting):
        owner = bpy.data.objects.get(name)
        state = store.peek(owner) if owner is not None and owners.is_owner(owner) else None
        if state is None:
            _waiting.discard(name)
        elif time.monotonic() - state.changed_at > STILL_AFTER:
            _waiting.discard(name)
            _finish(owner, state)
    return TICK if _waiting else None


def _finish(owner, state):
    was_unsettled = state.unsettled
    _inside.now = True
    try:
        syncing.settle(owner, state)
        if was_unsettled and owner.exemplar_sequence.live and not solving.paused_by(owner):
            depsgraph = bpy.context.evaluated_depsgraph_get()
            inputs = solving.read_inputs(owner, state, depsgraph)
            _show(owner, state, store.shown(owner), inputs)
    except ExemplarError as error:
        state.problem = error
    finally:
        _inside.now = False
    redraw_panels()


# ------------------------------------------------------------------------------------ registration

_HANDLERS = (
    ("frame_change_post", on_frame_change),
    ("depsgraph_update_post", on_depsgraph_update),
    ("load_post", on_load),
    ("undo_post", on_undo),
    ("redo_post", on_undo),
    ("save_pre", on_save),
)


def register():
    event_handlers.add(_HANDLERS)


def unregister():
    event_handlers.remove(_HANDLERS, on_timer)
    store.clear()
