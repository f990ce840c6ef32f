# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks in the 3D view: a line from the mesh to the scan for each; and the shape that a fit
has reached so far, as points. Drawing never raises: it would at every redraw.
"""

import bpy
import gpu
from gpu_extras.batch import batch_for_shader

from ..scene import rigs, versions
from ..scene.fitting import landmarks, solving

LINE = (1.0, 0.75, 0.1, 0.9)
AMBIGUOUS = (0.9, 0.3, 0.9, 0.9)
SO_FAR = (0.2, 0.8, 1.0, 0.8)
POINT_SIZE = 7.0

_handle = None


def draw():
    context = bpy.context
    space = context.space_data
    if space is None or space.type != "VIEW_3D" or not space.overlay.show_overlays:
        return
    shader = versions.flat_colour_shader(3)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("ALPHA")
    shader.bind()
    points = solving.Preview.points
    if points is not None:
        gpu.state.point_size_set(2.0)
        _draw(shader, "POINTS", points, SO_FAR)
    obj = rigs.active_rig(context)
    if obj is not None and obj.exemplar_fit.scan is not None and obj.mode == "OBJECT":
        _draw_landmarks(context, shader, obj)
    gpu.state.point_size_set(1.0)
    gpu.state.blend_set("NONE")


def _draw_landmarks(context, shader, obj):
    lines = {LINE: [], AMBIGUOUS: []}
    vertices = obj.evaluated_get(context.view_layer.depsgraph).data.vertices
    for item in obj.exemplar_fit.landmarks:
        at = landmarks.point(item, obj.exemplar_fit.scan)
        if at is not None and item.vertex < len(vertices):
            on_mesh = obj.matrix_world @ vertices[item.vertex].co
            lines[AMBIGUOUS if item.is_ambiguous else LINE] += [on_mesh, at]
    gpu.state.point_size_set(POINT_SIZE)
    for colour, points in lines.items():
        _draw(shader, "LINES", points, colour)
        _draw(shader, "POINTS", points, colour)


def _draw(shader, kind, points, colour):
    if len(points):
        shader.uniform_float("color", colour)
        batch_for_shader(shader, kind, {"pos": points}).draw(shader)


def register():
    global _handle
    if not bpy.app.background:
        _handle = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")


def unregister():
    global _handle
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
