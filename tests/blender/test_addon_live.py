# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh follows its handles, whatever moves them; and what is shown depends on nothing else."""

import os
import sys
import tempfile
import time
from unittest import mock

import bpy
import numpy
from mathutils import Matrix

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings, level  # noqa: E402
from blender_addon.scene import live, rigs, status  # noqa: E402


class Follows(SceneCase):
    def setUp(self):
        super().setUp()
        self.bar, self.empties = support.make_rig()
        self.top = self.empties[2]
        self.rest = support.bar_positions()

    def check_top(self, place):
        """The vertices of the top handle are at `place`, and what is shown was solved for it."""
        shown = support.visible(self.bar)
        self.assertClose(shown[level(12)].mean(axis=0), place, 1e-4)
        self.assertClose(shown, support.solved(self.bar), 1e-5)
        self.assertEqual(support.problem(self.bar), "")

    def test_hand(self):
        self.top.location = (0.9, 0.1, 2.0)
        support.update()
        self.check_top((0.9, 0.1, 2.0))

    def test_keyframes(self):
        self.top.keyframe_insert("location", frame=1)
        self.top.location = (0.9, 0.1, 2.0)
        self.top.keyframe_insert("location", frame=11)
        for frame in (11, 1, 6):
            self.scene.frame_set(frame)
            self.check_top(self.top.matrix_world.translation)

    def test_constraint(self):
        guide = self._guide()
        constraint = self.top.constraints.new("COPY_LOCATION")
        constraint.target = guide
        guide.location = (0.5, 0.5, 2.2)
        support.update()
        self.check_top((0.5, 0.5, 2.2))

    def test_parent(self):
        guide = self._guide()
        self.top.parent = guide
        guide.location = (0.5, 0.0, 0.0)
        support.update()
        self.check_top((0.5, 0, support.HEIGHT))

    def test_parent_bone(self):
        armature = bpy.data.armatures.new("Arm")
        rig = bpy.data.objects.new("Arm", armature)
        self.scene.collection.objects.link(rig)
        support.activate(rig)
        bpy.ops.object.mode_set(mode="EDIT")
        bone = armature.edit_bones.new("Bone")
        bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.top.parent, self.top.parent_type, self.top.parent_bone = rig, "BONE", "Bone"
        rig.pose.bones["Bone"].location = (0.3, 0, 0)
        support.update()
        self.check_top(self.top.matrix_world.translation)

    def test_driver(self):
        guide = self._guide()
        driver = self.top.driver_add("location", 0).driver
        driver.type = "SUM"
        variable = driver.variables.new()
        variable.targets[0].id = guide
        variable.targets[0].data_path = "location.y"
        guide.location.y = 0.7
        support.update()
        self.check_top((0.7, 0, support.HEIGHT))

    def test_parented_to_the_mesh_itself(self):
        for empty in self.empties:
            empty.parent = self.bar
        self.bar.location = (3, 2, 1)
        support.update()
        self.assertClose(support.visible(self.bar), self.rest, 1e-4)

    def test_oriented(self):
        self.bar.exemplar.handles[2].kind = "ORIENTED"
        bpy.ops.exemplar.rebind()
        self.top.rotation_euler.x = 0.9
        support.update()
        turned = self._top_turn()
        self.assertGreater(turned, 0.5)

    def test_pinned_takes_no_turn(self):
        before = support.visible(self.bar)
        self.top.rotation_euler.x = 0.9
        support.update()
        self.assertClose(support.visible(self.bar), before, 1e-6)

    def test_free_takes_nothing(self):
        self.bar.exemplar.handles[1].kind = "FREE"
        bpy.ops.exemplar.rebind()
        self.top.location = (0.6, 0, 2.0)
        support.update()
        before = support.visible(self.bar)
        self.empties[1].location.x += 3
        support.update()
        self.assertClose(support.visible(self.bar), before, 1e-6)

    def test_settings(self):
        self.top.location = (0.4, 0.5, 1.5)
        support.update()
        for name, value in (("lambda_", 5.0), ("rotations", False), ("blend", "GLOBAL")):
            before = support.visible(self.bar)
            setattr(self.bar.exemplar.amrap, name, value)
            support.update()
            self.assertFar(support.visible(self.bar), before, 1e-5)
            self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-5)

    def test_settings_can_be_animated(self):
        self.top.location = (0.4, 0.5, 1.5)
        self.bar.exemplar.amrap.keyframe_insert("lambda_", frame=1)
        self.bar.exemplar.amrap.lambda_ = 8.0
        self.bar.exemplar.amrap.keyframe_insert("lambda_", frame=10)
        shown = {}
        for frame in (1, 10, 1):
            self.scene.frame_set(frame)
            before = shown.setdefault(frame, support.visible(self.bar))
            self.assertClose(support.visible(self.bar), before, 0)
        self.assertFar(shown[1], shown[10], 1e-5)

    def test_hidden_empties_move_all_the_same(self):
        self.top.keyframe_insert("location", frame=1)
        self.top.location = (0.9, 0.1, 2.0)
        self.top.keyframe_insert("location", frame=11)
        collection = bpy.data.collections.new("Controls")
        self.scene.collection.children.link(collection)

        def leave_collection():
            collection.objects.link(self.top)
            self.scene.collection.objects.unlink(self.top)
            bpy.context.view_layer.layer_collection.children["Controls"].exclude = True

        hide = (
            lambda: self.top.hide_set(True),
            lambda: setattr(self.top, "hide_render", True),
            lambda: setattr(self.top, "hide_viewport", True),
            leave_collection,
        )
        for step, function in enumerate(hide):
            function()
            for frame in (1, 11, 6):
                self.scene.frame_set(frame)
                z = self.top.evaluated_get(support.depsgraph()).matrix_world.translation
                self.check_top(z)
            self.assertFar(z, (0, 0, support.HEIGHT), 0.1)

    def test_many_handles(self):
        bar = support.make_bar("Many")
        for index in range(support.RINGS):
            support.add_handle(bar, level(index))
        bpy.ops.exemplar.bind()
        bar.exemplar.handles[12].empty.location.x = 0.5
        support.update()
        self.assertClose(support.visible(bar)[level(12)].mean(axis=0)[0], 0.5, 1e-4)

    def _guide(self):
        guide = bpy.data.objects.new("Guide", None)
        self.scene.collection.objects.link(guide)
        return guide

    def _top_turn(self):
        """How steep the top ring stands, radians."""
        ring = support.visible(self.bar)[level(12)]
        normal = numpy.linalg.svd(ring - ring.mean(axis=0))[2][2]
        return numpy.arccos(min(1, abs(normal[2])))


