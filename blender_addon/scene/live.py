# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh follows its handles: Blender's handlers, and a timer for what can wait.

What renders and bakes give is the stateless result, which depends on the empties and settings
alone. Every frame change shows it. In the viewport a mesh that takes long follows the hand by warm
solves; as soon as the hand is still, the stateless result takes their place.
"""

import threading
import time

import bpy
from bpy.app.handlers import persistent

from ..native import ExemplarError
from . import background, bindings, event_handlers, figures, results, rigs, solving

# A stateless result that takes up to this long is not felt in a drag.
STATELESS_LIMIT = 0.004
# The hand counts as still after this.
STILL_AFTER = 0.12
TICK = 0.02

_inside = threading.local()  # of a handler, in this thread


# -------------------------------------------------------------------------------------- handlers


@persistent
def on_frame_change(scene, depsgraph):
    """Also fires for the sub-frames of motion blur, in any order."""
    _update_scene(scene, depsgraph, frame_changed=True)


@persistent
def on_depsgraph_update(scene, depsgraph):
    _update_scene(scene, depsgraph, frame_changed=False)


@persistent
def on_load(*_):
    bindings.clear()
    figures.forget()


@persistent
def on_undo(*_):
    bindings.invalidate_all()


@persistent
def on_save(*_):
    """A file holds what a render of it would show."""
    for obj in rigs.bound_rigs():
        state = bindings.peek(obj)
        if state is not None and not state.settled and not solving.paused_by(obj):
            _settle(obj, state)


def _update_scene(scene, depsgraph, frame_changed):
    # Our own writes make Blender call again.
    if getattr(_inside, "now", False):
        return
    _inside.now = True
    try:
        bound = rigs.bound_rigs()
        edited = set() if frame_changed or not bound else _edited_meshes(depsgraph)
        for obj in bound:
            if _is_seen(obj, depsgraph):
                _update(obj, scene, depsgraph, frame_changed, edited)
    finally:
        _inside.now = False


def _is_seen(obj, depsgraph):
    """Whether the scene of the depsgraph shows the result."""
    shown = results.shown_object(obj) or obj
    return shown.evaluated_get(depsgraph).is_evaluated


def _edited_meshes(depsgraph):
    return {u.id.name for u in depsgraph.updates if isinstance(u.id, bpy.types.Mesh)}


def _update(obj, scene, depsgraph, frame_changed, edited):
    began = time.perf_counter()
    state = bindings.state_of(obj)
    if _is_paused(obj, state):
        return
    if obj.data.name in edited and not state.frame_written:
        _note_edit(state)
    state.frame_written = False
    if not obj.exemplar.live:
        return
    try:
        bindings.ensure(obj, verify=not state.verify_later)
        results.check(obj)
        inputs = solving.read_inputs(obj, state, depsgraph)
        if not _is_news(state, scene, inputs, frame_changed):
            _report(state, None)
            return
        stateless = frame_changed or not is_interactive()
        stateless = stateless or state.stateless_seconds < STATELESS_LIMIT
        _solve_and_show(obj, state, inputs, stateless)
        state.frame_written = frame_changed and is_interactive()
        _report(state, None)
        if figures.wanted():
            figures.note(began, state.result.report)
            redraw_panels()
    except ExemplarError as error:
        _report(state, error)


def _is_paused(obj, state):
    mode = solving.paused_by(obj)
    if not mode and state.mode:
        # The mesh may come out of its mode changed, and with the result key as it went in.
        state.verified = state.verify_later = False
        state.forget_shown()
    state.mode = mode
    return bool(mode)


def _note_edit(state):
    """Someone changed the mesh, perhaps an exemplar. It was not us: what a handler writes is
    evaluated without asking the handlers again (but for a frame change in a window, which the next
    update reports once more), and what else we write we flush."""
    state.verified = False
    if is_interactive():
        # A slider that is dragged changes the mesh at every step; compare when it is still.
        state.verify_later = True
        state.changed_at = time.monotonic()
        _start_timer()


def _is_news(state, scene, inputs, frame_changed):
    """Two scenes that share an object may each want another result: the one that changed last has
    it. Without the memory of what each wanted they would overwrite one another for ever."""
    previous = state.seen.get(scene.name)
    state.seen[scene.name] = inputs
    if frame_changed:
        return inputs != state.shown or not state.settled
    return inputs != state.shown and inputs != previous


def is_interactive():
    """Whether there is a hand that moves things and an event loop for timers."""
    return not bpy.app.background and not bpy.app.is_job_running("RENDER")


# ------------------------------------------------------------------------------------------ work


def update(obj, depsgraph=None):
    """Show the stateless result now, whether something changed or not. Raises ExemplarError."""
    state = bindings.state_of(obj)
    try:
        solving.refuse_paused(obj)
        if depsgraph is None:
            depsgraph = bpy.context.evaluated_depsgraph_get()
        bindings.ensure(obj)
        results.check(obj)
        inputs = solving.read_inputs(obj, state, depsgraph)
        _solve_and_show(obj, state, inputs, stateless=True)
        _flush()
        _report(state, None)
    except ExemplarError as error:
        _report(state, error)
        raise


def refresh(obj):
    """Take up what an operator of ours changed on a bound object."""
    bindings.invalidate(obj)
    if obj.exemplar.bound and obj.exemplar.live and not solving.paused_by(obj):
        update(obj)


def _solve_and_show(obj, state, inputs, stateless):
    result = solving.run(obj, state, inputs, stateless)
    results.show(obj, result.positions, inputs.influences)
    state.shown = inputs
    state.settled = stateless
    state.changed_at = time.monotonic()
    if not stateless:
        _start_timer()


def _settle(obj, state):
    _solve_and_show(obj, state, state.shown, stateless=True)


def _flush():
    """Evaluate what we wrote outside of a handler, without hearing of it as of an edit."""
    if getattr(_inside, "now", False):
        return
    _inside.now = True
    try:
        for window in bpy.context.window_manager.windows:
            window.view_layer.update()
    finally:
        _inside.now = False


def _report(state, problem):
    if str(problem or "") != str(state.problem or ""):
        redraw_panels()
    state.problem = problem


def redraw_panels():
    if not is_interactive():
        return  # a render has a thread of its own, and windows are not for it
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


# ----------------------------------------------------------------------------------------- timer


def _start_timer():
    if not bpy.app.background and not bpy.app.timers.is_registered(on_timer):
        bpy.app.timers.register(on_timer, first_interval=TICK)


def on_timer():
    """Finish what the last change left to do; returns when to be called again, or None."""
    if bpy.app.is_job_running("RENDER"):
        return TICK
    waiting = [_finish(obj) for obj in rigs.bound_rigs()]
    return TICK if any(waiting) else None


def _finish(obj):
    """True where there is more to do."""
    state = bindings.peek(obj)
    if state is None or solving.paused_by(obj) or (state.settled and not state.verify_later):
        return False
    is_still = time.monotonic() - state.changed_at > STILL_AFTER
    try:
        if is_still and state.verify_later:
            state.verify_later = False
            bindings.ensure(obj)
            _report(state, None)
            if _has_other_live_data(obj, state):
                update(obj)
        if not state.settled:
            _refine(obj, state, is_still)
            _flush()
    except ExemplarError as error:
        state.settled = True
        _report(state, error)
        return False
    return not state.settled or state.verify_later


def _has_other_live_data(obj, state):
    """A stroke of the brush has ended, and what is shown was solved before it."""
    return obj.exemplar.live and state.shown and state.shown.live != state.live_digest


def _refine(obj, state, is_still):
    """While the hand may yet move, go on from where the drag is; then show what a render shows."""
    if is_still:
        _settle(obj, state)
    else:
        changed_at = state.changed_at
        _solve_and_show(obj, state, state.shown, stateless=False)
        state.changed_at = changed_at


# ---------------------------------------------------------------------------------- registration

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
    background.cancel_all()
    bindings.clear()
