# SPDX-License-Identifier: GPL-3.0-or-later
"""F-curves on shape-key values."""

import bpy
import numpy as np

from .. import versions

# FCurve keyframe interpolation as foreach_set wants it: BEZT_IPO_LIN.
_LINEAR = 1


def value_path(key_block):
    return f'key_blocks["{bpy.utils.escape_identifier(key_block.name)}"].value'


def is_driven(key, key_block):
    animation = key.animation_data
    path = value_path(key_block)
    return animation is not None and any(d.data_path == path for d in animation.drivers)


def is_animated(key, key_block):
    path = value_path(key_block)
    return any(curve.data_path == path for curve in versions.find_curves(key) or ())


def set_linear(key, key_block, frames, values):
    """Replace what animates a shape key's value by keyframes with straight lines between."""
    curves = versions.ensure_curves(key)
    path = value_path(key_block)
    remove(key, key_block)
    curve = curves.new(path)
    curve.keyframe_points.add(len(frames))
    points = np.column_stack([np.asarray(frames, np.float32), np.asarray(values, np.float32)])
    curve.keyframe_points.foreach_set("co", points.ravel())
    curve.keyframe_points.foreach_set("interpolation", np.full(len(frames), _LINEAR, np.int32))
    curve.update()


def remove(key, key_block):
    """Remove the animation of a shape key's value, if it has any."""
    curves = versions.find_curves(key)
    if curves is None:
        return
    path = value_path(key_block)
    for curve in [curve for curve in curves if curve.data_path == path]:
        curves.remove(curve)
