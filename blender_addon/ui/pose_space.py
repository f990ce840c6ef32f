# SPDX-License-Identifier: GPL-3.0-or-later
"""The pose space in the viewport: the curve with its frames, and shapes at a grid of points.

Drawn for the sequence that is active. Shapes are made anew when the pose space has changed and the
hand is still; the curve at once.
"""

import time

import blf
import bpy
import gpu
import numpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from ..native import ExemplarError
from ..scene import meshes, versions
from ..scene.sequences import owners, store, thumbnails

FONT = 0
CURVE = (0.05, 0.35, 0.9, 1.0)
FRAME = (0.02, 0.1, 0.35, 1.0)
PINNED = (0.9, 0.1, 0.1, 1.0)
HERE = (1.0, 0.55, 0.0, 1.0)
SHAPE = (0.62, 0.68, 0.75)
LIGHT = numpy.array([0.4, -0.6, 0.8])
MARGIN = 0.15  # of the plane's extent, around the frames
FILLS = 0.82  # how much of its square a shape fills
PER_FRAME = 6  # points of the curve between frames
MOST_POINTS = 2000
LABELS = 10
STILL_AFTER = 0.15

_handles = []
_cache = {}  # name of the owner -> _Drawn


class _Drawn:
    """Batches of one pose space, and what they were made from."""

    def __init__(self):
        self.edits = None  # of the curve
        self.curve = self.frames = None
        self.frame_places = ()
        self.shapes_key = None
        self.shapes = None


def _draw_view():
    owner = owners.active(bpy.context)
    if owner is None or not bpy.context.space_data.overlay.show_overlays:
        return
    state = store.peek(owner)
    plane = owner.exemplar_sequence.plane
    if state is None or plane is None or not plane.visible_get():
        return
    drawn = _cache.setdefault(owner.name, _Drawn())
    data = owner.exemplar_sequence
    try:
        if data.show_shapes:
            _draw_shapes(owner, state, drawn)
        if data.show_curve:
            _draw_curve(owner, state, drawn)
    except ExemplarError as error:
        state.problem = error


# ------------------------------------------------------------------------------------------- curve


def _draw_curve(owner, state, drawn):
    if drawn.edits != state.edits:
        _make_curve(owner, state, drawn)
    plane = owner.exemplar_sequence.plane.matrix_world
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(plane)
        gpu.state.depth_test_set("NONE")
        line = versions.line_shader()
        line.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
        line.uniform_float("lineWidth", 2.5)
        line.uniform_float("color", CURVE)
        drawn.curve.draw(line)
        _draw_points(drawn.frame_places, FRAME, 5.0)
        if state.marks is not None:
            pinned = _pinned(owner)
            if len(pinned) == len(state.marks) and pinned.any():
                _draw_points(_flat(state.marks[pinned]), PINNED, 9.0)
        here = _here(owner, state)
        if here is not None:
            _draw_points(_flat([here]), HERE, 13.0)
        gpu.state.point_size_set(1.0)


def _make_curve(owner, state, drawn):
    sequence = state.sequence
    count = sequence.info.frame_count
    samples = min(MOST_POINTS, PER_FRAME * count)
    end = count if sequence.info.cyclic else count - 1
    times = numpy.linspace(0.0, end, samples)
    points = _flat([sequence.curve_point(time) for time in times])
    drawn.curve = batch_for_shader(versions.line_shader(), "LINE_STRIP", {"pos": points})
    drawn.frame_places = _flat([sequence.curve_point(frame) for frame in range(count)])
    drawn.edits = state.edits


def _draw_points(places, colour, size):
    shader = versions.flat_colour_shader(3)
    batch = batch_for_shader(shader, "POINTS", {"pos": places})
    gpu.state.point_size_set(size * bpy.context.preferences.system.ui_scale)
    shader.uniform_float("color", colour)
    batch.draw(shader)


def _flat(points):
    return [(float(x), float(y), 0.0) for x, y in points]


def _pinned(owner):
    mesh = owner.exemplar_sequence.marks.data
    layer = mesh.attributes.get("exemplar_pinned")
    if layer is None or len(layer.data) != len(mesh.vertices):
        return numpy.zeros(0, bool)
    values = numpy.empty(len(mesh.vertices), numpy.int32)
    layer.data.foreach_get("value", values)
    return values.astype(bool)


def _here(owner, state):
    """Where the shown shape is in the plane."""
    shown = store.peek_shown(owner)
    if shown is None or shown.inputs is None:
        return None
    if shown.inputs.point is not None:
        return shown.inputs.point
    return state.sequence.curve_point(shown.inputs.time)


