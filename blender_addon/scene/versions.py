# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that knows how Blender 3.4 to 5.2 differ, and what is fast in each.

No address is ever kept: undo, edit mode and implicit sharing move arrays.
"""

import ctypes

import bpy
import gpu
import numpy

POSITIONS_ARE_ATTRIBUTES = bpy.app.version >= (3, 5, 0)


def set_mesh_positions(mesh, positions):
    """positions float32 [V][3], contiguous. The caller tags the mesh."""
    if POSITIONS_ARE_ATTRIBUTES:
        mesh.attributes["position"].data.foreach_set("vector", positions.ravel())
    else:
        mesh.vertices.foreach_set("co", positions.ravel())


def get_mesh_positions(mesh):
    positions = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    if POSITIONS_ARE_ATTRIBUTES:
        mesh.attributes["position"].data.foreach_get("vector", positions.ravel())
    else:
        mesh.vertices.foreach_get("co", positions.ravel())
    return positions


def key_size(key_block):
    return len(key_block.data)


def set_key_positions(key_block, positions):
    """positions float32 [V][3], contiguous. The caller tags the mesh."""
    address = _key_address(key_block)
    if address:
        ctypes.memmove(address, positions.ctypes.data, positions.nbytes)
    else:
        _key_points(key_block).foreach_set("co", positions.ravel())


def get_key_positions(key_block):
    positions = numpy.empty((key_size(key_block), 3), numpy.float32)
    address = _key_address(key_block)
    if address:
        ctypes.memmove(positions.ctypes.data, address, positions.nbytes)
    else:
        _key_points(key_block).foreach_get("co", positions.ravel())
    return positions


def _key_points(key_block):
    return key_block.points if hasattr(key_block, "points") else key_block.data


def _key_address(key_block):
    """Where the key's coordinates are, or None where there is no need to know.

    Before there was `points`, foreach_set called a function for each point: 2 to 3 ms at 50k
    vertices, more than the solve. And where the mesh is linked, as under a library override, later
    Blenders pass over foreach_set without a word. The points are plain float[3], and are so only if
    the first and the last are as far apart as that makes them.
    """
    if hasattr(key_block, "points") and key_block.id_data.library is None:
        return None
    points = _key_points(key_block)
    count = len(points)
    if not count:
        return None
    first, last = points[0].as_pointer(), points[count - 1].as_pointer()
    return first if last - first == 12 * (count - 1) else None


# ----------------------------------------------------------------------------------------- curves
# Until 4.3 an action holds its curves; since 4.4 they are in a channel bag per slot, and since 5.0
# only there.


def find_curves(owner):
    """The curves that animate a datablock, or None."""
    animation = owner.animation_data
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


def ensure_curves(owner):
    """The curves that animate a datablock; an action is made where there is none."""
    animation = owner.animation_data or owner.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(f"{owner.name}Action")
    if not hasattr(animation, "action_slot"):
        return animation.action.fcurves
    action = animation.action
    if animation.action_slot is None:
        animation.action_slot = action.slots.new(owner.id_type, owner.name)
    if not action.layers:
        action.layers.new("Layer")
    layer = action.layers[0]
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(animation.action_slot, ensure=True).fcurves


# -------------------------------------------------------------------------------------- modifiers


def move_modifier_first(obj, modifier):
    index = obj.modifiers.find(modifier.name)
    if index == 0:
        return
    if hasattr(obj.modifiers, "move"):
        obj.modifiers.move(index, 0)
        return
    with bpy.context.temp_override(object=obj, active_object=obj):
        bpy.ops.object.modifier_move_to_index(modifier=modifier.name, index=0)


# ---------------------------------------------------------------------------------------- drawing


def flat_colour_shader(dimension):
    """A shader of one colour for points of 2 or 3 coordinates."""
    if bpy.app.version >= (4, 0, 0):
        return gpu.shader.from_builtin("UNIFORM_COLOR")
    return gpu.shader.from_builtin(f"{dimension}D_UNIFORM_COLOR")


def line_shader():
    """Lines of any width; uniforms color, lineWidth, viewportSize."""
    if bpy.app.version >= (4, 0, 0):
        return gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    return gpu.shader.from_builtin("3D_POLYLINE_UNIFORM_COLOR")


def smooth_colour_shader():
    """Of pos and color at vertices."""
    name = "SMOOTH_COLOR" if bpy.app.version >= (4, 0, 0) else "3D_SMOOTH_COLOR"
    return gpu.shader.from_builtin(name)
