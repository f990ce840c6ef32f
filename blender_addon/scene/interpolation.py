# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames between keyed handle poses, by the deformer's own interpolation [Blended, 5]: rotations
of two solved poses are blended, and one global step makes a shape of them.

What is written are keyframes of the empties, so that the result is animation like any other: it can
be edited, rendered and baked.
"""

from contextlib import closing
from dataclasses import dataclass

import numpy

from ..native import ExemplarError, Kind
from . import bindings, deformers, handles, posing, solving, versions
from .baking.frames import walk

# A handle that two poses have in one place, up to this share of the mesh's size, stays there.
STAYS = 1e-4
PATHS = {"location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale"}


@dataclass(frozen=True)
class Between:
    """The frames that were found, and what they are to show."""

    frames: list
    targets: list  # float64 [H][3][4] each
    positions: list  # float32 [V][3] each


def why_not(obj):
    """Why there is no interpolation for a bound object, or ""."""
    if deformers.bound(obj).identifier != "BLENDED":
        return "Interpolation is what the deformer Blended does: choose it, and press Rebind"
    return ""


# ----------------------------------------------------------------------------------------- keyed


def keyed_frames(obj):
    """The whole frames on which a handle has a keyframe, rising."""
    found = set()
    for item in _moved(obj):
        for curve in versions.find_curves(item.empty) or ():
            if curve.data_path in PATHS:
                found |= {round(point.co[0]) for point in curve.keyframe_points}
    return sorted(found)


def _moved(obj):
    items = handles.bound_items(obj)
    return [i for i in items if i.bound_kind != Kind.FREE and not handles.is_missing(i)]


def choose(obj, scene, all_keys):
    """The keyed frames to interpolate over: those about the current one, or all of the scene's
    range. Raises ExemplarError."""
    keyed = keyed_frames(obj)
    if all_keys:
        keyed = [f for f in keyed if scene.frame_start <= f <= scene.frame_end]
    if len(keyed) < 2:
        raise ExemplarError(
            "There are no two keyed poses to interpolate between. Pose the handles and press "
            "Key All Handles on two frames."
        )
    if not all_keys:
        after = next((f for f in keyed[1:] if f > scene.frame_current), keyed[-1])
        keyed = [keyed[keyed.index(after) - 1], after]
    if keyed[-1] - keyed[0] < len(keyed):
        raise ExemplarError(
            f"There is no frame to fill between {keyed[0]} and {keyed[-1]}: every one of them is "
            "keyed."
        )
    return keyed


def refuse(obj):
    """Raise ExemplarError where the keys would not be obeyed."""
    for item in _moved(obj):
        animation = item.empty.animation_data
        if item.empty.constraints or (animation and (animation.drivers or animation.nla_tracks)):
            raise ExemplarError(
                f"'{item.empty.name}' is moved by constraints, drivers or the NLA, which would "
                "win over keyframes. Switch them off first."
            )
        if item.empty.library is not None:
            raise ExemplarError(f"'{item.empty.name}' is linked and cannot be keyed.")


# --------------------------------------------------------------------------------------- between


def find(obj, scene, depsgraph_of, keyed):
    """Generator of (fraction, stage) that returns Between. Nothing is changed."""
    state = bindings.ensure(obj)
    deformer = state.deformer
    total = keyed[-1] - keyed[0] + 1
    counts = numpy.array([item.bound_kind != Kind.FREE for item in handles.bound_items(obj)])
    keys, held = [], []
    with closing(walk(scene, keyed)) as frames:
        for frame in frames:
            # The handlers of the frame change may have done other solves with it.
            state.answers = None
            with deformer.lock:
                inputs = solving.read_inputs(obj, state, depsgraph_of())
                solving.run(obj, state, inputs, stateless=True)
                keys.append(deformer.key())
                held.append(numpy.frombuffer(inputs.targets).reshape(-1, 3, 4))
            yield len(keys) / (len(keyed) + total), f"pose of frame {frame}"
    between = [frame for frame in range(keyed[0], keyed[-1]) if frame not in keyed]
    found = Between(between, [], [])
    for done, frame in enumerate(between):
        with deformer.lock:
            state.answers = None  # the deformer's last result is another's from here on
            deformer.interpolate(keys, keyed, frame)
            targets, positions = deformer.result_pose(), deformer.positions()
        before = numpy.searchsorted(keyed, frame) - 1
        near = STAYS * _size(positions)
        stays = counts & (_steps(held[before], held[before + 1]) <= near)
        shift = _hold(targets, held[before], stays)
        found.targets.append(targets)
        found.positions.append(positions + shift.astype(numpy.float32))
        yield (len(keyed) + done) / (len(keyed) + total), f"frame {frame}"
    return found


def _steps(before, after):
    """How far each handle goes from one pose to the next."""
    return numpy.linalg.norm(after[:, :, 3] - before[:, :, 3], axis=1)


def _hold(targets, before, stays):
    """The pose as a whole turns about its own middle, and would take a foot along that stands still
    in both poses: move it back. Changes `targets`; returns by how much all was moved."""
    if not stays.any():
        return numpy.zeros(3)
    shift = (before[stays, :, 3] - targets[stays, :, 3]).mean(axis=0)
    targets[:, :, 3] += shift
    targets[stays, :, 3] = before[stays, :, 3]
    return shift


def _size(positions):
    return float(numpy.linalg.norm(numpy.ptp(positions, axis=0))) or 1.0


def write(obj, scene, found):
    """Key the empties. Returns how far the mesh is from what was interpolated, as a share of its
    size: it follows the handles, and has between them a will of its own."""
    worst, size = 0.0, 1.0
    with closing(walk(scene, found.frames)) as frames:
        for frame, targets, positions in zip(frames, found.targets, found.positions):
            _key(obj, frame, targets)
            scene.frame_set(frame)
            shown = solving.solve(obj).positions
            worst = max(worst, float(numpy.linalg.norm(shown - positions, axis=1).max()))
            size = _size(positions)
    return worst / size


def _key(obj, frame, targets):
    for item, target in zip(handles.bound_items(obj), targets):
        if item.bound_kind == Kind.FREE or handles.is_missing(item):
            continue
        before = item.empty.rotation_quaternion.copy(), item.empty.rotation_euler.copy()
        handles.move_empty(obj, item, target, with_linear=item.bound_kind == Kind.ORIENTED)
        _stay_near(item.empty, before)
        posing.key_handle(item, frame)


def _stay_near(empty, before):
    """Of the ways to write one rotation down the one that is nearest to the last frame's."""
    if empty.rotation_mode == "QUATERNION":
        turn = empty.rotation_quaternion.copy()
        turn.make_compatible(before[0])
        empty.rotation_quaternion = turn
    elif empty.rotation_mode != "AXIS_ANGLE":
        nearby = empty.rotation_euler.copy()
        nearby.make_compatible(before[1])
        empty.rotation_euler = nearby