class Economy(SceneCase):
    def test_nothing_is_solved_when_nothing_moved(self):
        bar, empties = support.make_rig()
        other = bpy.data.objects.new("Other", None)
        self.scene.collection.objects.link(other)
        support.update()
        before = support.solves(bar)
        for step in range(5):
            other.location.x = step
            support.update()
            self.scene.frame_set(step)
            bpy.context.view_layer.objects.active = other
            support.update()
        self.assertEqual(support.solves(bar), before)

    def test_one_move_is_one_solve(self):
        bar, empties = support.make_rig()
        support.update()
        before = support.solves(bar)
        for step in range(5):
            empties[2].location.x = 0.1 * step + 0.1
            support.update()
            support.update()
        self.assertEqual(support.solves(bar), before + 5)

    def test_only_the_object_whose_handle_moved(self):
        first, _ = support.make_rig("First")
        second, empties = support.make_rig("Second")
        support.update()
        before = support.solves(first), support.solves(second)
        empties[2].location.x = 0.4
        support.update()
        self.assertEqual(
            (support.solves(first), support.solves(second)), (before[0], before[1] + 1)
        )

    def test_live_off(self):
        bar, empties = support.make_rig()
        bar.exemplar.live = False
        support.update()
        before = support.visible(bar)
        empties[2].location = (0.8, 0, 2.0)
        support.update()
        self.scene.frame_set(5)
        self.assertClose(support.visible(bar), before, 0)
        support.activate(bar)
        bpy.ops.exemplar.update()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)
        empties[2].location = (0.2, 0, 2.3)
        bar.exemplar.live = True
        support.update()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)


