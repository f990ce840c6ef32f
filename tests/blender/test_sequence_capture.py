# SPDX-License-Identifier: GPL-3.0-or-later
"""Capture: what animates a mesh does not matter, and what cannot be captured is named."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import bpy  # noqa: E402
import numpy  # noqa: E402
import sequence_support  # noqa: E402
from blender_addon.native import ShapeSpace  # noqa: E402
from sequence_support import (  # noqa: E402
    FIRST,
    LAST,
    SequenceCase,
    frames_of,
    make_animated,
    store,
)

RANGE = range(FIRST, LAST + 1)


class Capture(SequenceCase):
    def check_exact(self, obj, tolerance=2e-5):
        expected = frames_of(obj, RANGE)
        owner = self.capture(obj)
        self.assertClose(frames_of(owner, RANGE), expected, tolerance)
        return owner

    def test_shape_keys(self):
        owner = self.check_exact(make_animated())
        self.assertTrue(owner.exemplar_sequence.summary.startswith("16 frames"))
        self.assertTrue(self.source.hide_get() and self.source.hide_render)

    def test_frames_between_are_smooth(self):
        """Half-way frames lie near those of the source, which goes straight between keys."""
        obj = make_animated()
        expected = frames_of(obj, RANGE[:-1], subframe=0.5)
        owner = self.capture(obj)
        found = frames_of(owner, RANGE[:-1], subframe=0.5)
        step = numpy.abs(numpy.diff(frames_of(owner, RANGE), axis=0)).max()
        self.assertClose(found, expected, step / 4)
        self.assertFar(found, frames_of(owner, RANGE[:-1]), step / 4)

    def test_armature(self):
        obj = support.make_mesh("Bar", support.bar_positions(), support.bar_faces(), {})
        armature = bpy.data.objects.new("Bones", bpy.data.armatures.new("Bones"))
        self.scene.collection.objects.link(armature)
        support.activate(armature)
        bpy.ops.object.mode_set(mode="EDIT")
        for name, low, high in (("Low", 0.0, 1.2), ("High", 1.2, 2.4)):
            bone = armature.data.edit_bones.new(name)
            bone.head, bone.tail = (0, 0, low), (0, 0, high)
        bpy.ops.object.mode_set(mode="OBJECT")
        for name, low, high in (("Low", 0.0, 1.3), ("High", 1.1, 2.5)):
            heights = support.bar_positions()[:, 2]
            group = obj.vertex_groups.new(name=name)
            group.add(
                [int(v) for v in numpy.flatnonzero((heights >= low) & (heights <= high))], 1, "ADD"
            )
        obj.modifiers.new("Armature", "ARMATURE").object = armature
        bone = armature.pose.bones["High"]
        bone.rotation_mode = "XYZ"
        for frame, angle in ((FIRST, 0.0), (9, 0.9), (LAST, -0.4)):
            bone.rotation_euler.x = angle
            bone.keyframe_insert("rotation_euler", frame=frame)
        self.scene.frame_start, self.scene.frame_end = FIRST, LAST
        self.check_exact(obj)

    def test_our_own_deformer(self):
        obj, empties = support.make_rig()
        for frame, x in ((FIRST, 0.0), (8, 0.7), (LAST, -0.5)):
            empties[2].location = (x, 0.2 * x, 2.4 - 0.3 * abs(x))
            empties[2].keyframe_insert("location", frame=frame)
        self.scene.frame_start, self.scene.frame_end = FIRST, LAST
        self.check_exact(obj)

    def test_a_cache(self):
        """Baked, and played by a modifier."""
        first = self.capture()
        path = os.path.join(bpy.app.tempdir, "cache.pc2")
        bpy.ops.exemplar.bake(format="PC2", filepath=path)
        second = self.check_exact(first)
        self.assertNotEqual(second, first)

    def test_modifiers_are_part_of_it(self):
        obj = make_animated()
        obj.modifiers.new("Subdivision", "SUBSURF").levels = 1
        owner = self.check_exact(obj)
        self.assertGreater(len(owner.data.vertices), 2 * len(obj.data.vertices))

    def test_a_curve_object(self):
        """Anything that has a surface."""
        data = bpy.data.curves.new("Tube", "CURVE")
        data.dimensions, data.bevel_depth, data.bevel_resolution = "3D", 0.1, 1
        spline = data.splines.new("POLY")
        spline.points.add(5)
        for index, point in enumerate(spline.points):
            point.co = (0, 0, index, 1)
        obj = bpy.data.objects.new("Tube", data)
        self.scene.collection.objects.link(obj)
        for frame, depth in ((FIRST, 0.1), (LAST, 0.5)):
            data.bevel_depth = depth
            data.keyframe_insert("bevel_depth", frame=frame)
        self.scene.frame_start, self.scene.frame_end = FIRST, LAST
        owner = self.capture(obj)
        self.assertGreater(len(owner.data.polygons), 10)

    def test_object_space_and_world_space(self):
        obj = make_animated()
        obj.matrix_world = sequence_support.AWKWARD
        owner = self.capture(obj, hide_source=False)
        self.assertClose(numpy.array(owner.matrix_world), numpy.array(obj.matrix_world), 1e-6)
        obj.matrix_world.translation.x += 3
        for frame in (FIRST, LAST):
            obj.location.y = frame
            obj.keyframe_insert("location", frame=frame)
        support.update()
        owner = self.capture(obj, use_world_space=True)
        self.scene.frame_set(LAST)
        self.assertClose(numpy.array(owner.matrix_world), numpy.eye(4))
        expected = sequence_support.evaluated(self.source) if not obj.hide_get() else None
        self.source.hide_set(False)
        support.update()
        expected = sequence_support.evaluated(obj) @ numpy.array(obj.matrix_world)[:3, :3].T
        expected = expected + numpy.array(obj.matrix_world)[:3, 3]
        self.assertClose(sequence_support.evaluated(owner), expected, 1e-4)

    def test_step_and_range(self):
        owner = self.capture(
            use_scene_range=False, frame_start=2, frame_end=14, frame_step=3, hide_source=False
        )
        self.assertEqual(store.peek(owner).sequence.info.frame_count, 5)
        for frame in (2, 5, 8, 11, 14):
            self.assertClose(frames_of(owner, [frame]), frames_of(self.source, [frame]), 2e-5)
        self.assertEqual(owner.exemplar_sequence.frame_step, 3)

    def test_tolerance_and_counts(self):
        obj = make_animated()
        expected = frames_of(obj, RANGE)
        diagonal = numpy.linalg.norm(numpy.ptp(expected[0], axis=0))
        for tolerance in (2.0, 0.2):
            owner = self.capture(obj, fidelity="TOLERANCE", tolerance=tolerance, hide_source=False)
            error = numpy.sqrt(((frames_of(owner, RANGE) - expected) ** 2).sum(axis=2).mean())
            self.assertLess(error / diagonal, tolerance / 100 * 1.05)
        owner = self.capture(
            obj, fidelity="COUNTS", control_points=9, poses=8, shapes=2, hide_source=False
        )
        window = store.peek(owner).sequence.window()
        self.assertEqual((window.control_point_count, window.site_count), (9, 8))
        self.assertEqual(store.peek(owner).sequence.info.component_count, 2)

    def test_every_kind_of_shapes(self):
        """Each gives the frames back; all but positions keep what bends from shrinking."""
        obj = make_animated()
        expected = frames_of(obj, RANGE)
        for space in ShapeSpace:
            with self.subTest(space.name):
                owner = self.capture(obj, shape_space=space.name, hide_source=False)
                self.assertClose(frames_of(owner, RANGE), expected, 2e-3)
                self.assertEqual(store.peek(owner).sequence.info.shape_space, space)
                store.clear()
                self.assertClose(frames_of(owner, RANGE), expected, 2e-3)

    def test_cyclic(self):
        obj = make_animated()
        owner = self.capture(obj, cyclic=True)
        self.scene.frame_set(FIRST)
        first = sequence_support.evaluated(owner)
        self.scene.frame_set(FIRST + len(RANGE))
        self.assertClose(sequence_support.evaluated(owner), first, 1e-5)
        self.assertEqual(len(owner.exemplar_sequence.curve.data.edges), len(RANGE))

    def test_source_stays_as_it_was(self):
        obj = make_animated()
        before = {key.name: support.key(obj, key.name) for key in obj.data.shape_keys.key_blocks}
        self.scene.frame_set(7)
        self.capture(obj)
        self.assertEqual(self.scene.frame_current, 7)
        for name, positions in before.items():
            self.assertClose(support.key(obj, name), positions, 0)
        self.assertEqual(len(obj.modifiers), 0)

    def test_capture_again(self):
        owner = self.capture(fidelity="COUNTS", control_points=5, poses=4, shapes=2)
        owner.exemplar_capture.fidelity = "EXACT"
        bpy.ops.exemplar.sequence_refit()
        self.assertTrue(self.source.hide_get())
        self.assertClose(frames_of(owner, RANGE), self.captured_frames(), 2e-5)
        self.assertEqual(len(owner.exemplar_sequence.curve.data.vertices), len(RANGE) + 2)


class Refusals(SequenceCase):
    def refused(self, part, obj, **options):
        support.activate(obj)
        before = (len(bpy.data.objects), len(bpy.data.texts), len(bpy.data.meshes))
        frame = self.scene.frame_current
        self.assertFails(part, bpy.ops.exemplar.sequence_capture, fidelity="EXACT", **options)
        after = (len(bpy.data.objects), len(bpy.data.texts), len(bpy.data.meshes))
        self.assertEqual(after, before)
        self.assertEqual(self.scene.frame_current, frame)
        self.assertFalse(obj.hide_get())

    def test_a_change_of_topology_is_named_by_its_frame(self):
        obj = make_animated()
        modifier = obj.modifiers.new("Build", "DECIMATE")
        modifier.decimate_type = "UNSUBDIV"
        for frame, iterations in ((10, 0), (11, 2)):
            modifier.iterations = iterations
            modifier.keyframe_insert("iterations", frame=frame)
        self.refused("changes on frame 11", obj)

    def test_too_few_frames(self):
        obj = make_animated()
        for end, words in ((1, "there is one"), (2, "there are 2")):
            self.refused(words, obj, use_scene_range=False, frame_start=1, frame_end=end)
        self.refused(
            "in steps of 9 there are 2", obj, use_scene_range=False, frame_end=16, frame_step=9
        )
        self.refused("comes before", obj, use_scene_range=False, frame_start=9, frame_end=1)

    def test_nothing_moves(self):
        self.scene.frame_start, self.scene.frame_end = 1, 6
        self.refused("No sequence was made", support.make_bar())

    def test_not_a_number(self):
        obj = make_animated()
        key = obj.data.shape_keys.key_blocks["Fat"]
        key.data[5].co = (float("nan"), 0, 0)
        self.refused("Vertex 5", obj)

    def test_no_faces(self):
        mesh = bpy.data.meshes.new("Line")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
        line = bpy.data.objects.new("Line", mesh)
        self.scene.collection.objects.link(line)
        self.refused("no faces on frame 1", line)
        empty = bpy.data.objects.new("Nothing", bpy.data.meshes.new("Nothing"))
        self.scene.collection.objects.link(empty)
        self.refused("no faces on frame 1", empty)

    def test_a_flat_mesh_can_be_captured(self):
        obj = support.make_mesh(
            "Sheet",
            numpy.array([(x, y, 0) for y in range(4) for x in range(4)], float),
            [
                (y * 4 + x, y * 4 + x + 1, y * 4 + x + 5, y * 4 + x + 4)
                for y in range(3)
                for x in range(3)
            ],
            {"Wave": lambda p: p + numpy.sin(p[:, [1]]) * (0.4, 0, 0)},
        )
        block = obj.data.shape_keys.key_blocks["Wave"]
        for frame, value in ((1, 0), (6, 1), (12, 0.2)):
            block.value = value
            block.keyframe_insert("value", frame=frame)
        self.scene.frame_start, self.scene.frame_end = 1, 12
        expected = frames_of(obj, range(1, 13))
        self.assertClose(frames_of(self.capture(obj), range(1, 13)), expected, 1e-5)

    def test_an_empty_cannot(self):
        empty = bpy.data.objects.new("Empty", None)
        self.scene.collection.objects.link(empty)
        support.activate(empty)
        self.assertFalse(bpy.ops.exemplar.sequence_capture.poll())

    def test_in_edit_mode(self):
        obj = make_animated()
        support.activate(obj)
        bpy.ops.object.mode_set(mode="EDIT")
        self.assertFalse(bpy.ops.exemplar.sequence_capture.poll())
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_capture_again_of_another_mesh(self):
        owner = self.capture()
        self.source.modifiers.new("Subdivision", "SUBSURF").levels = 1
        support.activate(owner)
        expected = frames_of(owner, RANGE)
        self.assertFails("capture it as a new sequence", bpy.ops.exemplar.sequence_refit)
        self.assertClose(frames_of(owner, RANGE), expected, 0)


if __name__ == "__main__":
    support.run(globals())
