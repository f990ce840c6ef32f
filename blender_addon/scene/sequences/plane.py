# SPDX-License-Identifier: GPL-3.0-or-later
"""The pose space as objects: a plane, in it the control polygon and a mark for every frame, and the
playhead. Their coordinates are those of the pose plane; the plane's scale makes them visible.
"""

import math

import bmesh
import bpy
import numpy
from mathutils import Vector

from ...native import ExemplarError
from . import polygon

RANK = "exemplar_rank"  # of a control point along the curve
PINNED = "exemplar_pinned"  # 1: a mark that stays where it was put

# The plane is shown about this much larger than the character.
SIZE = 1.2


# ---------------------------------------------------------------------------------------- creation


def create(owner, points, marks, pinned, cyclic):
    """Make the objects, in a collection of their own, and tell `owner` of them."""
    data = owner.exemplar_sequence
    name = owner.name
    collection = bpy.data.collections.new(f"{name} Pose Space")
    for parent in owner.users_collection:
        parent.children.link(collection)
    data.plane = _empty(collection, f"{name} Pose Space", "ARROWS", None)
    data.curve = _mesh(collection, f"{name} Curve", data.plane)
    data.marks = _mesh(collection, f"{name} Frames", data.plane)
    data.playhead = _empty(collection, f"{name} Playhead", "SPHERE", data.plane)
    _place(owner, data.plane, marks)
    _write_new_polygon(data.curve.data, points, cyclic)
    _write_new_marks(data.marks.data, marks, pinned)
    data.plane.empty_display_size = 0.12 * extent(marks)
    data.playhead.empty_display_size = 0.03 * extent(marks)
    data.playhead.location = (*points[0], 0.0)
    data.playhead.lock_location[2] = True
    data.playhead.lock_rotation = data.playhead.lock_scale = (True,) * 3
    return collection


def _empty(collection, name, kind, parent):
    empty = bpy.data.objects.new(name, None)
    empty.empty_display_type = kind
    empty.parent = parent
    collection.objects.link(empty)
    return empty


def _mesh(collection, name, parent):
    obj = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    obj.parent = parent
    obj.hide_render = True
    obj.show_in_front = True
    collection.objects.link(obj)
    return obj


def extent(marks):
    return max(float(numpy.ptp(marks, axis=0).max()), 1e-9)


def _place(owner, plane, marks):
    """Upright beside the character, and as large as it is: the front view shows both."""
    corners = numpy.array([owner.matrix_world @ Vector(corner) for corner in owner.bound_box])
    size = max(float(numpy.ptp(corners, axis=0).max()), 1e-6)
    scale = SIZE * size / extent(marks)
    plane.scale = (scale,) * 3
    low, high = corners.min(axis=0), corners.max(axis=0)
    plane.rotation_euler.x = math.pi / 2
    left, middle = marks[:, 0].min(), (marks[:, 1].min() + marks[:, 1].max()) / 2
    plane.location = (
        high[0] + 0.35 * size - scale * left,
        (low[1] + high[1]) / 2,
        (low[2] + high[2]) / 2 - scale * middle,
    )


def _write_new_polygon(mesh, points, cyclic):
    count = len(points)
    edges = [(i, i + 1) for i in range(count - 1)] + ([(count - 1, 0)] if cyclic else [])
    mesh.clear_geometry()
    mesh.from_pydata([(*point, 0.0) for point in points], edges, [])
    _layer(mesh, RANK).data.foreach_set("value", numpy.arange(count, dtype=numpy.int32))
    mesh.update()


def _write_new_marks(mesh, marks, pinned):
    mesh.clear_geometry()
    mesh.from_pydata([(*mark, 0.0) for mark in marks], [], [])
    _layer(mesh, PINNED).data.foreach_set("value", numpy.asarray(pinned, numpy.int32))
    mesh.update()


def _layer(mesh, name):
    return mesh.attributes.get(name) or mesh.attributes.new(name, "INT", "POINT")


# --------------------------------------------------------------------------------------- the curve


def read_curve(obj, cyclic):
    """float32 [k][2], in order along the curve. Raises ExemplarError where it is not one line."""
    check(obj, "The control polygon")
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        edit.verts.index_update()
        layer = edit.verts.layers.int.get(RANK)
        places = numpy.array([vertex.co[:2] for vertex in edit.verts], numpy.float32)
        ranks = [vertex[layer] if layer else vertex.index for vertex in edit.verts]
        edges = [(edge.verts[0].index, edge.verts[1].index) for edge in edit.edges]
    else:
        mesh = obj.data
        places = _places(mesh)
        ranks = _values(mesh, RANK, numpy.arange(len(mesh.vertices)))
        edges = numpy.empty((len(mesh.edges), 2), numpy.int32)
        mesh.edges.foreach_get("vertices", edges.ravel())
        edges = edges.tolist()
    if not len(places):
        raise ExemplarError("The control polygon has no points.")
    order = polygon.ordered(len(places), edges, ranks, cyclic)
    return numpy.ascontiguousarray(places.reshape(-1, 2)[order])


