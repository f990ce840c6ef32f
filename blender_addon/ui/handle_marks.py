# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks of the handles in the 3D view, so that they are found and told apart.

A mark lies over the empty, which stays what is clicked and moved. Drawing never raises: it would
at every redraw.
"""

import math

import blf
import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from ..scene import rigs, versions

COLOURS = {
    "PINNED": (1.0, 0.55, 0.1, 0.9),
    "ORIENTED": (0.25, 0.6, 1.0, 0.9),
    "FREE": (0.75, 0.75, 0.75, 0.9),
}
OUTLINE = (0.05, 0.05, 0.05, 0.9)
CHOSEN = (1.0, 1.0, 1.0, 1.0)
RADIUS = 5.0  # pixels at a scale of 1
SIDES = {"PINNED": 16, "ORIENTED": 4, "FREE": 16}

_handles = []


def draw_marks():
    context = bpy.context
    if not _is_wanted(context):
        return
    scale = context.preferences.system.ui_scale
    region, view = context.region, context.region_data
    triangles = []  # (colour, [points])
    labels = []
    for item, empty in _seen(context):
        at = location_3d_to_region_2d(region, view, empty.matrix_world.translation)
        if at is None:
            continue
        rim = CHOSEN if empty.select_get() else OUTLINE
        sides = SIDES[item.kind]
        triangles.append((rim, _disc(at, (RADIUS + 2) * scale, sides)))
        triangles.append((COLOURS[item.kind], _disc(at, RADIUS * scale, sides)))
        if item.kind == "FREE":
            triangles.append((OUTLINE, _disc(at, (RADIUS - 2.5) * scale, sides)))
        labels.append((empty.name, at))
    _fill(triangles)
    if context.window_manager.exemplar_display.show_names:
        _write(labels, scale)


def draw_shapes():
    """The custom shapes: edges of a mesh at the place of the empty, in front."""
    context = bpy.context
    if not _is_wanted(context):
        return
    shader = versions.flat_colour_shader(3)
    gpu.state.depth_test_set("NONE")
    shader.bind()
    for item, empty in _seen(context):
        if item.shape is None or item.shape.type != "MESH":
            continue
        matrix = empty.matrix_world @ Matrix.Scale(empty.empty_display_size, 4)
        mesh = item.shape.data
        places = [matrix @ vertex.co for vertex in mesh.vertices]
        lines = [places[v] for edge in mesh.edges for v in edge.vertices]
        if lines:
            batch = batch_for_shader(shader, "LINES", {"pos": lines})
            shader.uniform_float("color", CHOSEN if empty.select_get() else COLOURS[item.kind])
            batch.draw(shader)


def _is_wanted(context):
    space = context.space_data
    return (
        context.window_manager.exemplar_display.show_handles
        and space is not None
        and space.type == "VIEW_3D"
        and space.overlay.show_overlays
        and context.region_data is not None
    )


def _seen(context):
    """(handle, its empty) of all rigs, where the view shows the empty."""
    layer, space = context.view_layer, context.space_data
    for obj in rigs.all_rigs():
        for item in obj.exemplar.handles:
            empty = item.empty
            if empty is not None and layer.objects.get(empty.name) == empty:
                if empty.visible_get(view_layer=layer, viewport=space):
                    yield item, empty


def _disc(centre, radius, sides):
    rim = [
        centre + radius * Vector((math.cos(a), math.sin(a)))
        for a in (2 * math.pi * k / sides for k in range(sides))
    ]
    return [p for k in range(1, sides - 1) for p in (rim[0], rim[k], rim[k + 1])]


def _fill(triangles):
    shader = versions.flat_colour_shader(2)
    shader.bind()
    gpu.state.blend_set("ALPHA")
    for colour, points in triangles:
        batch = batch_for_shader(shader, "TRIS", {"pos": points})
        shader.uniform_float("color", colour)
        batch.draw(shader)
    gpu.state.blend_set("NONE")


def _write(labels, scale):
    font = 0
    blf.size(font, 11 * scale)
    blf.color(font, 1, 1, 1, 1)
    for text, at in labels:
        blf.position(font, at.x + 10 * scale, at.y - 4 * scale, 0)
        blf.draw(font, text)


def register():
    if bpy.app.background:
        return
    add = bpy.types.SpaceView3D.draw_handler_add
    _handles.append(add(draw_marks, (), "WINDOW", "POST_PIXEL"))
    _handles.append(add(draw_shapes, (), "WINDOW", "POST_VIEW"))


def unregister():
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
