# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: what a frame of a drag costs with the mesh live, at 50 000 vertices, eight shape
keys and ten handles; measure.py's Worker asks, or run it by itself for a line of figures:

    blender -b --factory-startup -t 1 --python-exit-code 3 --python tests/bench/blender_live.py

Steps of a drag, as in a window: warm solves where stateless ones take long.

"ours"     seconds of our handler: empties read, solved, positions written
"rest"     seconds of the rest of the frame: Blender's own evaluation of the mesh that has changed
Processor time, for the wall clock tells of other programs as well.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import blender_addon  # noqa: E402

blender_addon.register()

from blender_addon.scene import bindings, handle_editing, live  # noqa: E402

RINGS, CORNERS = 500, 100
LENGTH, RADIUS = 10.0, 0.5
KEYS, HANDLES = 8, 10


def tube():
    angle = numpy.arange(CORNERS) * 2 * numpy.pi / CORNERS
    along = numpy.linspace(0, LENGTH, RINGS)
    circle = RADIUS * numpy.column_stack([numpy.cos(angle), numpy.sin(angle)])
    places = numpy.empty((RINGS, CORNERS, 3))
    places[:, :, :2] = circle
    places[:, :, 2] = along[:, None]
    corner = numpy.arange(RINGS * CORNERS).reshape(RINGS, CORNERS)
    right = numpy.roll(corner, -1, axis=1)
    faces = numpy.stack([corner[:-1], right[:-1], right[1:], corner[1:]], axis=-1)
    return places.reshape(-1, 3), faces.reshape(-1, 4)


def bent(places, where, angle):
    """By `angle` about Y, over a tenth of the length around `where`, and all beyond."""
    z = places[:, 2]
    turn = angle * numpy.clip((z - where) / (0.1 * LENGTH) + 0.5, 0, 1)
    steps = numpy.linspace(0, LENGTH, 2000)
    turns = angle * numpy.clip((steps - where) / (0.1 * LENGTH) + 0.5, 0, 1)
    spine = numpy.cumsum(numpy.stack([numpy.sin(turns), numpy.cos(turns)]), axis=1)
    spine *= steps[1]
    x = numpy.interp(z, steps, spine[0]) + places[:, 0] * numpy.cos(turn)
    height = numpy.interp(z, steps, spine[1]) - places[:, 0] * numpy.sin(turn)
    return numpy.column_stack([x, places[:, 1], height])


def make_rig():
    places, faces = tube()
    mesh = bpy.data.meshes.new("Tube")
    mesh.from_pydata(places.tolist(), [], faces.tolist())
    obj = bpy.data.objects.new("Tube", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.shape_key_add(name="Basis", from_mix=False)
    for k in range(1, KEYS):
        key = obj.shape_key_add(name=f"Bend {k}", from_mix=False)
        key.value = 0.0
        shape = bent(places, LENGTH * k / KEYS, 0.8 if k % 2 else -0.8)
        key.data.foreach_set("co", shape.astype(numpy.float32).ravel())
    for ring in numpy.linspace(0, RINGS - 1, HANDLES).astype(int):
        vertices = numpy.arange(ring * CORNERS, (ring + 1) * CORNERS, dtype=numpy.uint32)
        handle_editing.add(obj, vertices, "PINNED")
    bpy.ops.exemplar.bind()
    return obj


class Clock:
    """Wraps our handler to know what of a frame is ours."""

    def __init__(self):
        self.seconds = 0.0
        handlers = bpy.app.handlers.depsgraph_update_post
        handlers.remove(live.on_depsgraph_update)
        handlers.append(self._timed)

    def _timed(self, scene, depsgraph):
        began = time.process_time()
        live.on_depsgraph_update(scene, depsgraph)
        self.seconds += time.process_time() - began


class Drag:
    def __init__(self):
        self.obj = make_rig()
        live.is_interactive = lambda: True  # there is no hand here, and no timer to settle
        self.clock = Clock()
        self.step = 0
        self.empty = self.obj.exemplar.handles[HANDLES - 1].empty
        self.start = self.empty.location.copy()
        bpy.context.view_layer.update()

    def frame(self):
        """(ours, the rest) in seconds."""
        self.step += 1
        turn = 0.05 * self.step
        self.empty.location = self.start
        self.empty.location.x += numpy.sin(turn)
        self.empty.location.z -= 0.5 - 0.5 * numpy.cos(turn)
        solves, self.clock.seconds = bindings.state_of(self.obj).solves, 0.0
        began = time.process_time()
        bpy.context.view_layer.update()
        whole = time.process_time() - began
        if bindings.state_of(self.obj).solves != solves + 1:
            raise RuntimeError("a frame is one solve")
        return self.clock.seconds, whole - self.clock.seconds


def main():
    drag = Drag()
    for _ in range(5):
        drag.frame()
    if "--" not in sys.argv:
        frames = numpy.array([drag.frame() for _ in range(60)])
        ours, rest = 1000 * numpy.median(frames, axis=0)
        report = bindings.state_of(drag.obj).result.report
        print(
            f"= Blender {bpy.app.version_string}: ours {ours:.2f} ms, the rest {rest:.2f} ms; "
            f"the solve alone {1000 * report.seconds:.2f} ms by the wall clock"
        )
        return
    print("=", flush=True)
    for _ in sys.stdin:
        print("=", *drag.frame(), flush=True)


main()