def write_curve(obj, points, cyclic):
    """Put the control points where they are now; all of it where their number has changed."""
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        edit.verts.index_update()
        layer = edit.verts.layers.int.get(RANK) or edit.verts.layers.int.new(RANK)
        edges = [(edge.verts[0].index, edge.verts[1].index) for edge in edit.edges]
        ranks = [vertex[layer] for vertex in edit.verts]
        order = polygon.ordered(len(edit.verts), edges, ranks, cyclic)
        if len(order) != len(points):
            raise ExemplarError("The control polygon has other points now; leave Edit Mode.")
        edit.verts.ensure_lookup_table()
        for rank, (vertex, point) in enumerate(zip(order, points)):
            edit.verts[vertex].co[:2] = point
            edit.verts[vertex][layer] = rank
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
        return
    _write_new_polygon(obj.data, points, cyclic)


# --------------------------------------------------------------------------------------- the marks


def read_marks(obj, count):
    """float32 [n][2] and bool [n]: where the marks are, and which of them are pinned."""
    check(obj, "The object of the frames' marks")
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        layer = edit.verts.layers.int.get(PINNED)
        places = numpy.array([vertex.co[:2] for vertex in edit.verts], numpy.float32)
        pinned = numpy.array([vertex[layer] if layer else 0 for vertex in edit.verts], bool)
    else:
        places = _places(obj.data)
        pinned = _values(obj.data, PINNED, numpy.zeros(len(places), numpy.int32)).astype(bool)
    if len(places) != count:
        raise ExemplarError(
            f"There are {len(places)} marks for {count} frames: marks can be moved, not added or "
            "deleted. Undo that, or press Reset Plane."
        )
    return places.reshape(-1, 2), pinned


def write_marks(obj, marks, pinned, moved=()):
    """`moved`: those that a hand has hold of; they stay where they are."""
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        layer = edit.verts.layers.int.get(PINNED) or edit.verts.layers.int.new(PINNED)
        held = set(moved)
        for index, vertex in enumerate(edit.verts):
            vertex[layer] = int(pinned[index])
            if index not in held:
                vertex.co[:2] = marks[index]
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
        return
    if len(obj.data.vertices) != len(marks):
        _write_new_marks(obj.data, marks, pinned)
        return
    places = numpy.zeros((len(marks), 3), numpy.float32)
    places[:, :2] = marks
    obj.data.vertices.foreach_set("co", places.ravel())
    _layer(obj.data, PINNED).data.foreach_set("value", numpy.asarray(pinned, numpy.int32))
    obj.data.update()


def selected_marks(obj):
    """Numbers of the selected marks, in any mode."""
    if obj.mode == "EDIT":
        edit = bmesh.from_edit_mesh(obj.data)
        return [index for index, vertex in enumerate(edit.verts) if vertex.select]
    return [vertex.index for vertex in obj.data.vertices if vertex.select]


# ------------------------------------------------------------------------------------------- shared


def check(obj, what):
    if obj is None or not obj.users_scene:
        raise ExemplarError(f"{what} was deleted. Undo that, or press Reset Plane.")


def point_of(owner, depsgraph):
    """Where the playhead is in the plane: (x, y)."""
    data = owner.exemplar_sequence
    for part, what in ((data.plane, "The plane"), (data.playhead, "The playhead")):
        check(part, what)
    plane = data.plane.evaluated_get(depsgraph).matrix_world
    if abs(plane.determinant()) < 1e-30:
        raise ExemplarError(f"'{data.plane.name}' is scaled to nothing.")
    place = plane.inverted() @ data.playhead.evaluated_get(depsgraph).matrix_world.translation
    return (place.x, place.y)


def _places(mesh):
    places = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    return places[:, :2].copy()


def _values(mesh, name, default):
    layer = mesh.attributes.get(name)
    if layer is None or layer.data_type != "INT" or len(layer.data) != len(mesh.vertices):
        return default
    values = numpy.empty(len(mesh.vertices), numpy.int32)
    layer.data.foreach_get("value", values)
    return values
