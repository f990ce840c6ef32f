# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture strips: many poses of one mesh side by side, in one orthographic picture."""

import math

import bmesh
import bpy
import numpy as np
from mathutils import Euler, Vector

PAPER, INK, SOFT = (0.9, 0.91, 0.92), (0.01, 0.01, 0.015), (0.06, 0.065, 0.08)
KIND_COLOURS = {
    "PINNED": (0.05, 0.25, 0.85),
    "ORIENTED": (0.85, 0.08, 0.1),
    "FREE": (0.45, 0.45, 0.45),
}
TITLE = 0.15  # of a tile's height, below each picture
BEFORE = (
    6.0  # tiles in front of the meshes: where handles and labels are, so that nothing hides them
)


class Strip:
    """Tiles in rows; each has a pose of the mesh, a label, and dots where handles are."""

    def __init__(self, look, faces, colours, columns):
        self.look, self.faces, self.colours, self.columns = look, faces, colours, columns
        self.tiles = []
        self.width, self.height = look.width, look.width / look.aspect * (1.0 + TITLE)
        turn = Euler((math.radians(90.0 - look.height), 0.0, math.radians(look.heading)))
        self.turn = turn.to_matrix()
        self.scene = bpy.data.scenes.new("Strip")

    def add(self, positions, label="", strong=False, dots=(), colours=None):
        """dots: (place [3], kind, turn [3][3] or None); colours [V][3] instead of the strip's"""
        column, row = len(self.tiles) % self.columns, len(self.tiles) // self.columns
        self.tiles.append(label)
        place = self.turn @ Vector((column * self.width, -row * self.height, 0.0))
        place -= Vector(self.look.centre)
        self.link(self.mesh(positions, colours), place)
        for dot in dots:
            self._dot(place, *dot)
        if label:
            self._label(label, strong, place)

    def link(self, obj, place):
        self.scene.collection.objects.link(obj)
        obj.location = place

    def mesh(self, positions, colours=None):
        """colours [V][3] instead of the strip's"""
        mesh = bpy.data.meshes.new("Pose")
        mesh.from_pydata(np.asarray(positions, dtype=float).tolist(), [], self.faces.tolist())
        mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
        mesh.update()
        colours = self.colours if colours is None else colours
        colours = np.hstack([colours, np.ones((len(colours), 1))])
        layer = mesh.color_attributes.new("Colour", "FLOAT_COLOR", "POINT")
        layer.data.foreach_set("color", colours.ravel())
        return bpy.data.objects.new("Pose", mesh)

    def _dot(self, place, centre, kind, turn=None):
        unit = self.width
        towards = self.turn @ Vector((0.0, 0.0, BEFORE * unit))
        at = place + Vector(centre) + towards
        outer, inner = (0.0145, 0.0112) if kind != "FREE" else (0.0105, 0.0078)
        self.link(ball(unit * outer, (1.0, 1.0, 1.0)), at - towards * 0.1)
        self.link(ball(unit * inner, KIND_COLOURS[kind]), at)
        if turn is not None:
            for axis, colour in enumerate(((0.8, 0.1, 0.1), (0.1, 0.55, 0.1), (0.1, 0.2, 0.85))):
                tip = Vector(np.asarray(turn)[:, axis]) * unit * 0.075
                self.link(_rod(tip, unit * 0.004, colour), at - towards * 0.05)

    def _label(self, words, strong, place):
        size, colour = (0.064, INK) if strong else (0.056, SOFT)
        below = Vector((0.0, (0.075 - 0.5) * self.height, BEFORE * self.width))
        at = place + Vector(self.look.centre) + self.turn @ below
        self._write(words, size * self.width, colour, at, "CENTER", bold=strong)

    def _write(self, words, size, colour, place, align, bold=False):
        """Text as a mesh, for Workbench paints only those."""
        text = bpy.data.curves.new("Text", "FONT")
        text.body, text.align_x, text.size = words, align, size
        text.offset = 0.015 * size if bold else 0.0
        text.resolution_u = 3
        source = bpy.data.objects.new("Text", text)
        mesh = bpy.data.meshes.new_from_object(source)
        bpy.data.objects.remove(source)
        bpy.data.curves.remove(text)
        written = painted(mesh, colour)
        self.link(written, place)
        written.rotation_euler = self.turn.to_euler()

    def render(self, path, tile_pixels, title=""):
        rows = math.ceil(len(self.tiles) / self.columns)
        head = 0.13 * self.width if title else 0.0
        width, height = self.columns * self.width, rows * self.height + head
        if title:
            self._title(title, head)
        self._camera(width, height, head)
        render = self.scene.render
        render.resolution_x = tile_pixels * self.columns
        render.resolution_y = round(render.resolution_x * height / width)
        render.filepath = str(path)
        self.workbench()
        bpy.ops.render.render(write_still=True, scene=self.scene.name)

    def _title(self, words, head):
        corner = Vector((-0.46 * self.width, 0.5 * self.height + 0.25 * head, 1.0))
        self._write(words, 0.5 * head, INK, self.turn @ corner, "LEFT")

    def _camera(self, width, height, head):
        data = bpy.data.cameras.new("Camera")
        data.type = "ORTHO"
        data.ortho_scale = max(width, height)
        data.clip_end = 100.0 * self.width
        camera = bpy.data.objects.new("Camera", data)
        middle = (
            (width - self.width) / 2.0,
            head - (height - self.height) / 2.0,
            50.0 * self.width,
        )
        self.link(camera, self.turn @ Vector(middle))
        camera.rotation_euler = self.turn.to_euler()
        self.scene.camera = camera

    def workbench(self):
        scene = self.scene
        scene.render.engine = "BLENDER_WORKBENCH"
        scene.render.image_settings.color_mode = "RGB"
        scene.view_settings.view_transform = "Standard"
        scene.world = bpy.data.worlds.new("Paper")
        scene.world.color = PAPER
        scene.display.render_aa = "8"
        shading = scene.display.shading
        shading.light, shading.color_type = "STUDIO", "VERTEX"
        shading.show_cavity, shading.cavity_type = True, "BOTH"
        shading.cavity_ridge_factor, shading.cavity_valley_factor = 0.2, 1.0
        shading.show_specular_highlight = True


def ball(radius, colour):
    mesh = bpy.data.meshes.new("Dot")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=2, radius=radius)
    shape.to_mesh(mesh)
    shape.free()
    return painted(mesh, colour)


def _rod(tip, radius, colour):
    mesh = bpy.data.meshes.new("Axis")
    shape = bmesh.new()
    turn = Vector((0.0, 0.0, 1.0)).rotation_difference(tip).to_matrix().to_4x4()
    turn.translation = tip / 2.0
    bmesh.ops.create_cone(
        shape,
        cap_ends=True,
        segments=8,
        radius1=radius,
        radius2=radius,
        depth=tip.length,
        matrix=turn,
    )
    shape.to_mesh(mesh)
    shape.free()
    return painted(mesh, colour)


def painted(mesh, colour):
    layer = mesh.color_attributes.new("Colour", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", [*colour, 1.0] * len(mesh.vertices))
    return bpy.data.objects.new(mesh.name, mesh)
