# SPDX-License-Identifier: GPL-3.0-or-later
"""Playing a cache file with Blender's own Mesh Cache modifier."""

import numpy as np

from .. import versions

MODIFIER_NAME = "Exemplar Bake"

# The modifier plays a sample as it is when its time is at most this far past it (FRAME_SNAP_EPS in
# Blender), and blends with the next one otherwise; just before a sample it always blends.
_SNAP = 1e-4


def time_mapping(start, step, sample_count):
    """(frame_scale, frame_start) such that frame start + k step plays sample k as it is, bit by
    bit.

    The modifier computes frame_scale * frame - frame_start in float32, and 1 / step is a float32
    only for powers of two: times would fall a little short of the samples, and the bake would
    shiver. So they are moved past them by half of what the modifier snaps over; which float32
    neighbours are best is found by computing as the modifier does.
    """
    frames = np.arange(start, start + sample_count * step, step, dtype=np.int64).astype(np.float32)
    samples = np.arange(sample_count)
    exact_scale = np.float32(1.0 / step)
    best = None
    for scale in _neighbours(exact_scale):
        for bias in (0.0, _SNAP / 2, _SNAP / 4, _SNAP * 0.75):
            offset = np.float32(start / step - bias)
            error = (scale * frames - offset).astype(np.float64) - samples
            # How far out of the snapping interval; 0 for all is what is wanted.
            miss = float(np.max(np.maximum(-error, error - 0.99 * _SNAP), initial=0.0))
            if best is None or miss < best[0]:
                best = (miss, float(scale), float(offset))
            if miss <= 0.0:
                return best[1:]
    return best[1:]


def _neighbours(scale):
    yield scale
    yield np.nextafter(scale, np.float32(np.inf))
    yield np.nextafter(scale, np.float32(0.0))


def set_up(obj, filepath, file_format, frames):
    """Add the modifier, or take the one of the last bake, and make it play `frames` (a range) as
    first in the stack.

    First, because the positions are those of the mesh before any modifier.
    """
    modifier = find(obj)
    if modifier is None:
        modifier = obj.modifiers.new(MODIFIER_NAME, "MESH_CACHE")
    modifier.cache_format = file_format
    modifier.filepath = filepath
    modifier.deform_mode = "OVERWRITE"
    modifier.interpolation = "LINEAR"
    modifier.play_mode = "SCENE"
    modifier.time_mode = "FRAME"
    modifier.forward_axis = "POS_Y"
    modifier.up_axis = "POS_Z"
    modifier.flip_axis = set() if isinstance(modifier.flip_axis, set) else (False, False, False)
    modifier.factor = 1.0
    modifier.vertex_group = ""
    modifier.frame_scale, modifier.frame_start = time_mapping(
        frames.start, frames.step, len(frames)
    )
    modifier.show_viewport = modifier.show_render = True
    versions.move_modifier_first(obj, modifier)
    return modifier


def find(obj):
    modifier = obj.modifiers.get(MODIFIER_NAME)
    return modifier if modifier is not None and modifier.type == "MESH_CACHE" else None
