# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of a sequence's pose plane: its shapes at a grid of points, finer where they differ
more, the curve, and the frames on it. What the add-on draws in the viewport, rendered."""

import bpy
import numpy as np
from mathutils import Vector
from studio import Strip, ball, painted

PIXELS = 900
COUNT = 40
CURVE, FRAME = (0.05, 0.25, 0.85), (0.85, 0.08, 0.1)


def draw_plane(owner, look, colours, path):
    from exemplar.scene.sequences import store, thumbnails

    sequence = store.ensure(owner).sequence
    marks = sequence.marks()[0]
    low, high = marks.min(axis=0), marks.max(axis=0)
    margin = 0.12 * float((high - low).max())
    cells = thumbnails.cells(low - margin, high + margin, sequence.pose, COUNT)
    faces = np.array([polygon.vertices[:] for polygon in owner.data.polygons])
    picture = Strip(look, faces, colours, 1)
    for cell in cells:
        at = _place(picture, cell.centre, behind=2.0)
        scale = 0.9 * cell.size / look.width
        obj = picture.mesh((cell.positions - np.array(look.centre)) * scale)
        picture.link(obj, at)
    times = np.linspace(0, sequence.info.frame_count - 1, 12 * sequence.info.frame_count)
    line = [_place(picture, sequence.curve_point(t)) for t in times]
    size = float((high - low).max())
    picture.link(_tube(line, 0.0035 * size), Vector())
    for frame in range(sequence.info.frame_count):
        picture.link(
            ball(0.008 * size, FRAME), _place(picture, sequence.curve_point(frame), behind=-0.1)
        )
    width, height = (high - low) + 2 * margin
    picture.scene.render.resolution_x = PIXELS
    picture.scene.render.resolution_y = round(PIXELS * height / width)
    picture.scene.render.filepath = str(path)
    _look_at(picture, (low + high) / 2, max(width, height))
    picture.workbench()
    bpy.ops.render.render(write_still=True, scene=picture.scene.name)


def _place(picture, point, behind=0.0):
    return picture.turn @ Vector((float(point[0]), float(point[1]), -behind))


def _look_at(picture, middle, width):
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale, data.clip_end = "ORTHO", float(width), 1000.0
    camera = bpy.data.objects.new("Camera", data)
    picture.link(camera, _place(picture, middle, behind=-50.0))
    camera.rotation_euler = picture.turn.to_euler()
    picture.scene.camera = camera


def _tube(points, radius):
    data = bpy.data.curves.new("Curve", "CURVE")
    data.dimensions, data.bevel_depth = "3D", radius
    spline = data.splines.new("POLY")
    spline.points.add(len(points) - 1)
    for place, point in zip(points, spline.points):
        point.co = (*place, 1.0)
    source = bpy.data.objects.new("Curve", data)
    mesh = bpy.data.meshes.new_from_object(source)
    bpy.data.objects.remove(source)
    return painted(mesh, CURVE)
