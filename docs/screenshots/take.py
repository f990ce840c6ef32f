# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a Blender window by run.sh: the project's own creature, rigged, bound and posed, with a
picture at each step.
"""

import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Vector

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
sys.argv = [sys.argv[0], "--", tempfile.gettempdir()]  # what window_addon.py looks at
for folder in ("tests/blender", "examples"):
    sys.path.insert(0, str(ROOT / folder))

import window_addon as window  # noqa: E402
from characters.character import modelled  # noqa: E402
from perform import make_object  # noqa: E402

LARGEST = 200_000  # bytes


class Camera(window.Screen):
    """Pictures of the 3D view and of the sidebar."""

    def take(self, name, kind="WINDOW", width=420):
        path = os.path.join(tempfile.gettempdir(), "window.png")
        with self.override():
            bpy.ops.screen.screenshot(filepath=path)
        image = bpy.data.images.load(path)
        columns, rows = image.size
        pixels = np.empty(columns * rows * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        pixels = pixels.reshape(rows, columns, 4)
        region = self.region(kind)
        left, right = region.x, region.x + region.width
        if kind == "WINDOW":
            right = self.region("UI").x  # the view lies under the sidebar, too
        save(name, pixels[region.y : region.y + region.height, left:right], width)


def save(name, pixels, width):
    rows, columns = pixels.shape[:2]
    image = bpy.data.images.new(name, columns, rows)
    image.pixels.foreach_set(np.ascontiguousarray(pixels).ravel())
    if columns > width:
        image.scale(width, rows * width // columns)
    image.filepath_raw = str(IMAGES / f"{name}.png")
    image.file_format = "PNG"
    bpy.context.scene.render.image_settings.compression = 100
    image.save()
    bpy.data.images.remove(image)
    size = (IMAGES / f"{name}.png").stat().st_size
    window.check(size < LARGEST, f"{name}.png has {size} bytes")


def story():
    camera = Camera()
    yield from set_the_stage(camera)
    creature = bpy.data.objects["creature"]
    camera.take("exemplars")
    with camera.override():
        bpy.ops.exemplar.quick_rig()
    yield 1.0
    camera.take("quick-rig")
    camera.take("panel-before-bind", "UI", 280)
    with camera.override():
        bpy.ops.exemplar.bind("INVOKE_DEFAULT")
    yield from window.wait_for(lambda: creature.exemplar.bound, "bound", 300)
    yield 1.0
    pull(creature)
    yield 2.0
    camera.take("posed")
    camera.take("panel", "UI", 280)
    with camera.override():
        creature.active_shape_key_index = 2
        bpy.ops.exemplar.influence_show()
    yield 1.5
    camera.take("influence")
    print("all taken", flush=True)


def set_the_stage(camera):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with camera.override():
        make_object(modelled("creature", ROOT / "build" / "examples"))
        space = camera.area.spaces.active
        space.shading.color_type = "VERTEX"
        space.shading.show_cavity = True
        space.overlay.show_cursor = False
        space.overlay.show_text = False
        space.overlay.show_outline_selected = False
        space.show_gizmo = False
        space.show_region_toolbar = False
        space.region_3d.view_perspective = "PERSP"
        space.region_3d.view_rotation = Euler((1.35, 0.0, 0.75)).to_quaternion()
        space.show_region_ui = True
    yield 0.5
    with camera.override():
        bpy.ops.view3d.view_selected()
    yield from window.open_tab(camera)
    yield 0.5


def pull(creature):
    """Every tip some way towards where an exemplar has it, each of another one."""
    from blender_addon.scene import bindings, handles

    deformer = bindings.ensure(creature).deformer
    names = [key.name for key in creature.data.shape_keys.key_blocks][1:-1]
    for index, item in enumerate(handles.bound_items(creature)):
        target = deformer.handle_pose(1 + index % len(names))[index]
        there = creature.matrix_world @ Vector(target[:, 3])
        here = item.empty.matrix_world.translation.copy()
        item.empty.matrix_world.translation = here.lerp(there, 0.8)


if __name__ == "__main__":
    window.play(story())
