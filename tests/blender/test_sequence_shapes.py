# SPDX-License-Identifier: GPL-3.0-or-later
"""Retiming, shapes of the artist's own, animation from nothing, another character."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import bpy  # noqa: E402
import numpy  # noqa: E402
from blender_addon.scene import versions  # noqa: E402
from blender_addon.scene.sequences import retiming  # noqa: E402
from sequence_support import (  # noqa: E402
    FIRST,
    LAST,
    SequenceCase,
    bend,
    evaluated,
    frames_of,
    make_animated,
    move,
    store,
)

RANGE = range(FIRST, LAST + 1)


def native(owner):
    return store.ensure(owner).sequence


def shape(owner, time):
    """What a captured frame's time shows, by the library."""
    data = owner.exemplar_sequence
    return native(owner).evaluate((time - data.first_frame) / data.frame_step)


class Time(SequenceCase):
    def test_the_curve_is_a_straight_line_at_first(self):
        owner = self.capture()
        curve = retiming.curve_of(owner)
        self.assertEqual(curve.data_path, "exemplar_sequence.time")
        for frame in (-3, 1, 4.5, 16, 30):
            self.assertAlmostEqual(curve.evaluate(frame), frame, places=4)

    def test_an_edited_curve_retimes(self):
        """Fast, slow, backwards, and a stop."""
        owner = self.capture()
        curve = retiming.curve_of(owner)
        for frame, value in ((5, 9.0), (9, 11.0), (12, 11.0), (16, 3.0)):
            point = curve.keyframe_points.insert(frame, value)
            point.interpolation = "LINEAR"
        curve.update()
        for frame, sub in ((3, 0.0), (5, 0.0), (7, 0.25), (10, 0.5), (11, 0.0), (14, 0.0)):
            self.scene.frame_set(frame, subframe=sub)
            self.assertClose(evaluated(owner), shape(owner, curve.evaluate(frame + sub)), 1e-5)
        self.assertClose(frames_of(owner, [10]), frames_of(owner, [11]), 0)

    def test_speed(self):
        owner = self.capture()
        expected = [shape(owner, 1 + 0.5 * frame) for frame in range(8)]
        self.scene.frame_set(1)
        support.activate(owner)
        bpy.ops.exemplar.sequence_speed(factor=0.5)
        self.assertClose(frames_of(owner, range(1, 9)), numpy.stack(expected), 1e-5)
        bpy.ops.exemplar.sequence_play_as_captured()
        self.assertClose(frames_of(owner, [9])[0], shape(owner, 9), 1e-5)

    def test_frame_rate(self):
        """As many seconds at 60 frames a second as at 24."""
        owner = self.capture()
        self.scene.render.fps = 60
        support.activate(owner)
        bpy.ops.exemplar.sequence_frame_rate()
        self.assertEqual(owner.exemplar_sequence.fps, 60)
        for frame in (1, 6, 11, 23):
            at = 1 + (frame - 1) * 24 / 60
            self.assertClose(frames_of(owner, [frame])[0], shape(owner, at), 1e-5)
        bpy.ops.exemplar.sequence_frame_rate()  # nothing to do any more
        self.assertClose(frames_of(owner, [6])[0], shape(owner, 3), 1e-5)

    def test_without_a_curve(self):
        owner = self.capture()
        owner.animation_data_clear()
        support.activate(owner)
        self.assertFails("no keyframes to move", bpy.ops.exemplar.sequence_speed, factor=2)
        owner.exemplar_sequence.time = 7.5
        support.update()
        self.assertClose(evaluated(owner), shape(owner, 7.5), 1e-5)

    def test_a_driver_may_do_it(self):
        owner = self.capture()
        owner.animation_data_clear()
        driver = owner.driver_add("exemplar_sequence.time").driver
        driver.expression = "4 + frame / 4"
        self.scene.frame_set(10)
        self.assertClose(evaluated(owner), shape(owner, 6.5), 1e-5)