class Stateless(SceneCase):
    """What frame N shows does not depend on where one came from."""

    def setUp(self):
        super().setUp()
        self.bar, self.empties = support.make_rig(kinds=("PINNED", "ORIENTED", "PINNED"))
        for frame, place, turn in (
            (1, (0, 0, 2.4), 0),
            (5, (0.9, 0.3, 1.9), 1),
            (9, (1.3, -0.6, 1), 3),
        ):
            self.empties[2].location = place
            self.empties[2].keyframe_insert("location", frame=frame)
            self.empties[1].rotation_euler.y = 0.4 * turn
            self.empties[1].keyframe_insert("rotation_euler", frame=frame)

    def at(self, frame):
        self.scene.frame_set(int(frame), subframe=frame % 1)
        return support.visible(self.bar)

    def test_order_of_frames(self):
        forward = {frame: self.at(frame) for frame in range(1, 10)}
        for frame in (9, 2, 7, 1, 5, 3, 8, 4, 6):
            self.assertTrue(numpy.array_equal(self.at(frame), forward[frame]), frame)

    def test_subframes_out_of_order(self):
        whole = {f: self.at(f) for f in (4.0, 4.25, 4.5, 4.75, 5.0, 5.25)}
        for f in (5.0, 4.75, 5.25, 4.25, 5.0, 4.5):
            self.assertTrue(numpy.array_equal(self.at(f), whole[f]), f)
        self.assertFar(whole[4.25], whole[4.5], 1e-4)

    def test_solve_agrees_with_what_is_shown(self):
        for frame in (3, 8, 5):
            self.assertClose(self.at(frame), support.solved(self.bar), 1e-5)

    def test_after_warm_solves(self):
        expected = self.at(6)
        self.at(2)
        for step in range(5):
            support.solving.solve(self.bar, stateless=False)
        self.assertTrue(numpy.array_equal(self.at(6), expected))

    def test_render_shows_the_frames_of_the_viewport(self):
        """The handlers of a render see its frames; its own evaluated mesh is what is looked at."""
        seen = {}

        def look(scene, depsgraph=None):
            seen[scene.frame_current] = support.key(self.bar, "Exemplar Result")

        expected = {}
        for frame in (3, 7):
            self.at(frame)
            expected[frame] = support.key(self.bar, "Exemplar Result")
        support.small_render(self.scene)
        self.scene.frame_start, self.scene.frame_end, self.scene.frame_step = 3, 7, 4
        for empty in self.empties:
            empty.hide_render = True
        bpy.app.handlers.render_post.append(look)
        self.addCleanup(bpy.app.handlers.render_post.remove, look)
        with tempfile.TemporaryDirectory() as folder:
            self.scene.render.filepath = os.path.join(folder, "frame")
            bpy.ops.render.render(animation=True)
        self.assertEqual(sorted(seen), [3, 7])
        for frame in seen:
            self.assertTrue(numpy.array_equal(seen[frame], expected[frame]), frame)

    def test_rendered_picture_is_not_late(self):
        """A picture of frame 9 differs from one of frame 1, and not from one made by itself."""
        support.small_render(self.scene)
        together = self._pictures((1, 9))
        self.at(1)
        alone = self._pictures((9,))
        self.assertTrue(numpy.array_equal(together[9], alone[9]))
        self.assertFalse(numpy.array_equal(together[9], together[1]))

    def test_motion_blur(self):
        """Sub-frames come in any order; a blurred picture does not depend on the one before."""
        support.small_render(self.scene)
        sharp = self._pictures((3,))
        self.scene.render.use_motion_blur = True
        together = self._pictures((1, 3))
        self.at(1)
        alone = self._pictures((3,))
        self.assertTrue(numpy.array_equal(together[3], alone[3]))
        self.assertFalse(numpy.array_equal(sharp[3], alone[3]))

    def _pictures(self, frames):
        self.scene.frame_start, self.scene.frame_end = frames[0], frames[-1]
        self.scene.frame_step = max(1, frames[-1] - frames[0])
        with tempfile.TemporaryDirectory() as folder:
            self.scene.render.filepath = os.path.join(folder, "f")
            bpy.ops.render.render(animation=True)
            return {f: self._pixels(os.path.join(folder, f"f{f:04d}.png")) for f in frames}

    def _pixels(self, path):
        image = bpy.data.images.load(path)
        pixels = numpy.array(image.pixels[:])
        bpy.data.images.remove(image)
        return pixels


