# SPDX-License-Identifier: GPL-3.0-or-later
"""F-curves on shape-key values, in every Blender from 3.4 to 5.2.

Until 4.3 an action holds its curves; since 4.4 they are in a channel bag per slot, and since 5.0
only there.
"""

import bpy
import numpy as np

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
    return any(curve.data_path == path for curve in _find_curves(key) or ())


def set_linear(key, key_block, frames, values):
    """Replace what animates a shape key's value by keyframes with straight lines between."""
    curves = _ensure_curves(key)
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
    curves = _find_curves(key)
    if curves is None:
        return
    path = value_path(key_block)
    for curve in [curve for curve in curves if curve.data_path == path]:
        curves.remove(curve)


def _find_curves(key):
    animation = key.animation_data
    if animation is None or animation.action is None:
        return None
    if not hasattr(animation, "action_slot"):
        return animation.action.fcurves
    if animation.action_slot is None:
        return None
    for layer in animation.action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(animation.action_slot)
            if bag is not None:
                return bag.fcurves
    return None


def _ensure_curves(key):
    animation = key.animation_data or key.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(f"{key.name}Action")
    if not hasattr(animation, "action_slot"):
        return animation.action.fcurves
    action = animation.action
    if animation.action_slot is None:
        animation.action_slot = action.slots.new("KEY", key.name)
    if not action.layers:
        action.layers.new("Layer")
    layer = action.layers[0]
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(animation.action_slot, ensure=True).fcurves