class NewShape(SequenceCase):
    def at(self, owner, point):
        owner.exemplar_sequence.playhead.location = (*point, 0)
        support.update()

    def test_of_another_mesh_that_a_deformer_poses(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        new = bend(support.bar_positions(), 2.2)
        other = support.make_mesh("Other", new, support.bar_faces(), {})
        lattice = other.modifiers.new("Cast", "CAST")
        lattice.factor = 0.3
        support.update()
        expected = evaluated(other)
        self.assertFar(expected, numpy.float32(new))
        point = (0.9, 0.8)
        self.at(owner, point)
        support.activate(owner)
        other.select_set(True)
        bpy.ops.exemplar.sequence_new_shape()
        self.assertClose(native(owner).pose(point), expected, 2e-3)
        self.assertEqual(owner.exemplar_sequence.follow, "PLAYHEAD")
        self.assertClose(evaluated(owner), expected, 2e-3)
        mesh = owner.exemplar_sequence.marks.data
        self.assertEqual(len(mesh.vertices), len(RANGE) + 1)
        self.assertClose(numpy.array(mesh.vertices[-1].co[:2]), numpy.array(point), 1e-6)
        owner.exemplar_sequence.follow = "TIME"
        # Far from it the animation is much as it was; the curve has not moved.
        self.assertClose(frames_of(owner, RANGE), before, 0.05)
        self.assertEqual(self.problem(owner), "")

    def test_sculpted(self):
        owner = self.capture()
        self.at(owner, (0.5, 0.9))
        support.activate(owner)
        bpy.ops.object.mode_set(mode="SCULPT")
        positions = versions.get_mesh_positions(owner.data)
        positions[:, 0] *= 3
        versions.set_mesh_positions(owner.data, positions)
        bpy.ops.exemplar.sequence_new_shape()
        self.assertEqual(owner.mode, "OBJECT")
        self.assertClose(evaluated(owner), positions, 5e-3)

    def test_survives_moving_marks_and_files(self):
        owner = self.capture()
        other = support.make_mesh(
            "Other", bend(support.bar_positions(), 2.2), support.bar_faces(), {}
        )
        self.at(owner, (0.9, 0.8))
        support.activate(owner)
        other.select_set(True)
        bpy.ops.exemplar.sequence_new_shape()
        move(owner.exemplar_sequence.marks, [16], (0.1, 0.0))
        self.assertEqual(self.problem(owner), "")
        self.at(owner, (1.0, 0.8))
        self.assertClose(evaluated(owner), evaluated(other), 5e-3)
        seen = evaluated(owner)
        store.clear()
        self.scene.frame_set(3)
        self.assertClose(evaluated(owner), seen, 1e-5)

    def test_refusals(self):
        owner = self.capture()
        self.at(owner, (0.9, 0.8))
        support.activate(owner)
        self.assertFails("Select another mesh", bpy.ops.exemplar.sequence_new_shape)
        cube = bpy.data.meshes.new("Cube")
        cube.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        cube = bpy.data.objects.new("Cube", cube)
        self.scene.collection.objects.link(cube)
        cube.select_set(True)
        self.assertFails("has 3 vertices", bpy.ops.exemplar.sequence_new_shape)
        other = support.make_mesh("Other", support.bar_positions(), support.bar_faces(), {})
        support.activate(owner)
        other.select_set(True)
        self.at(owner, native(owner).marks()[0][2])
        self.assertFails("The playhead is on mark 2", bpy.ops.exemplar.sequence_new_shape)
        self.assertEqual(len(owner.exemplar_sequence.marks.data.vertices), len(RANGE))


class FromNothing(SequenceCase):
    def make(self, **options):
        self.source = support.make_mesh(
            "Face",
            support.bar_positions(),
            support.bar_faces(),
            {
                "Left": lambda p: bend(p, 1.0),
                "Right": lambda p: bend(p, -1.0),
                "Fat": lambda p: p * (1.8, 1.8, 0.8),
                "Tall": lambda p: p * (0.8, 0.8, 1.3),
            },
        )
        support.activate(self.source)
        bpy.ops.exemplar.sequence_from_keys(frame_count=24, **options)
        return bpy.context.view_layer.objects.active

    def test_the_poses_are_where_their_marks_are(self):
        owner = self.make()
        for mark, key in zip(native(owner).marks()[0], self.source.data.shape_keys.key_blocks):
            expected = support.key(self.source, key.name)
            self.assertClose(native(owner).pose(mark), expected, 1e-5)
        self.assertEqual(native(owner).info.frame_count, 24)
        self.assertFar(frames_of(owner, [5]), frames_of(owner, [18]))

    def test_poses_placed_by_hand_and_a_drawn_curve(self):
        owner = self.make()
        mesh = owner.exemplar_sequence.marks.data
        places = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]
        for vertex, place in zip(mesh.vertices, places):
            vertex.co = (*place, 0)
        mesh.update()
        support.update()
        self.assertEqual(self.problem(owner), "")
        # A stroke in the plane, from the left pose to the fat one.
        data = bpy.data.curves.new("Stroke", "CURVE")
        data.dimensions = "3D"
        spline = data.splines.new("POLY")
        line = [(1, 0), (0.7, 0.2), (0.3, 0.6), (0, 1)]
        spline.points.add(len(line) - 1)
        for point, place in zip(spline.points, line):
            point.co = (*place, 0, 1)
        stroke = bpy.data.objects.new("Stroke", data)
        stroke.parent = owner.exemplar_sequence.plane
        self.scene.collection.objects.link(stroke)
        support.activate(owner)
        stroke.select_set(True)
        bpy.ops.exemplar.sequence_draw(frame_count=30, control_points=12)
        self.assertEqual(native(owner).info.frame_count, 30)
        self.assertClose(native(owner).control_points()[0], numpy.array([1.0, 0.0]), 1e-5)
        first, last = frames_of(owner, [1, 30])
        # A B-spline begins a little inside of its polygon.
        self.assertClose(first, support.key(self.source, "Left"), 0.3)
        self.assertClose(last, support.key(self.source, "Fat"), 0.3)
        for frame in (1, 15, 30):
            expected = native(owner).pose(native(owner).curve_point(frame - 1))
            self.assertClose(frames_of(owner, [frame])[0], expected, 1e-5)
        # A pose that is moved afterwards leaves the drawn curve where it is.
        before = native(owner).control_points()
        move(owner.exemplar_sequence.marks, [4], (0.1, -0.2))
        self.assertEqual(self.problem(owner), "")
        self.assertEqual(native(owner).info.frame_count, 30)
        self.assertClose(native(owner).control_points(), before, 1e-6)

    def test_the_polygon_itself_as_the_way(self):
        owner = self.make()
        move(owner.exemplar_sequence.curve, [2], (0.2, 0.3))
        polygon = native(owner).control_points()
        support.activate(owner)
        bpy.ops.exemplar.sequence_draw(frame_count=60)
        self.assertEqual(native(owner).info.frame_count, 60)
        self.assertClose(native(owner).control_points(), polygon, 1e-6)

    def test_refusals(self):
        bar = support.make_bar(poses={"Bend": support.pose_bend})
        support.activate(bar)
        self.assertFalse(bpy.ops.exemplar.sequence_from_keys.poll())
        owner = self.make()
        for points, words in ((((0, 0), (0, 0)), "no length"), (((0, 0),), "not one open line")):
            data = bpy.data.curves.new("Stroke", "CURVE")
            spline = data.splines.new("POLY")
            spline.points.add(len(points) - 1)
            stroke = bpy.data.objects.new("Stroke", data)
            self.scene.collection.objects.link(stroke)
            support.activate(owner)
            stroke.select_set(True)
            self.assertFails(words, bpy.ops.exemplar.sequence_draw, frame_count=10)
            bpy.data.objects.remove(stroke)

    def test_equal_keys(self):
        obj = support.make_bar(poses={name: (lambda p: p) for name in ("A", "B", "C")})
        support.activate(obj)
        before = len(bpy.data.objects)
        self.assertFails("No sequence was made", bpy.ops.exemplar.sequence_from_keys)
        self.assertEqual(len(bpy.data.objects), before)