class Dragging(SceneCase):
    """The interactive half: there is no event loop here, so the tests call the timer."""

    def setUp(self):
        super().setUp()
        self.bar, self.empties = support.make_rig()
        support.update()
        patches = (
            mock.patch.object(live, "is_interactive", lambda: True),
            mock.patch.object(live, "STATELESS_LIMIT", 0.0),
        )
        for patch in patches:
            patch.start()
            self.addCleanup(patch.stop)

    def drag(self):
        for step in range(1, 6):
            self.empties[2].location = (0.2 * step, 0, 2.4 - 0.1 * step)
            support.update()

    def test_a_drag_settles_to_what_renders_give(self):
        self.drag()
        state = bindings.state_of(self.bar)
        self.assertFalse(state.settled)
        ticks = 0
        while live.on_timer() is not None:
            ticks += 1
            time.sleep(0.01)
        self.assertGreater(ticks, 1)
        self.assertTrue(state.settled)
        support.update()
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-6)
        before = support.solves(self.bar)
        self.assertIsNone(live.on_timer())
        support.update()
        self.assertEqual(support.solves(self.bar), before)

    def test_a_frame_change_does_not_show_a_warm_result(self):
        self.drag()
        self.scene.frame_set(self.scene.frame_current)
        self.assertTrue(bindings.state_of(self.bar).settled)
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-6)

    def test_a_saved_file_holds_the_settled_result(self):
        self.drag()
        with tempfile.TemporaryDirectory() as folder:
            bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "a.blend"))
        self.assertTrue(bindings.state_of(self.bar).settled)
        self.assertClose(support.key(self.bar, "Exemplar Result"), support.solved(self.bar), 1e-6)

    def test_quick_meshes_are_stateless_all_along(self):
        with mock.patch.object(live, "STATELESS_LIMIT", 10.0):
            self.drag()
        self.assertTrue(bindings.state_of(self.bar).settled)

    def test_an_edit_is_noticed_when_the_hand_is_still(self):
        self.bar.data.shape_keys.key_blocks["Fat"].data[5].co.x += 0.1
        self.bar.data.update()
        support.update()
        self.assertEqual(support.problem(self.bar), "")
        while live.on_timer() is not None:
            time.sleep(0.01)
        self.assertIn("'Fat' was edited since Bind", support.problem(self.bar))


class Several(SceneCase):
    def test_two_objects(self):
        first, first_empties = support.make_rig("First")
        second, second_empties = support.make_rig("Second", Matrix.Translation((3, 0, 0)))
        first_empties[2].location = (0.6, 0, 2.1)
        second_empties[2].location = (3.0, 0.5, 1.9)
        support.update()
        for obj in (first, second):
            self.assertClose(support.visible(obj), support.solved(obj), 1e-5)
        self.assertNotEqual(first.exemplar.uuid, second.exemplar.uuid)

    def test_two_scenes(self):
        here, here_empties = support.make_rig("Here")
        scene = bpy.data.scenes.new("There")
        bpy.context.window.scene = scene
        there, there_empties = support.make_rig("There")
        there_empties[2].keyframe_insert("location", frame=1)
        there_empties[2].location = (0.8, 0, 2.0)
        there_empties[2].keyframe_insert("location", frame=10)
        before = support.solves(here)
        scene.frame_set(10)
        self.assertClose(support.visible(there)[level(12)].mean(axis=0), (0.8, 0, 2.0), 1e-4)
        self.assertEqual(support.solves(here), before)
        bpy.context.window.scene = self.scene
        here_empties[2].location = (0.3, 0, 2.3)
        support.update()
        self.assertClose(support.visible(here), support.solved(here), 1e-5)

    def test_one_object_in_two_scenes_that_are_on_different_frames(self):
        bar, empties = support.make_rig()
        empties[2].keyframe_insert("location", frame=1)
        empties[2].location = (0.8, 0, 2.0)
        empties[2].keyframe_insert("location", frame=10)
        other = bpy.data.scenes.new("Other")
        for obj in (bar, *empties):
            other.collection.objects.link(obj)
        layers = [self.scene.view_layers[0], other.view_layers[0]]
        self.scene.frame_set(1)
        other.frame_set(10)
        before = support.solves(bar)
        for _ in range(5):
            for layer in layers:
                layer.update()
        # Either may have been asked for once more; for ever is what must not happen.
        self.assertLessEqual(support.solves(bar) - before, 2)
        self.scene.frame_set(1)
        shown = support.key(bar, "Exemplar Result")
        self.assertClose(shown[level(12)].mean(axis=0), (0, 0, support.HEIGHT), 1e-4)
        other.frame_set(10)
        shown = support.key(bar, "Exemplar Result")
        self.assertClose(shown[level(12)].mean(axis=0), (0.8, 0, 2.0), 1e-4)


