# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits in the plane become edits of the signals.

The meshes of the pose space are what the artist sees, and what undo brings back: they are the
truth, and the native sequence follows. Control points and marks that were not touched are not
written again, so that nothing changes outside of an edit's support.
"""

import time

import numpy

from ...native import ExemplarError
from . import packing, plane, polygon, store

# Of the scaling, while a hand drags a mark; the rest follows when it is still.
ITERATIONS_IN_HAND = 12
# On the text: the control points of the last fit, float64 [k][2]. What the artist has added to them
# is kept when a mark is moved.
FITTED = "exemplar_fitted"
# There as well: the curve was drawn, not fitted, and stays as it is when a mark is moved.
DRAWN = "exemplar_drawn"


def sync(owner, state, in_hand=False):
    """Take what was edited since the last time. Raises ExemplarError where it cannot be taken; the
    sequence then stays as it was."""
    if owner.library is not None or owner.exemplar_sequence.data.library is not None:
        return
    try:
        _sync_marks(owner, state, in_hand)
        _sync_curve(owner, state)
        state.undone = False
        state.problem = None
    except ExemplarError as error:
        state.problem = error
        raise


def settle(owner, state):
    """The hand is still: let the marks relax to the end, and pack the sequence."""
    if state.unsettled:
        state.unsettled = False
        pins = _pins(
            state.marks, plane.read_marks(owner.exemplar_sequence.marks, len(state.marks))[1]
        )
        _place(owner, state, pins, 0)
    store.keep(owner, state)


# ------------------------------------------------------------------------------------------- marks


def _sync_marks(owner, state, in_hand):
    marks = owner.exemplar_sequence.marks
    count = state.sequence.window().fitted_frame_count
    places, pinned = plane.read_marks(marks, count)
    if state.marks is None or state.undone:
        state.marks = numpy.float32(state.sequence.marks()[0])
        if not numpy.array_equal(places, state.marks):
            # Undo in Edit Mode, or another file's edit: this layout, and no other.
            _place(owner, state, _pins(places, numpy.ones(count, bool)), 0, pinned)
            return
    moved = numpy.flatnonzero((places != state.marks).any(axis=1))
    if not len(moved):
        return
    pinned[moved] = True
    iterations = ITERATIONS_IN_HAND if in_hand else 0
    _place(owner, state, _pins(places, pinned), iterations, pinned, moved)
    state.unsettled = in_hand
    state.changed_at = time.monotonic()
    if not in_hand:
        store.keep(owner, state)


def _pins(places, pinned):
    return {int(index): tuple(map(float, places[index])) for index in numpy.flatnonzero(pinned)}


def _place(owner, state, pins, iterations, pinned=None, moved=()):
    """Pin, relax, fit anew; then show where everything is."""
    data = owner.exemplar_sequence
    if store.text_of(owner).get(DRAWN):
        _place_under_curve(state.sequence, pins, iterations)
    else:
        _place_and_fit(owner, state, pins, iterations)
    marks = numpy.float32(state.sequence.marks()[0])
    if pinned is None:
        pinned = plane.read_marks(data.marks, len(marks))[1]
    plane.write_marks(data.marks, marks, pinned, moved)
    state.marks = marks
    show_curve(owner, state)
    store.touch(state, shapes=True)


def _place_under_curve(sequence, pins, iterations):
    """The drawn curve stays, with its frames at an even pace."""
    points, knots, frame_count = (
        sequence.control_points(),
        sequence.knots(),
        sequence.info.frame_count,
    )
    _place_natively(sequence, pins, iterations)
    sequence.draw(points, frame_count, knots)


def _place_and_fit(owner, state, pins, iterations):
    """The curve is fitted to the frames where they are now; what was added to it by hand stays."""
    added = _added_by_hand(owner, state)
    _place_natively(state.sequence, pins, iterations)
    fitted = state.sequence.control_points()
    keep_fitted(store.text_of(owner), fitted)
    if added.any():
        state.sequence.move_control_points(0, fitted + added)


def _place_natively(sequence, pins, iterations):
    try:
        sequence.place(pins, iterations)
    except ExemplarError as error:
        raise ExemplarError(f"The frames cannot be placed like that: {error}.") from error


def _added_by_hand(owner, state):
    """What the artist has moved the control points by since they were fitted, [k][2]."""
    now = state.sequence.control_points()
    fitted = fitted_points(owner, state)
    if fitted.shape != now.shape:
        raise ExemplarError(
            "The curve has other control points than the fit gave it, and moving frames would lose "
            "them. Press Reset Curve first, or undo the move."
        )
    return now - fitted


def fitted_points(owner, state):
    """The control points of the last fit, float64 [k][2]."""
    text = store.text_of(owner)
    if FITTED not in text:
        return state.sequence.control_points()
    return numpy.frombuffer(packing.read_bytes(text, FITTED), numpy.float64).reshape(-1, 2)


def keep_fitted(text, points):
    packing.write_bytes(text, FITTED, points.tobytes())


def pin(owner, state, indices):
    """Hold marks where they are."""
    _set_pinned(owner, state, indices, True)


def unpin(owner, state, indices):
    """Let marks go where the others want them."""
    _set_pinned(owner, state, indices, False)


def _set_pinned(owner, state, indices, is_pinned):
    count = state.sequence.window().fitted_frame_count
    places, pinned = plane.read_marks(owner.exemplar_sequence.marks, count)
    pinned[list(indices)] = is_pinned
    _place(owner, state, _pins(places, pinned), 0, pinned)
    store.keep(owner, state)


# ------------------------------------------------------------------------------------------- curve


def _sync_curve(owner, state):
    cyclic = state.sequence.info.cyclic
    points = plane.read_curve(owner.exemplar_sequence.curve, cyclic)
    if state.curve is None or state.undone:
        state.curve = numpy.float32(state.sequence.control_points())
    if numpy.array_equal(points, state.curve):
        return
    known = state.history.get(points.tobytes()) if len(points) != len(state.curve) else None
    if known is not None:
        store.take_back(state, known)
    elif len(points) != len(state.curve):
        _change_number(owner, state, points, cyclic)
    else:
        polygon.apply(state.sequence, state.curve.tolist(), points.tolist(), cyclic)
    state.curve = points
    state.changed_at = time.monotonic()
    store.touch(state)


def _change_number(owner, state, points, cyclic):
    """Control points come or go: undo in Edit Mode is to find both states again."""
    before = packing.dump(state.sequence)
    store.remember(state, before)
    try:
        polygon.apply(state.sequence, state.curve.tolist(), points.tolist(), cyclic)
    except ExemplarError as error:
        store.take_back(state, before)
        raise ExemplarError(f"The curve cannot be like that: {error}") from error
    state.curve = points
    after = packing.dump(state.sequence)
    store.remember(state, after)
    text = store.text_of(owner)
    packing.write(text, after)
    state.revision = text[packing.REVISION]


def reset_curve(owner, state):
    """The curve of the fit, and the marks where they are."""
    marks = numpy.float32(state.sequence.marks()[0])
    data = owner.exemplar_sequence
    if plane_is_whole(owner):
        marks, _ = plane.read_marks(data.marks, len(marks))
    frame_count = state.sequence.info.frame_count
    state.sequence.place(_pins(marks, numpy.ones(len(marks), bool)))
    if store.text_of(owner).get(DRAWN):
        state.sequence.draw(state.sequence.control_points(), frame_count)
    keep_fitted(store.text_of(owner), state.sequence.control_points())
    state.marks = numpy.float32(state.sequence.marks()[0])
    if data.curve is not None:
        show_curve(owner, state)
    store.keep(owner, state)


def plane_is_whole(owner):
    data = owner.exemplar_sequence
    parts = (data.plane, data.curve, data.marks, data.playhead)
    return all(part is not None and part.users_scene for part in parts)


def show_curve(owner, state):
    state.curve = numpy.float32(state.sequence.control_points())
    plane.write_curve(owner.exemplar_sequence.curve, state.curve, state.sequence.info.cyclic)
    store.touch(state)


def show_marks(owner, state, pinned):
    """The marks as the sequence has them, also where their number has changed."""
    state.marks = numpy.float32(state.sequence.marks()[0])
    plane.write_marks(owner.exemplar_sequence.marks, state.marks, pinned)
    store.touch(state, shapes=True)


def redraw(owner, state):
    """Write the whole pose space as the sequence has it now."""
    show_marks(owner, state, state.sequence.marks()[1])
    show_curve(owner, state)