class Transfer(SequenceCase):
    def other(self, poses=None):
        """A flatter bar of other connectivity, with poses of the same names."""
        rest = support.bar_positions() * (2, 0.5, 1.5)
        faces = [
            triangle for a, b, c, d in support.bar_faces() for triangle in ((a, b, c), (a, c, d))
        ]
        poses = poses or {
            "Bend": lambda p: bend(p / (2, 0.5, 1.5), 1.1) * (2, 0.5, 1.5),
            "Back": lambda p: bend(p / (2, 0.5, 1.5), -1.4) * (2, 0.5, 1.5),
            "Fat": lambda p: p * (1.5, 1.5, 0.9),
        }
        return support.make_mesh("Other", rest, faces, poses)

    def transferred(self, owner, other, **options):
        chosen = self.scene.exemplar_transfer
        chosen.examples, chosen.target = self.source, other
        support.activate(owner)
        self.assertEqual(bpy.ops.exemplar.sequence_transfer(**options), {"FINISHED"})
        return bpy.context.view_layer.objects.active

    def test_matched_poses_come_out_as_each_other(self):
        owner = self.capture()
        other = self.other()
        made = self.transferred(owner, other)
        keys = self.source.data.shape_keys.key_blocks
        frames = frames_of(owner, RANGE)
        for frame, seen in zip(RANGE, frames_of(made, RANGE)):
            self.scene.frame_set(frame)
            expected = support.key(other, "Basis").astype(float)
            for name in ("Bend", "Back", "Fat"):
                value = keys[name].value
                expected += value * (support.key(other, name) - support.key(other, "Basis"))
            self.assertClose(seen, expected, 5e-4)
        self.assertClose(frames_of(owner, RANGE), frames, 0)
        self.assertTrue(other.hide_get())

    def test_in_deformation_gradients(self):
        """Where a frame is one of the matched poses, it comes out as the other's."""
        obj = make_animated()
        blocks = obj.data.shape_keys.key_blocks
        obj.data.shape_keys.animation_data_clear()
        for frame, values in enumerate(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)), start=FIRST):
            for name, value in zip(("Bend", "Back", "Fat"), values):
                blocks[name].value = value
                blocks[name].keyframe_insert("value", frame=frame)
        self.scene.frame_end = 4
        owner = self.capture(obj, shape_space="GRADIENTS")
        other = self.other()
        made = self.transferred(owner, other, shape_space="GRADIENTS")
        for seen, name in zip(frames_of(made, range(1, 5)), ("Basis", "Bend", "Back", "Fat")):
            self.assertClose(seen, support.key(other, name), 5e-3, name)

    def test_edits_and_time_go_along(self):
        owner = self.capture()
        move(owner.exemplar_sequence.curve, [6], (0.1, 0.0))
        curve = retiming.curve_of(owner)
        curve.keyframe_points[1].co.y = 8
        curve.update()
        made = self.transferred(owner, self.other())
        self.assertClose(native(made).control_points(), native(owner).control_points(), 1e-12)
        self.scene.frame_set(9)
        self.assertClose(evaluated(made), shape(made, curve.evaluate(9)), 1e-5)

    def test_refusals(self):
        owner = self.capture()
        support.activate(owner)
        chosen = self.scene.exemplar_transfer
        self.assertFalse(bpy.ops.exemplar.sequence_transfer.poll())
        from blender_addon.scene.sequences import transfer

        other = self.other({"Jump": lambda p: p * 2})
        cases = (
            (None, other, "Choose the mesh"),
            (self.source, other, "no shape keys of one name"),
            (other, self.source, "no shape keys of one name"),
        )
        for examples, target, words in cases:
            with self.subTest(words):
                self.assertFails(words, transfer.refuse, owner, examples, target)
        small = bpy.data.meshes.new("Small")
        small.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        small = bpy.data.objects.new("Small", small)
        self.scene.collection.objects.link(small)
        small.shape_key_add(name="Basis")
        self.assertFails("has 3 vertices", transfer.refuse, owner, small, self.other())
        chosen.examples, chosen.target = self.source, other
        self.assertFalse(bpy.ops.exemplar.sequence_transfer.poll())


if __name__ == "__main__":
    support.run(globals())