class Disturbed(SceneCase):
    """Things that happen to a bound object."""

    def setUp(self):
        super().setUp()
        self.bar, self.empties = support.make_rig()
        self.empties[2].location = (0.6, 0, 2.1)
        support.update()

    def follows(self):
        self.empties[0].location.y += 0.05
        support.update()
        self.assertEqual(support.problem(self.bar), "")
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-5)

    def freezes(self, part):
        before = support.key(self.bar, "Exemplar Result")
        self.empties[0].location.y += 0.05
        support.update()
        self.assertIn(part, support.problem(self.bar))
        self.assertTrue(any(part in line.text for line in status.describe(self.bar)))
        after = support.key(self.bar, "Exemplar Result")
        self.assertTrue(numpy.array_equal(after[: len(before)], before[: len(after)]))
        self.assertFails(part, support.solved, self.bar)

    def test_empty_renamed(self):
        self.empties[2].name = "Crown"
        self.follows()

    def test_object_renamed(self):
        state = bindings.state_of(self.bar)
        self.bar.name = "Pole"
        self.follows()
        self.assertIs(bindings.state_of(self.bar), state)

    def test_empty_deleted(self):
        support.activate(self.empties[2])
        bpy.ops.object.delete()
        self.freezes("The empty of handle 'Handle.003' was deleted")
        support.activate(self.bar)
        self.bar.exemplar.handle_index = 2
        bpy.ops.exemplar.handle_remove()
        self.freezes("A handle was removed since Bind")
        bpy.ops.exemplar.rebind()
        self.follows()

    def test_empty_removed_from_the_file(self):
        bpy.data.objects.remove(self.empties[2])
        self.freezes("was deleted")

    def test_one_deleted_empty_does_not_stop_other_objects(self):
        second, empties = support.make_rig("Zylinder")
        bpy.data.objects.remove(self.empties[2])
        empties[2].location = (0.5, 0, 2.2)
        support.update()
        self.assertClose(support.visible(second), support.solved(second), 1e-5)

    def test_vertex_added(self):
        import bmesh

        bpy.context.view_layer.objects.active = self.bar
        bpy.ops.object.mode_set(mode="EDIT")
        edited = bmesh.from_edit_mesh(self.bar.data)
        edited.verts.new((1, 1, 1))
        bmesh.update_edit_mesh(self.bar.data)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.freezes("The mesh had 104 vertices at Bind and has 105 now")

    def test_faces_changed_count_equal(self):
        import bmesh

        bpy.context.view_layer.objects.active = self.bar
        bpy.ops.object.mode_set(mode="EDIT")
        edited = bmesh.from_edit_mesh(self.bar.data)
        edited.faces.ensure_lookup_table()
        bmesh.ops.delete(edited, geom=[edited.faces[40]], context="FACES_ONLY")
        bmesh.update_edit_mesh(self.bar.data)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.freezes("faces of the mesh were changed since Bind")
        bpy.ops.exemplar.rebind()
        self.follows()

    def test_exemplar_edited_in_edit_mode(self):
        support.activate(self.bar)
        self.bar.active_shape_key_index = 2
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(0.1, 0, 0))
        bpy.ops.object.mode_set(mode="OBJECT")
        self.freezes("Exemplar 'Fat' was edited since Bind")
        bpy.ops.exemplar.rebind()
        self.follows()

    def test_exemplar_edited_by_a_script(self):
        self.bar.data.shape_keys.key_blocks["Bend"].data[5].co.x += 0.1
        self.bar.data.update()
        self.freezes("Exemplar 'Bend' was edited since Bind")

    def test_edit_that_is_taken_back(self):
        point = self.bar.data.shape_keys.key_blocks["Bend"].data[5]
        before = point.co.copy()
        point.co.x += 0.1
        self.bar.data.update()
        self.freezes("was edited")
        self.bar.data.shape_keys.key_blocks["Bend"].data[5].co = before
        self.bar.data.update()
        self.follows()

    def test_exemplar_renamed(self):
        self.bar.data.shape_keys.key_blocks["Bend"].name = "Bow"
        self.follows()
        bindings.clear()
        self.follows()
        bpy.ops.exemplar.pose_to_exemplar(name="Bow")

    def test_exemplar_removed(self):
        self.bar.shape_key_remove(self.bar.data.shape_keys.key_blocks["Bend"])
        self.bar.data.update()
        self.freezes("Exemplar 'Bend' was removed since Bind")

    def test_handle_vertices_changed(self):
        self.bar.vertex_groups["Handle.002"].remove(level(6)[:2])
        self.bar.data.update()
        self.freezes("The vertices of handle 'Handle.002' changed since Bind")

    def test_edit_mode_pauses(self):
        support.activate(self.bar)
        before = support.solves(self.bar)
        bpy.ops.object.mode_set(mode="EDIT")
        self.empties[0].location.y += 0.05
        support.update()
        self.scene.frame_set(4)
        self.assertEqual(support.solves(self.bar), before)
        self.assertIn("Paused in Edit Mode", status.describe(self.bar)[0].text)
        self.assertFails("Edit Mode", support.solved, self.bar)
        bpy.ops.object.mode_set(mode="OBJECT")
        support.update()
        self.assertEqual(support.problem(self.bar), "")
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-5)

    def test_edit_of_the_result_key_is_overwritten(self):
        support.activate(self.bar)
        self.bar.active_shape_key_index = 3
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(0.1, 0, 0))
        bpy.ops.object.mode_set(mode="OBJECT")
        support.update()
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-5)

    def test_sculpt_mode_pauses(self):
        support.activate(self.bar)
        before = support.solves(self.bar)
        bpy.ops.object.mode_set(mode="SCULPT")
        self.empties[0].location.y += 0.05
        support.update()
        self.assertEqual(support.solves(self.bar), before)
        bpy.ops.object.mode_set(mode="OBJECT")
        self.follows()

    def test_object_deleted(self):
        bpy.data.objects.remove(self.bar)
        self.empties[0].location.y += 0.05
        support.update()
        self.assertEqual(rigs.bound_rigs(), [])

    def test_scene_deleted(self):
        bpy.data.scenes.new("Left")
        bpy.data.scenes.remove(self.scene)
        support.update()


