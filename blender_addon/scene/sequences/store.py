# SPDX-License-Identifier: GPL-3.0-or-later
"""One native sequence for each packed one, in one table: made when it is needed and not there, and
made again when undo has brought back other bytes."""

import threading
from dataclasses import dataclass, field
from typing import Any

import bpy

from ...native import ExemplarError, Sequence
from . import owners, packing

_table = {}  # (identity, library path) -> State
_shown = {}  # owner name -> Shown
_lock = threading.RLock()  # a render has a thread of its own

STATES_KEPT = 64  # of the curve, for undo in Edit Mode


@dataclass
class State:
    """What is known at run time of one packed sequence."""

    sequence: Sequence
    revision: str
    edits: int = 0  # changes with the native sequence
    shapes: int = 0  # changes with the shapes of the plane, not with the curve
    # The pose space as it was last read or written; float32, None: not yet.
    curve: Any = None  # [k][2] in order
    marks: Any = None  # [n][2]
    undone: bool = False  # undo may have changed the meshes of the pose space
    unsettled: bool = False  # marks may still relax
    changed_at: float = 0.0
    problem: ExemplarError = None  # why an edit of the pose space is not taken
    history: dict = field(default_factory=dict)  # curve bytes -> packed bytes


@dataclass
class Shown:
    """What is known at run time of one object that shows a sequence."""

    inputs: Any = None  # solving.Inputs
    seen: dict = field(default_factory=dict)  # scene name -> its last inputs
    problem: ExemplarError = None
    mode: str = ""
    updates: int = 0


def text_of(owner):
    text = owner.exemplar_sequence.data
    if text is None:
        raise ExemplarError(
            f"The text with the sequence of '{owner.name}' was deleted. "
            "Undo that, or capture the animation again."
        )
    return text


def ensure(owner):
    """The State of the sequence that an object shows, or ExemplarError."""
    text = text_of(owner)
    key = _key(text)
    revision = text.get(packing.REVISION, "")
    with _lock:
        state = _table.get(key)
        if state is None or state.revision != revision:
            sequence = packing.parse(packing.read(text))
            if state is not None:
                state.sequence.close()
            state = _table[key] = State(sequence, revision)
            touch(state, shapes=True)
            state.undone = True
        return state


def peek(owner):
    text = owner.exemplar_sequence.data
    return _table.get(_key(text)) if text is not None else None


def shown(owner):
    return _shown.setdefault(_name(owner), Shown())


def peek_shown(owner):
    return _shown.get(_name(owner))


def keep(owner, state):
    """Pack what was changed."""
    text = text_of(owner)
    with _lock:
        packing.write(text, packing.dump(state.sequence))
        state.revision = text[packing.REVISION]


def touch(state, shapes=False):
    """The native sequence has changed: whoever shows it has to look."""
    state.edits = _next_edit()
    if shapes:
        state.shapes = state.edits


def adopt(text, sequence):
    """A sequence that was just packed in `text`."""
    with _lock:
        old = _table.get(_key(text))
        if old is not None:
            old.sequence.close()
        state = State(sequence, text[packing.REVISION])
        touch(state, shapes=True)
        _table[_key(text)] = state
    prune()
    return state


def take_back(state, data):
    """Put an earlier state of the sequence in the place of the present one."""
    sequence = packing.parse(data)
    with _lock:
        state.sequence.close()
        state.sequence = sequence
    touch(state, shapes=True)


def remember(state, data):
    """For undo in Edit Mode, which brings back the curve and nothing else."""
    state.history[state.curve.tobytes()] = data
    while len(state.history) > STATES_KEPT:
        state.history.pop(next(iter(state.history)))


def invalidate_all():
    """Undo and redo may have changed anything."""
    owners.forget()
    with _lock:
        for state in _table.values():
            state.undone = True
            state.problem = None
        _shown.clear()
    prune()


def prune():
    """Close the sequences whose text is gone."""
    with _lock:
        living = {_key(text) for text in bpy.data.texts if packing.IDENTITY in text}
        for key in [key for key in _table if key not in living]:
            _table.pop(key).sequence.close()


def clear():
    with _lock:
        for state in _table.values():
            state.sequence.close()
        _table.clear()
        _shown.clear()
    owners.forget()


def sequence_count():
    return len(_table)


_edits = 0


def _next_edit():
    """A number that no state had before: equal numbers mean an equal sequence."""
    global _edits
    _edits += 1
    return _edits


def _key(text):
    return (text.get(packing.IDENTITY, text.name), text.library.filepath if text.library else None)


def _name(owner):
    return (owner.name, owner.library.filepath if owner.library else None)
