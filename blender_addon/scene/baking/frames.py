# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of a bake, and walking through them."""

from .errors import SettingsError

# MAXFRAME of Blender: frame numbers outside are clamped by it, and would be baked twice.
_FRAME_LIMIT = 1048574


def frame_numbers(start, end, step):
    """start, start + step, ... up to and with end where it is met."""
    if step < 1:
        raise SettingsError(f"The step is {step}; it must be 1 or more")
    if end < start:
        raise SettingsError(f"The last frame ({end}) comes before the first ({start})")
    if start < -_FRAME_LIMIT or end > _FRAME_LIMIT:
        raise SettingsError(f"Frames go from {-_FRAME_LIMIT} to {_FRAME_LIMIT}")
    return range(start, end + 1, step)


def walk(scene, numbers):
    """Set the scene to each frame in turn and yield its number.

    However it ends (last frame, error, close() of the generator), the scene goes back to the frame
    it was on.
    """
    current, subframe = scene.frame_current, scene.frame_subframe
    try:
        for number in numbers:
            scene.frame_set(number)
            yield number
    finally:
        scene.frame_set(current, subframe=subframe)
