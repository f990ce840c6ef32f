# SPDX-License-Identifier: GPL-3.0-or-later
"""Values at vertices as colours over the mesh of the active rig, in the 3D view: blue for 0, red
for 1, as Weight Paint has them.
"""

import bpy
import gpu
import numpy
from gpu_extras.batch import batch_for_shader

from ..scene import bindings, meshes, results, rigs, stiffness, versions

ALPHA = 0.75
# Towards the eye, in clip space: over the surface that is drawn, and under what is before it.
NEARER = 2e-4

_handle = None
_values = (None, None)  # (key, float32 [V]) that were drawn last


def stiffness_values(obj):
    """(key, function that gives [V] from 0 to 1), or None where it is not asked for. With the same
    key it would give the same again; None: unknown."""
    if not obj.exemplar.rigidity.show_radii:
        return None
    state = bindings.peek(obj)
    # Only of a bound mesh is it known whether its weights have changed.
    known = state is not None and state.verified
    key = (obj.name, stiffness.key(obj), state.live_digest) if known else None
    return key, lambda: stiffness.shares(obj)


def ramp(values):
    """float32 [V][4]: the colours of Weight Paint."""
    values = numpy.clip(values, 0, 1)[:, None]
    hue = 4 * (1 - values)  # 4: blue, 0: red
    red = numpy.abs(hue - 3) - 1
    green = 2 - numpy.abs(hue - 2)
    blue = hue - 2
    colours = numpy.concatenate([red, green, blue, numpy.ones_like(values)], axis=1)
    colours = numpy.clip(colours, 0, 1)
    colours[:, 3] = ALPHA
    return colours.astype(numpy.float32)


def draw():
    obj = rigs.active_rig(bpy.context)
    if obj is None or obj.mode != "OBJECT":
        return
    wanted = stiffness_values(obj)
    if wanted is not None:
        _draw_over(obj, _shown_positions(obj), ramp(_remembered(*wanted)))


def _remembered(key, compute):
    """Views are drawn often, and weights are slow to read."""
    global _values
    if key is None or _values[0] != key:
        _values = (key, compute())
    return _values[1]


def _shown_positions(obj):
    shown = results.shown_object(obj) if obj.exemplar.bound else obj
    shown = shown or obj
    evaluated = shown.evaluated_get(bpy.context.evaluated_depsgraph_get())
    if len(evaluated.data.vertices) == len(obj.data.vertices):
        return versions.get_mesh_positions(evaluated.data)
    state = bindings.peek(obj)
    if state is not None and state.result is not None:
        return state.result.positions  # a modifier has made another mesh of it
    return meshes.reference_positions(obj)


def _draw_over(obj, positions, colours):
    if len(positions) != len(colours):
        return
    shader = versions.smooth_colour_shader()
    batch = batch_for_shader(
        shader,
        "TRIS",
        {"pos": positions, "color": colours},
        indices=meshes.triangles(obj.data).astype(numpy.int32),
    )
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.face_culling_set("BACK")
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        projection = gpu.matrix.get_projection_matrix()
        projection[2] -= NEARER * projection[3]
        gpu.matrix.load_projection_matrix(projection)
        gpu.matrix.multiply_matrix(obj.matrix_world)
        batch.draw(shader)
    gpu.state.face_culling_set("NONE")
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def register():
    global _handle
    if not bpy.app.background:
        space = bpy.types.SpaceView3D
        _handle = space.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")


def unregister():
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
