# SPDX-License-Identifier: GPL-3.0-or-later
"""What to tell the artist: what is wrong, what is at work, what to do next.

Draw functions ask, so nothing here writes to Blender's data.
"""

import time
from dataclasses import dataclass

from ..native import ExemplarError, library
from ..native.declarations import Kind
from . import bindings, deformers, exemplars, fingerprint, handles, meshes, solving

RECHECK_AFTER = 2.0  # seconds

_library_checked = (0.0, None)
_last_errors = {}  # owner name -> ExemplarError of the last operator that failed on it


@dataclass(frozen=True)
class Line:
    icon: str
    text: str


def remember(obj, error):
    _last_errors[bindings.owner_name(obj)] = error


def forget(obj):
    _last_errors.pop(bindings.owner_name(obj), None)


def last_error(obj):
    """The ExemplarError of the last operator that failed on an object, or None."""
    return _last_errors.get(bindings.owner_name(obj))


def library_problem():
    """Why there is no native library, or "". Panels ask at every redraw, the disk is asked less."""
    global _library_checked
    at, problem = _library_checked
    if problem is None or time.monotonic() - at > RECHECK_AFTER:
        try:
            library()
            problem = ""
        except ExemplarError as error:
            problem = str(error)
        _library_checked = (time.monotonic(), problem)
    return problem


def describe(obj):
    """[Line], the most important first."""
    problem = library_problem()
    if problem:
        return [Line("ERROR", problem)]
    if obj is None:
        return [Line("INFO", "Select a mesh that has shape keys.")]
    lines = []
    error = _last_errors.get(bindings.owner_name(obj))
    if error is not None:
        lines.append(Line("ERROR", str(error)))
    return lines + (_describe_bound(obj) if obj.exemplar.bound else [_next_step(obj)])


def _next_step(obj):
    return Line("INFO", why_not_ready(obj) or "Ready: press Bind.")


def why_not_ready(obj):
    """The next thing to do before Bind, or ""."""
    type_ = deformers.chosen(obj)
    needed = type_.exemplars_needed
    if needed and not meshes.exemplar_keys(obj):
        return "Sculpt poses of the mesh as shape keys: each is an exemplar."
    if len(exemplars.enabled_names(obj)) < needed:
        return f"Switch on {exemplars.at_least(needed)}."
    count = len(obj.exemplar.handles)
    if count < type_.handles_needed:
        what = "Add handles" if count == 0 else "Add one more handle"
        return f"{what}: select vertices in Edit Mode, then press Add Handle."
    mode = solving.paused_by(obj)
    return f"Leave {mode}, then press Bind." if mode else ""


def _describe_bound(obj):
    mode = solving.paused_by(obj)
    if mode:
        return [Line("PAUSE", f"Paused in {mode}. The mesh follows again when you leave it.")]
    state = bindings.peek(obj)
    lines = []
    missing = handles.first_missing(obj)
    if missing is not None:
        # Blender may delete an empty without telling the handlers.
        lines.append(Line("ERROR", handles.missing_sentence(missing)))
    elif state is not None and state.problem is not None:
        lines.append(Line("ERROR", str(state.problem)))
    elif not obj.exemplar.live:
        lines.append(Line("PAUSE", "Live is off. The mesh keeps the shape that it has."))
    elif state is not None and state.result is not None:
        lines.append(_describe_result(state))
    else:
        lines.append(Line("CHECKMARK", "Bound. Move the handles."))
    if changes := pending(obj):
        lines.append(Line("FILE_REFRESH", f"Press Rebind to use the changed {changes}."))
    if obj.show_only_shape_key and obj.exemplar.bound_target == "KEY":
        lines.append(
            Line("PINNED", "Shape Key Lock is on, which hides the result. Switch the pin off.")
        )
    if state is not None:
        lines += [Line("ERROR", sentence) for sentence, _ in state.warnings]
    return lines


def _describe_result(state):
    report, note = state.result.report, state.result.note
    said = f"Following ({note})" if note else "Following"
    if report.capped:
        return Line("CHECKMARK", f"{said}; Tolerance not reached.")
    if report.warning:
        return Line("INFO", f"{said}. Note: {report.warning}.")
    return Line("CHECKMARK", f"{said}.")


def pending(obj):
    """What was changed since Bind and takes effect at the next, or ""."""
    rig = obj.exemplar
    bound = fingerprint.read(obj)
    type_ = deformers.chosen(obj)
    changed = []
    if type_.identifier != bound["deformer"]:
        changed.append("deformer")
    # By number: a renamed key is the same exemplar, and a removed one has a message of its own.
    on = exemplars.enabled_names(obj)
    off = len(exemplars.all_names(obj)) - len(on)
    switched_off = {item.name for item in rig.exemplars if not item.enabled}
    differ = len(on) != len(bound["exemplars"])
    off = off and switched_off.intersection(name for name, _ in bound["exemplars"])
    if bound["exemplars"] and (differ or off):
        changed.append("exemplars")
    if any(
        item.bound_index < 0
        or int(Kind[item.kind]) != item.bound_kind
        or item.radius != item.bound_radius
        for item in rig.handles
    ):
        changed.append("handles")
    if type_.identifier == bound["deformer"]:
        now = type_.bind_settings(obj)
        words = type_.words()
        changed += [words[name] for name in now if now[name] != bound["settings"].get(name)]
    if rig.target != rig.bound_target:
        changed.append("place of the result")
    return " and ".join([", ".join(changed[:-1]), changed[-1]] if changed[1:] else changed)


def problem_vertices(obj):
    """Vertices that the last error or the bind's warnings are about: a sequence, maybe empty."""
    state = bindings.peek(obj) if obj.exemplar.bound else None
    errors = [_last_errors.get(bindings.owner_name(obj)), state and state.problem]
    for error in errors:
        if error is not None and len(error.vertices):
            return error.vertices
    found = set()
    for _, vertices in state.warnings if state is not None else ():
        found.update(int(vertex) for vertex in vertices)
    return sorted(found)
