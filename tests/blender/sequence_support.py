# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of sequences share: an animated bar, and what a sequence of it shows."""

import bpy
import numpy
from mathutils import Matrix

from addon_support import SceneCase, activate, bar_faces, bar_positions, depsgraph, make_mesh
from blender_addon.scene import versions
from blender_addon.scene.sequences import live, owners, store, syncing

__all__ = ["SequenceCase", "live", "owners", "store", "syncing"]

FIRST, LAST = 1, 16


def bend(positions, angle):
    """The bar bent by an angle over its length, in the plane of x and z."""
    if abs(angle) < 1e-9:
        return positions.copy()
    x, y, z = positions.T
    radius = 2.4 / angle
    turn = z / radius
    return numpy.column_stack(
        [radius - (radius - x) * numpy.cos(turn), y, (radius - x) * numpy.sin(turn)]
    )


def make_animated(name="Bar", first=FIRST, last=LAST):
    """A bar that shape keys bend to and fro, twice, a little fatter the second time."""
    rest = bar_positions()
    obj = make_mesh(
        name,
        rest,
        bar_faces(),
        {
            "Bend": lambda p: bend(p, 1.1),
            "Back": lambda p: bend(p, -1.4),
            "Fat": lambda p: p * (1.5, 1.5, 0.9),
        },
    )
    blocks = obj.data.shape_keys.key_blocks
    for frame in range(first, last + 1):
        turn = (frame - first) / (last - first) * 4 * numpy.pi
        blocks["Bend"].value = max(0.0, numpy.sin(turn))
        blocks["Back"].value = max(0.0, -numpy.sin(turn))
        blocks["Fat"].value = 0.5 * (frame - first) / (last - first)
        for key in ("Bend", "Back", "Fat"):
            blocks[key].keyframe_insert("value", frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = first, last
    scene.frame_set(first)
    return obj


def evaluated(obj):
    """float32 [V][3]: what the viewport shows of an object."""
    return versions.get_mesh_positions(obj.evaluated_get(depsgraph()).data)


def frames_of(obj, frames, subframe=0.0):
    scene = bpy.context.scene
    current = scene.frame_current
    found = []
    for frame in frames:
        scene.frame_set(frame, subframe=subframe)
        found.append(evaluated(obj).copy())
    scene.frame_set(current)
    return numpy.stack(found)


def move(obj, indices, by):
    """Move vertices of a mesh in Object Mode, as a script or a sculptor would."""
    for index in indices:
        obj.data.vertices[index].co.x += by[0]
        obj.data.vertices[index].co.y += by[1]
    obj.data.update()
    bpy.context.view_layer.update()


class SequenceCase(SceneCase):
    def tearDown(self):
        store.clear()
        super().tearDown()

    def capture(self, obj=None, **options):
        """The object that shows the sequence of an animated bar."""
        self.source = obj or make_animated()
        activate(self.source)
        options = {"fidelity": "EXACT", **options}
        self.assertEqual(bpy.ops.exemplar.sequence_capture(**options), {"FINISHED"})
        return bpy.context.view_layer.objects.active

    def captured_frames(self):
        """Of the hidden source, by itself."""
        self.source.hide_set(False)
        found = frames_of(self.source, range(FIRST, LAST + 1))
        self.source.hide_set(True)
        return found

    def problem(self, owner):
        shown, state = store.shown(owner), store.peek(owner)
        return str(shown.problem or state.problem or "")


AWKWARD = Matrix.LocRotScale((0.5, -1.0, 0.25), Matrix.Rotation(0.6, 3, "X"), (1.5, 0.7, 1.2))
