# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the add-on share. They run inside Blender:

    blender -b --factory-startup --python tests/blender/test_addon_live.py

Blender exits with 0 when a handler raises, so tests look at results, never at silence.
"""

import sys
import unittest

import bpy
import numpy
from mathutils import Matrix

from support import ROOT, data, run

sys.path.insert(0, str(ROOT))

import blender_addon  # noqa: E402

blender_addon.register()

from blender_addon.scene import bindings, results, solving, versions  # noqa: E402

__all__ = ["ROOT", "data", "run"]  # for the tests to find in one place

RINGS, CORNERS, HEIGHT = 13, 8, 2.4
LEVELS = {"Bottom": 0, "Middle": 6, "Top": 12}


class SceneCase(unittest.TestCase):
    def setUp(self):
        self.scene = bpy.context.scene

    def tearDown(self):
        bindings.clear()

    def assertClose(self, actual, expected, tolerance=1e-5, message=""):
        self.assertEqual(numpy.shape(actual), numpy.shape(expected))
        error = numpy.abs(numpy.asarray(actual) - numpy.asarray(expected)).max()
        self.assertLessEqual(error, tolerance, message)

    def assertFar(self, actual, expected, distance=1e-3):
        error = numpy.abs(numpy.asarray(actual) - numpy.asarray(expected)).max()
        self.assertGreater(error, distance)

    def assertFails(self, part, call, *arguments, **options):
        """The call raises with `part` in its sentence; returns the sentence."""
        with self.assertRaises((RuntimeError, bindings.ExemplarError)) as caught:
            call(*arguments, **options)
        self.assertIn(part, str(caught.exception))
        return str(caught.exception)


# ----------------------------------------------------------------------------------------- making


def bar_positions():
    angle = numpy.arange(CORNERS) * 2 * numpy.pi / CORNERS
    ring = numpy.column_stack([0.3 * numpy.cos(angle), 0.3 * numpy.sin(angle)])
    heights = numpy.linspace(0, HEIGHT, RINGS)
    return numpy.array([(x, y, z) for z in heights for x, y in ring])


def bar_faces():
    def quad(level, corner):
        low, high = level * CORNERS, (level + 1) * CORNERS
        after = (corner + 1) % CORNERS
        return (low + corner, low + after, high + after, high + corner)

    return [quad(level, corner) for level in range(RINGS - 1) for corner in range(CORNERS)]


def pose_bend(rest):
    x, y, z = rest.T
    bend, radius = 0.5 * z, 1 / 0.5
    across = (radius - x) * numpy.sin(bend)
    return numpy.column_stack([radius - (radius - x) * numpy.cos(bend), y, across])


def pose_fat(rest):
    x, y, z = rest.T
    wide = 1 + 0.8 * numpy.sin(z * numpy.pi / HEIGHT)
    return numpy.column_stack([x * wide, y * wide, 0.8 * z])


POSES = {"Bend": pose_bend, "Fat": pose_fat}


def make_mesh(name, positions, faces, poses=POSES):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(p) for p in positions], [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    if poses:
        obj.shape_key_add(name="Basis", from_mix=False)
    for pose, function in poses.items():
        key = obj.shape_key_add(name=pose, from_mix=False)
        key.value = 0.0  # Blender 5 begins at 1
        key.data.foreach_set("co", function(positions).astype(numpy.float32).ravel())
    return obj


def make_bar(name="Bar", matrix=None, poses=POSES):
    obj = make_mesh(name, bar_positions(), bar_faces(), poses)
    if matrix is not None:
        obj.matrix_world = matrix
    return obj


def level(index):
    return list(range(index * CORNERS, (index + 1) * CORNERS))


def activate(obj):
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj


def select(obj, vertices):
    mesh = obj.data
    for elements in (mesh.polygons, mesh.edges):
        elements.foreach_set("select", numpy.zeros(len(elements), bool))
    chosen = numpy.zeros(len(mesh.vertices), bool)
    chosen[vertices] = True
    mesh.vertices.foreach_set("select", chosen)


def add_handle(obj, vertices, kind="PINNED"):
    """As an artist does it; returns the empty."""
    activate(obj)
    select(obj, vertices)
    bpy.ops.exemplar.handle_add(kind=kind)
    return obj.exemplar.handles[-1].empty


def make_rig(name="Bar", matrix=None, kinds=("PINNED",) * 3, bind=True, poses=POSES):
    """A bar with three handles; returns (object, empties)."""
    obj = make_bar(name, matrix, poses)
    empties = [add_handle(obj, level(where), kind) for where, kind in zip(LEVELS.values(), kinds)]
    if bind:
        bpy.ops.exemplar.bind()
    return obj, empties


AWKWARD = Matrix.LocRotScale((0.5, -1.0, 0.25), Matrix.Rotation(0.6, 3, "X"), (1.5, 0.7, 1.2))


# ---------------------------------------------------------------------------------------- looking


def depsgraph():
    return bpy.context.evaluated_depsgraph_get()


def update():
    bpy.context.view_layer.update()


def visible(obj):
    """float32 [V][3] in the space of `obj`: what the viewport shows."""
    shown = results.shown_object(obj) if obj.exemplar.bound else obj
    evaluated = shown.evaluated_get(depsgraph())
    return versions.get_mesh_positions(evaluated.data)


def solved(obj):
    return solving.solve(obj).positions


def key(obj, name):
    return versions.get_key_positions(obj.data.shape_keys.key_blocks[name])


def solves(obj):
    return bindings.state_of(obj).solves


def problem(obj):
    return str(bindings.state_of(obj).problem or "")


def artists_keys(obj):
    """What we must never change."""
    mine = obj.exemplar.result_key
    return {
        k.name: key(obj, k.name).tobytes() for k in obj.data.shape_keys.key_blocks if k.name != mine
    }


def small_render(scene):
    """Quick, and the same each time."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    for obj in (camera, light):
        scene.collection.objects.link(obj)
    camera.matrix_world = Matrix.Translation((0.5, -8, 1.2)) @ Matrix.Rotation(1.5708, 4, "X")
    light.rotation_euler.x = 1.0
    scene.camera = camera
    scene.world = bpy.data.worlds.new("World")
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.render.image_settings.file_format = "PNG"