class Copies(SceneCase):
    def setUp(self):
        super().setUp()
        self.bar, self.empties = support.make_rig()
        self.empties[2].location = (0.6, 0, 2.1)
        support.update()

    def test_copy_with_a_mesh_of_its_own(self):
        support.activate(self.bar)
        bpy.ops.object.duplicate()
        copy = bpy.context.object
        copy.location.x = 1
        support.update()
        self.empties[2].location = (0.7, 0.1, 2.0)
        support.update()
        self.assertNotEqual(copy.exemplar.uuid, self.bar.exemplar.uuid)
        for obj in (self.bar, copy):
            self.assertEqual(support.problem(obj), "")
            self.assertClose(support.visible(obj), support.solved(obj), 1e-5)
        # In the world both are where the handles are.
        expected = support.visible(self.bar) - numpy.array([1, 0, 0])
        self.assertClose(support.visible(copy), expected, 1e-4)

    def test_copy_with_its_handles(self):
        for obj in (self.bar, *self.empties):
            obj.select_set(True)
        bpy.context.view_layer.objects.active = self.bar
        bpy.ops.object.duplicate()
        copy = bpy.context.object
        mine = {item.empty for item in copy.exemplar.handles}
        self.assertFalse(mine.intersection(self.empties))
        before = support.visible(self.bar)
        copy.exemplar.handles[2].empty.location = (0.1, 0.7, 2.0)
        support.update()
        self.assertClose(support.visible(self.bar), before, 1e-6)
        self.assertFar(support.visible(copy), before)

    def test_copy_that_shares_the_mesh(self):
        support.activate(self.bar)
        bpy.ops.object.duplicate(linked=True)
        copy = bpy.context.object
        copy.location.x = 1
        support.update()
        self.empties[2].location = (0.7, 0.1, 2.0)
        support.update()
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-5)
        self.assertIn("has the same mesh as 'Bar'", support.problem(copy))
        before = support.solves(self.bar)
        for _ in range(5):
            support.update()
        self.assertEqual(support.solves(self.bar), before)
        copy.exemplar.target = "OBJECT"
        support.activate(copy)
        bpy.ops.exemplar.rebind()
        self.assertEqual(support.problem(copy), "")
        self.assertClose(support.visible(copy), support.solved(copy), 1e-5)
        self.assertClose(support.visible(self.bar), support.solved(self.bar), 1e-5)

    def test_copy_of_an_object_with_a_separate_result(self):
        self.bar.exemplar.target = "OBJECT"
        support.activate(self.bar)
        bpy.ops.exemplar.rebind()
        support.activate(self.bar)
        bpy.ops.object.duplicate()
        copy = bpy.context.object
        support.update()
        self.assertIn("is a copy of 'Bar'", support.problem(copy))
        support.activate(copy)
        bpy.ops.exemplar.rebind()
        self.assertNotEqual(copy.exemplar.result_object, self.bar.exemplar.result_object)
        self.assertClose(support.visible(copy), support.solved(copy), 1e-5)


if __name__ == "__main__":
    support.run(globals())
