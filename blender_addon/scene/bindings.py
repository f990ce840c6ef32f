# SPDX-License-Identifier: GPL-3.0-or-later
"""One native deformer for each bound object, in one table.

The file holds a UUID and a fingerprint; the deformer is memory. It is made again when it is needed
and not there: after load, undo, append, or when the add-on was off for a while. Owners vanish
without telling (undo, deletion), so the table is pruned by looking.
"""

import threading
import uuid
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy

from ..native import Deformer, ExemplarError, Flaw, Mesh
from . import deformers, fingerprint, inputs, rigs

# Deformers whose owner is gone, kept for the redo that may bring it back.
ORPHANS_KEPT = 2

_table = {}
_lock = threading.RLock()  # a render has a thread of its own


@dataclass
class State:
    """What is known at run time of one bound object."""

    owner: tuple  # (name, library path or None)
    deformer: Deformer = None
    fingerprint: str = ""  # of what the deformer was made from
    centres: Any = None  # float64 [H][3]
    live_key: tuple = ()  # of deformers.base, as it was last looked at
    live_digest: str = ""  # of the live data that the deformer has
    verified: bool = False  # compared with its fingerprint since it last changed
    verify_later: bool = False  # ... and that can wait until the hand is still
    problem: ExemplarError = None  # why the result is not up to date
    mismatch: ExemplarError = None  # the part of it that only an edit or a Rebind can end
    warnings: list = field(default_factory=list)  # [(sentence, vertices)] from the bind
    mode: str = ""  # the one that holds up solving

    # For live updates.
    shown: Any = None  # inputs of the result that the artist sees
    seen: dict = field(default_factory=dict)  # scene name -> its last inputs
    frame_written: bool = False  # by us, and the next update will report it as a change
    settled: bool = True  # what is shown is the stateless result
    changed_at: float = 0.0
    stateless_seconds: float = 0.0
    result: Any = None  # the last SolveResult
    answers: Any = None  # what was asked for then
    solves: int = 0

    def forget_shown(self):
        self.shown = None
        self.seen.clear()
        self.settled = True

    def close(self):
        if self.deformer is not None:
            self.deformer.close()
            self.deformer = None


def owner_name(obj):
    return (obj.name, obj.library.filepath if obj.library else None)


def state_of(obj):
    """The state of a bound object, made if need be. Objects copied with one UUID are told apart."""
    with _lock:
        name = owner_name(obj)
        key = _key(obj)
        state = _table.get(key)
        if state is not None and state.owner != name:
            other = bpy.data.objects.get(state.owner)
            if other is not None and other != obj and _key(other) == key:
                key, state = _make_unique(obj, key), None
            else:
                state.owner = name  # renamed
        if state is None:
            state = _table[key] = State(owner=name)
        return state


def peek(obj):
    """The state of an object if there is one; writes nothing, so that draw functions may ask."""
    state = _table.get(_key(obj))
    return state if state is not None and state.owner == owner_name(obj) else None


def _key(obj):
    # Linked objects keep the UUID of their file, which may be open twice.
    return (obj.exemplar.uuid, owner_name(obj) if obj.library else None)


def _make_unique(obj, key):
    if obj.library:
        return (key[0], owner_name(obj))
    obj.exemplar.uuid = new_uuid()
    return _key(obj)


def new_uuid():
    return str(uuid.uuid4())


# ------------------------------------------------------------------------------------- lifetimes


def ensure(obj, verify=True):
    """The state of a bound object with a deformer that fits it, or ExemplarError."""
    state = state_of(obj)
    with _lock:
        stale = state.deformer is None or state.fingerprint != obj.exemplar.fingerprint
        live_key = deformers.bound(obj).live_key(obj)
        if live_key != state.live_key:
            state.live_key = live_key
            state.verified = False
        if state.mismatch is not None and state.verified:
            raise state.mismatch
        if stale or (verify and not state.verified):
            state.verified = True
            state.mismatch = None
            try:
                _bring_up_to_date(obj, state, stale)
            except ExemplarError as mismatch:
                state.mismatch = mismatch
                raise
        return state


def _bring_up_to_date(obj, state, stale):
    names = fingerprint.names(obj)
    fingerprint.check_size(obj)
    gathered = inputs.as_bound(obj, names)
    fingerprint.check(obj, gathered)
    if stale:
        deformer, warnings = build(gathered)
        install(obj, gathered, deformer, warnings)
    elif _digest(gathered) != state.live_digest:
        deformers.bound(obj).apply(state.deformer, gathered)
        state.live_digest = _digest(gathered)


def build(gathered, progress=None):
    """The native part of a bind, free of bpy, so that it can run in a thread.

    Returns the deformer and what was found on the way: [(sentence, vertices)].
    """
    with Mesh(gathered.reference, gathered.triangles) as mesh:
        warnings = _mesh_warnings(mesh, gathered.triangles)
        deformer = deformers.TYPES[gathered.deformer].build(mesh, gathered, progress)
    if deformer.warning and not mesh.warning:
        # The library's sentences have neither capital nor full stop, to be put into others.
        warnings.append((f"{deformer.warning[0].upper()}{deformer.warning[1:]}.", ()))
    return deformer, warnings


def _mesh_warnings(mesh, triangles):
    """Flaws of the mesh that a bind puts up with."""
    warnings = []
    edges = mesh.flaws(Flaw.NON_MANIFOLD_EDGE)
    if len(edges):
        count = "One edge is" if len(edges) == 1 else f"{len(edges)} edges are"
        warnings.append((f"{count} non-manifold; check the result there.", numpy.unique(edges)))
    faces = mesh.flaws(Flaw.DEGENERATE_FACE)
    if len(faces):
        count = "One triangle has" if len(faces) == 1 else f"{len(faces)} triangles have"
        vertices = numpy.unique(triangles[faces])
        warnings.append((f"{count} no area; check the result there.", vertices))
    return warnings


def _digest(gathered):
    return "" if gathered.live is None else gathered.live.digest


def install(obj, gathered, deformer, warnings):
    """Put a new deformer in the place of the old one."""
    with _lock:
        state = state_of(obj)
        state.close()
        state.deformer = deformer
        state.fingerprint = fingerprint.of(gathered)
        state.centres = gathered.centres
        state.live_key = deformers.bound(obj).live_key(obj)
        state.live_digest = _digest(gathered)
        state.warnings = warnings
        state.verified = True
        state.problem = state.mismatch = None
        state.forget_shown()
        state.answers = None
    prune()


def invalidate(obj):
    """The object may have been edited: compare it with its fingerprint before the next solve."""
    state = peek(obj)
    if state is not None:
        state.verified = False


def invalidate_all():
    """Undo and redo may have changed anything, and freed what we remember."""
    rigs.forget()
    with _lock:
        for state in _table.values():
            state.verified = False
            state.problem = None
            state.forget_shown()
    prune()


def discard(obj):
    with _lock:
        state = _table.pop(_key(obj), None)
        if state is not None:
            state.close()


def prune():
    """Close the deformers of objects that are gone, but for the latest."""
    with _lock:
        living = {_key(obj) for obj in rigs.bound_rigs()}
        orphans = [key for key in _table if key not in living]
        for key in orphans[: max(0, len(orphans) - ORPHANS_KEPT)]:
            _table.pop(key).close()


def clear():
    with _lock:
        for state in _table.values():
            state.close()
        _table.clear()
    rigs.forget()


def deformer_count():
    return sum(state.deformer is not None for state in _table.values())
