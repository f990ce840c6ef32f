# SPDX-License-Identifier: GPL-3.0-or-later
"""A solve: from the empties of a bound object to the positions of its mesh.

    result = solve(obj)   # what renders and bakes show
"""

import time
from dataclasses import dataclass
from typing import Any

import bpy
import numpy

from ..native import Element, ExemplarError, SolveReport
from . import bindings, deformers, handles, results

# Modes in which Blender holds the mesh's coordinates elsewhere and would write them back over ours.
PAUSING_MODES = {"EDIT": "Edit Mode", "SCULPT": "Sculpt Mode"}


@dataclass(frozen=True)
class SolveResult:
    positions: numpy.ndarray  # float32 [V][3], in the object's space
    report: SolveReport
    note: str  # what else the solve found, for the status line
    blend_average: Any  # float64 [S], sums to 1; None for kinds that do not blend


@dataclass(frozen=True)
class SolveInputs:
    """All that a stateless result depends on, and what else is mixed in where it is shown."""

    targets: bytes
    settings: Any  # of the kind of deformer
    live: str  # digest of its live data
    influences: tuple

    def solve_part(self):
        return (self.targets, self.settings, self.live)


def solve(obj, depsgraph=None, stateless=True):
    """The result for the empties as they are in `depsgraph` (default: of the context, updated).

    Writes nothing to the object. Raises ExemplarError in words for the artist.
    """
    if not obj.exemplar.bound:
        raise ExemplarError(f"'{obj.name}' is not bound. Press Bind.")
    refuse_paused(obj)
    if depsgraph is None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
    state = bindings.ensure(obj)
    return run(obj, state, read_inputs(obj, state, depsgraph), stateless)


def paused_by(obj):
    """The mode that holds up solving, or ""."""
    if obj.mode in PAUSING_MODES:
        return PAUSING_MODES[obj.mode]
    shown = results.shown_object(obj)
    return PAUSING_MODES.get(shown.mode, "") if shown is not None else ""


def refuse_paused(obj):
    mode = paused_by(obj)
    if mode:
        raise ExemplarError(f"'{obj.name}' is in {mode}, where its mesh is held still. Leave it.")


def read_inputs(obj, state, depsgraph):
    targets = handles.targets(obj, depsgraph, state.centres)
    # Settings can be animated, so the evaluated ones count.
    settings = deformers.bound(obj).solve_settings(obj.evaluated_get(depsgraph).exemplar)
    influences = results.influences(obj, depsgraph)
    return SolveInputs(targets.tobytes(), settings, state.live_digest, influences)


def run(obj, state, inputs, stateless):
    """Solve for inputs that were read before; needs neither depsgraph nor scene."""
    question = (inputs.solve_part(), stateless)
    if stateless and state.result is not None and state.answers == question:
        # A bake asks for what the frame change has solved just now.
        return state.result
    targets = numpy.frombuffer(inputs.targets).reshape(-1, 3, 4)
    type_ = deformers.bound(obj)
    began = time.perf_counter()
    deformer = state.deformer
    try:
        with deformer.lock:
            report = type_.solve(deformer, targets, inputs.settings, stateless)
            note = type_.note(deformer, inputs.settings)
            blend = type_.blend_average(deformer)
            result = SolveResult(deformer.positions(), report, note, blend)
    except ExemplarError as error:
        raise named(obj, error) from error
    if stateless:
        state.stateless_seconds = time.perf_counter() - began
    state.solves += 1
    state.result, state.answers = result, question
    return result


def named(obj, error):
    """The library knows handles by number, the artist by name."""
    if error.element == Element.HANDLE and error.index is not None:
        items = handles.bound_items(obj) or list(obj.exemplar.handles)
        if error.index < len(items):
            text = f"Handle '{handles.label(items[error.index])}': {error}."
            return ExemplarError(text, error.status, error.element, error.index, error.vertices)
    return error
