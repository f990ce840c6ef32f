# SPDX-License-Identifier: GPL-3.0-or-later
"""The F-curve of a sequence's time: at which frame of the scene which captured frame is shown."""

from ...native import ExemplarError
from .. import versions

PATH = "exemplar_sequence.time"


def curve_of(owner):
    """The F-curve, or None."""
    for curve in versions.find_curves(owner) or ():
        if curve.data_path == PATH:
            return curve
    return None


def play_as_captured(owner, start, end):
    """A straight line: on each frame of the scene the frame that was captured then."""
    found = versions.ensure_curves(owner)
    old = curve_of(owner)
    if old is not None:
        found.remove(old)
    curve = found.new(PATH)
    for frame in (start, end):
        point = curve.keyframe_points.insert(frame, frame)
        point.interpolation = "LINEAR"
    curve.extrapolation = "LINEAR"
    curve.update()


def stretch(owner, factor, pivot):
    """Slow down by `factor` about a frame: keyframes, handles and all. Below 1 speeds up."""
    curve = curve_of(owner)
    if curve is None:
        raise ExemplarError(
            f"The time of '{owner.name}' has no keyframes to move. Press Play as Captured first."
        )
    if owner.animation_data.action.library is not None:
        raise ExemplarError("The time's action is linked and cannot be changed here.")
    for point in curve.keyframe_points:
        for place in (point.co, point.handle_left, point.handle_right):
            place[0] = pivot + factor * (place[0] - pivot)
    curve.update()
    owner.update_tag()


def convert_frame_rate(owner, frame_rate, pivot):
    """What took a second goes on taking one at another frame rate. Returns the factor."""
    data = owner.exemplar_sequence
    factor = frame_rate / data.fps
    if factor != 1.0:
        stretch(owner, factor, pivot)
        data.fps = frame_rate
    return factor


def scene_frame_rate(scene):
    return scene.render.fps / scene.render.fps_base


def copy(owner, other):
    """Give `other` the same time: the keyframes, or the value where there are none."""
    other.exemplar_sequence.time = owner.exemplar_sequence.time
    curve = curve_of(owner)
    if curve is None:
        return
    found = versions.ensure_curves(other)
    made = found.new(PATH)
    made.extrapolation = curve.extrapolation
    for point in curve.keyframe_points:
        new = made.keyframe_points.insert(*point.co)
        new.interpolation = point.interpolation
        new.handle_left_type, new.handle_right_type = (
            point.handle_left_type,
            point.handle_right_type,
        )
        new.handle_left, new.handle_right = point.handle_left, point.handle_right
    made.update()


def make_room(owner, after, frames):
    """Captured frames later than `after` have moved by `frames`: so do keyframes that show them."""
    curve = curve_of(owner)
    if curve is None:
        return
    for point in curve.keyframe_points:
        if point.co[1] > after:
            for place in (point.co, point.handle_left, point.handle_right):
                place[0] += frames
                place[1] += frames
    curve.update()
    owner.update_tag()
