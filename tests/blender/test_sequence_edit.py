# SPDX-License-Identifier: GPL-3.0-or-later
"""The pose space: what is edited in the plane shows on the character, and nothing else does."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import bmesh  # noqa: E402
import bpy  # noqa: E402
import numpy  # noqa: E402
from blender_addon.scene import versions  # noqa: E402
from sequence_support import (  # noqa: E402
    FIRST,
    LAST,
    SequenceCase,
    evaluated,
    frames_of,
    move,
    store,
    syncing,
)

RANGE = range(FIRST, LAST + 1)


def points(owner):
    """float32 [k][2] of the polygon's mesh, in its own order."""
    mesh = owner.exemplar_sequence.curve.data
    return numpy.array([vertex.co[:2] for vertex in mesh.vertices], numpy.float32)


def marks(owner):
    mesh = owner.exemplar_sequence.marks.data
    return numpy.array([vertex.co[:2] for vertex in mesh.vertices], numpy.float32)


def pinned(owner):
    layer = owner.exemplar_sequence.marks.data.attributes["exemplar_pinned"]
    return [index for index, item in enumerate(layer.data) if item.value]


def native(owner):
    return store.ensure(owner).sequence


class Curve(SequenceCase):
    def test_the_polygon_is_that_of_the_sequence(self):
        owner = self.capture()
        self.assertClose(points(owner), numpy.float32(native(owner).control_points()), 0)
        self.assertClose(marks(owner), numpy.float32(native(owner).marks()[0]), 0)
        curve = owner.exemplar_sequence.curve
        self.assertEqual(len(curve.data.edges), len(curve.data.vertices) - 1)

    def test_a_moved_point_changes_its_support_and_nothing_else(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        move(owner.exemplar_sequence.curve, [8], (0.08, -0.05))
        after = frames_of(owner, RANGE)
        changed = [not numpy.array_equal(a, b) for a, b in zip(before, after)]
        self.assertTrue(any(changed))
        self.assertLessEqual(sum(changed), 4)
        self.assertFalse(any(changed[:4] + changed[12:]))

    def test_shows_at_once(self):
        owner = self.capture()
        self.scene.frame_set(7)
        before = evaluated(owner)
        move(owner.exemplar_sequence.curve, [7], (0.08, 0.0))
        self.assertFar(evaluated(owner), before, 0.01)
        move(owner.exemplar_sequence.curve, [7], (-0.08, 0.0))
        self.assertClose(evaluated(owner), before, 1e-5)

    def in_edit_mode(self, owner, work):
        """Work on the polygon's edit mesh, as the tools of Edit Mode do."""
        curve = owner.exemplar_sequence.curve
        support.activate(curve)
        bpy.ops.object.mode_set(mode="EDIT")
        edit = bmesh.from_edit_mesh(curve.data)
        edit.verts.ensure_lookup_table()
        edit.edges.ensure_lookup_table()
        work(edit)
        bmesh.update_edit_mesh(curve.data)
        support.update()

    def test_moved_in_edit_mode(self):
        owner = self.capture()
        self.scene.frame_set(7)
        before = evaluated(owner)

        def work(edit):
            edit.verts[7].co.y += 0.1

        self.in_edit_mode(owner, work)
        self.assertFar(evaluated(owner), before, 0.01)
        seen = evaluated(owner)
        bpy.ops.object.mode_set(mode="OBJECT")
        support.update()
        self.assertClose(evaluated(owner), seen, 0)

    def test_subdivide_and_dissolve(self):
        """Points come and go with Blender's own tools; far frames stay to the bit."""
        owner = self.capture()
        before = frames_of(owner, RANGE)
        count = len(points(owner))

        def subdivide(edit):
            bmesh.ops.subdivide_edges(edit, edges=[edit.edges[8]], cuts=2)

        self.in_edit_mode(owner, subdivide)
        self.assertEqual(native(owner).window().control_point_count, count + 2, self.problem(owner))
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertClose(frames_of(owner, [1, 2, 3, 15, 16]), before[[0, 1, 2, 14, 15]], 0)

        def dissolve(edit):
            bmesh.ops.dissolve_verts(edit, verts=[edit.verts[count], edit.verts[count + 1]])

        self.in_edit_mode(owner, dissolve)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual(native(owner).window().control_point_count, count)
        # The same polygon as before: the same animation.
        self.assertClose(frames_of(owner, RANGE), before, 0)

    def test_extended_at_both_ends(self):
        owner = self.capture()
        count = len(points(owner))
        for end in (0, -1):

            def extrude(edit, end=end):
                vertex = edit.verts[(0 if end == 0 else count - 1)]
                found = bmesh.ops.extrude_vert_indiv(edit, verts=[vertex])
                found["verts"][0].co.x += 0.1

            self.in_edit_mode(owner, extrude)
            bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual(self.problem(owner), "")
        found = native(owner).control_points()
        self.assertEqual(len(found), count + 2)
        state = store.peek(owner)
        self.assertClose(numpy.float32(found), state.curve, 0)
        self.assertClose(numpy.float32(found[0] - found[1]), numpy.float32([0.1, 0]), 1e-5)
        self.assertClose(numpy.float32(found[-1] - found[-2]), numpy.float32([0.1, 0]), 1e-5)

    def test_what_is_no_line_is_refused_and_said(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        cases = (
            ("vertex 5 has 3 edges", lambda edit: edit.edges.new((edit.verts[5], edit.verts[9]))),
            ("two ends", lambda edit: edit.edges.remove(edit.edges[6])),
            ("no edge", lambda edit: edit.verts.new((0, 0, 0))),
        )
        for words, work in cases:
            with self.subTest(words):
                kept = owner.exemplar_sequence.curve.data.copy()
                self.in_edit_mode(owner, work)
                self.assertIn(words, self.problem(owner))
                bpy.ops.object.mode_set(mode="OBJECT")
                self.assertClose(frames_of(owner, RANGE), before, 0)
                owner.exemplar_sequence.curve.data = kept
                support.update()
                self.scene.frame_set(3)
                self.assertEqual(self.problem(owner), "")

    def test_too_few_points(self):
        owner = self.capture()

        def work(edit):
            bmesh.ops.delete(edit, geom=edit.verts[3:], context="VERTS")

        self.in_edit_mode(owner, work)
        self.assertIn("3 points; 4 are needed", self.problem(owner))
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_reset_curve(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        move(owner.exemplar_sequence.curve, [3, 7, 11], (0.2, 0.1))
        self.assertFar(frames_of(owner, RANGE), before)
        support.activate(owner)
        bpy.ops.exemplar.sequence_reset_curve()
        self.assertClose(frames_of(owner, RANGE), before, 1e-5)

    def test_deleted_parts(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        bpy.data.objects.remove(owner.exemplar_sequence.curve)
        support.update()
        self.assertClose(frames_of(owner, RANGE), before, 0)
        self.assertIn("was deleted", self.problem(owner))
        support.activate(owner)
        bpy.ops.exemplar.sequence_reset_curve()
        support.update()
        self.assertEqual(self.problem(owner), "")
        self.assertIsNotNone(owner.exemplar_sequence.curve)

    def test_loop(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        support.activate(owner)
        bpy.ops.exemplar.sequence_loop(start=3, end=10, count=1)
        added = native(owner).info.frame_count - len(RANGE)
        self.assertGreaterEqual(added, 7)
        self.assertClose(frames_of(owner, [1, 2, 3]), before[:3], 1e-5)
        later = frames_of(owner, [LAST + added])
        self.assertClose(later, before[[-1]], 1e-4)
        self.assertFails(
            "No loop from 9 to 4", bpy.ops.exemplar.sequence_loop, start=9, end=4, count=1
        )


class Marks(SequenceCase):
    def test_a_moved_mark_is_pinned_and_the_others_relax(self):
        owner = self.capture()
        before = marks(owner)
        move(owner.exemplar_sequence.marks, [5], (0.3, 0.2))
        after = marks(owner)
        self.assertClose(after[5], before[5] + numpy.float32([0.3, 0.2]), 1e-6)
        self.assertEqual(pinned(owner), [5])
        others = [i for i in range(len(after)) if i != 5]
        self.assertFar(after[others], before[others], 1e-4)
        self.assertEqual(self.problem(owner), "")
        self.assertClose(after, numpy.float32(native(owner).marks()[0]), 1e-6)

    def test_frames_are_given_back_wherever_they_are(self):
        owner = self.capture()
        expected = self.captured_frames()
        move(owner.exemplar_sequence.marks, [2, 9], (0.2, -0.3))
        self.assertClose(frames_of(owner, RANGE), expected, 1e-3)

    def test_unpin(self):
        owner = self.capture()
        before = marks(owner)
        move(owner.exemplar_sequence.marks, [5], (0.3, 0.2))
        support.activate(owner)
        bpy.ops.exemplar.sequence_unpin(all=True)
        self.assertEqual(pinned(owner), [])
        self.assertLess(numpy.linalg.norm(marks(owner)[5] - before[5]), 0.5 * numpy.hypot(0.3, 0.2))

    def test_pin_the_selected(self):
        owner = self.capture()
        data = owner.exemplar_sequence.marks.data
        support.activate(owner)
        for vertex in data.vertices:
            vertex.select = vertex.index in (1, 2)
        bpy.ops.exemplar.sequence_pin()
        self.assertEqual(pinned(owner), [1, 2])
        for vertex in data.vertices:
            vertex.select = False
        self.assertFails("No marks are selected", bpy.ops.exemplar.sequence_pin)

    def test_edits_of_the_curve_stay(self):
        owner = self.capture()
        fitted = points(owner)
        move(owner.exemplar_sequence.curve, [6], (0.1, 0.0))
        move(owner.exemplar_sequence.marks, [12], (0.05, 0.0))
        state = store.peek(owner)
        added = numpy.float32(native(owner).control_points()) - syncing.fitted_points(owner, state)
        self.assertClose(added[6], numpy.array([0.1, 0.0]), 1e-5)
        self.assertClose(numpy.delete(added, 6, 0), numpy.zeros((len(fitted) - 1, 2)), 1e-5)

    def test_coinciding_pins(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        places = marks(owner)
        mesh = owner.exemplar_sequence.marks.data
        for index in (3, 4):
            mesh.vertices[index].co = (9.0, 9.0, 0.0)
        mesh.update()
        support.update()
        self.assertIn("cannot be placed", self.problem(owner))
        self.assertClose(frames_of(owner, RANGE), before, 0)
        for index in (3, 4):
            mesh.vertices[index].co = (*places[index], 0.0)
        mesh.update()
        support.update()
        self.assertEqual(self.problem(owner), "")

    def test_deleted_marks(self):
        owner = self.capture()
        before = frames_of(owner, RANGE)
        mesh = owner.exemplar_sequence.marks.data
        edit = bmesh.new()
        edit.from_mesh(mesh)
        edit.verts.ensure_lookup_table()
        edit.verts.remove(edit.verts[4])
        edit.to_mesh(mesh)
        edit.free()
        mesh.update()
        support.update()
        self.assertIn("15 marks for 16 frames", self.problem(owner))
        self.assertClose(frames_of(owner, RANGE), before, 0)


class Playhead(SequenceCase):
    def test_poses_the_character(self):
        owner = self.capture()
        data = owner.exemplar_sequence
        data.follow = "PLAYHEAD"
        for point in ((0.1, 0.05), (-0.2, 0.1), (0.0, 0.0)):
            data.playhead.location = (*point, 0)
            support.update()
            self.assertClose(evaluated(owner), native(owner).pose(point), 1e-5)

    def test_the_plane_may_be_anywhere(self):
        owner = self.capture()
        data = owner.exemplar_sequence
        data.follow = "PLAYHEAD"
        data.playhead.location = (0.1, 0.05, 0.0)
        support.update()
        seen = evaluated(owner)
        data.plane.rotation_euler = (1.2, 0.3, -0.8)
        data.plane.location = (4, 5, 6)
        support.update()
        self.assertClose(evaluated(owner), seen, 1e-4)

    def test_keyframes_renders_and_subframes(self):
        owner = self.capture()
        data = owner.exemplar_sequence
        data.follow = "PLAYHEAD"
        for frame, x in ((1, -0.2), (10, 0.3)):
            data.playhead.location.x = x
            data.playhead.keyframe_insert("location", index=0, frame=frame)
        for part in (data.plane, data.playhead):
            part.hide_viewport = True
        curve = versions.find_curves(data.playhead)[0]
        for frame, sub in ((3, 0.0), (7, 0.25), (7, 0.75), (2, 0.5)):
            self.scene.frame_set(frame, subframe=sub)
            point = (curve.evaluate(frame + sub), data.playhead.location.y)
            self.assertClose(evaluated(owner), native(owner).pose(point), 1e-5)

    def test_to_time(self):
        owner = self.capture()
        self.scene.frame_set(6)
        seen = evaluated(owner)
        support.activate(owner)
        bpy.ops.exemplar.sequence_playhead_to_time()
        owner.exemplar_sequence.follow = "PLAYHEAD"
        support.update()
        self.assertClose(evaluated(owner), seen, 1e-4)


if __name__ == "__main__":
    support.run(globals())