def _draw_labels():
    owner = owners.active(bpy.context)
    region, view = bpy.context.region, bpy.context.region_data
    if owner is None or not bpy.context.space_data.overlay.show_overlays:
        return
    drawn, data = _cache.get(owner.name), owner.exemplar_sequence
    if drawn is None or not len(drawn.frame_places) or not data.show_curve or data.plane is None:
        return
    step = max(1, round(len(drawn.frame_places) / LABELS))
    blf.size(FONT, 11 * bpy.context.preferences.system.ui_scale)
    blf.color(FONT, 1.0, 1.0, 1.0, 0.9)
    for frame in range(0, len(drawn.frame_places), step):
        world = data.plane.matrix_world @ Vector(drawn.frame_places[frame])
        at = location_3d_to_region_2d(region, view, world)
        if at is not None:
            blf.position(FONT, at.x + 6, at.y + 4, 0)
            blf.draw(FONT, f"{data.first_frame + frame * data.frame_step:g}")


# ------------------------------------------------------------------------------------------ shapes


def _draw_shapes(owner, state, drawn):
    plane = owner.exemplar_sequence.plane.matrix_world
    key = (
        state.shapes,
        owner.exemplar_sequence.shape_count,
        tuple(map(tuple, plane)),
        tuple(map(tuple, owner.matrix_world)),
    )
    is_still = time.monotonic() - state.changed_at > STILL_AFTER
    if drawn.shapes_key != key and (is_still or drawn.shapes is None):
        drawn.shapes = _make_shapes(owner, state)
        drawn.shapes_key = key
    elif drawn.shapes_key != key:
        _redraw_later()
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    shader = versions.smooth_colour_shader()
    drawn.shapes.draw(shader)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _make_shapes(owner, state):
    """One batch of all shapes, in the world: each at its place in the plane, turned as the
    character is."""
    count = owner.exemplar_sequence.shape_count
    rest = versions.get_mesh_positions(owner.data)
    chosen, faces = thumbnails.coarse(
        rest, meshes.triangles(owner.data), thumbnails.TRIANGLE_BUDGET // count
    )
    turn = numpy.array(owner.matrix_world.to_3x3())
    whole = numpy.empty((state.sequence.info.vertex_count, 3), numpy.float32)

    def shape_at(point):
        state.sequence.pose(point, out=whole)
        return whole[chosen] @ turn.T.astype(numpy.float32)

    marks = state.sequence.marks()[0]
    low, high = marks.min(axis=0), marks.max(axis=0)
    margin = MARGIN * float((high - low).max())
    grid = thumbnails.cells(low - margin, high + margin, shape_at, count)
    middle, size = _frame(turn, rest[chosen])
    plane = numpy.array(owner.exemplar_sequence.plane.matrix_world)
    unit = float(numpy.linalg.norm(plane[:3, :3], axis=0)[:2].mean())
    places, colours, triangles = [], [], []
    for number, cell in enumerate(grid):
        place = plane[:3, :3] @ (*cell.centre, 0.0) + plane[:3, 3]
        scale = FILLS * cell.size * unit / size
        places.append(place + scale * (cell.positions - middle))
        colours.append(thumbnails.shaded(cell.positions, faces, LIGHT, SHAPE))
        triangles.append(faces + number * len(chosen))
    return batch_for_shader(
        versions.smooth_colour_shader(),
        "TRIS",
        {
            "pos": numpy.concatenate(places).astype(numpy.float32),
            "color": numpy.concatenate(colours),
        },
        indices=numpy.concatenate(triangles).astype(numpy.int32),
    )


def _frame(turn, positions):
    """The middle of a character, and its longest side."""
    turned = positions @ turn.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    return (low + high) / 2, max(float((high - low).max()), 1e-9)


def _redraw_later():
    if not bpy.app.timers.is_registered(_redraw):
        bpy.app.timers.register(_redraw, first_interval=STILL_AFTER)


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


# ------------------------------------------------------------------------------------ registration


def register():
    if bpy.app.background:
        return
    space = bpy.types.SpaceView3D
    for function, moment in ((_draw_view, "POST_VIEW"), (_draw_labels, "POST_PIXEL")):
        _handles.append(space.draw_handler_add(function, (), "WINDOW", moment))


def unregister():
    for handle in _handles:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    _handles.clear()
    _cache.clear()
    if bpy.app.timers.is_registered(_redraw):
        bpy.app.timers.unregister(_redraw)
