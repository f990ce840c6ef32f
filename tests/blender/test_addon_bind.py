# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles, bind, rebind, unbind, and everything that can be wrong with what they are given."""

import os
import sys

import bpy
import numpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings, level  # noqa: E402
from blender_addon.scene import handles, meshes, setup, status  # noqa: E402


class Handles(SceneCase):
    def test_add_in_edit_mode(self):
        bar = support.make_bar(matrix=support.AWKWARD)
        support.activate(bar)
        support.select(bar, level(12))
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.exemplar.handle_add()
        bpy.ops.object.mode_set(mode="OBJECT")
        item = bar.exemplar.handles[0]
        self.assertEqual(item.empty.name, "Handle.001")
        members = meshes.group_members(bar, {item.group})[item.group]
        self.assertEqual(members.tolist(), level(12))
        centre = bar.matrix_world @ Vector(support.bar_positions()[level(12)].mean(axis=0))
        self.assertClose(item.empty.matrix_world.translation, centre)
        self.assertEqual(item.empty.users_collection, bar.users_collection)

    def test_add_stands_at_the_basis_whatever_key_is_edited(self):
        bar = support.make_bar()
        support.activate(bar)
        bar.active_shape_key_index = 1
        support.select(bar, level(12))
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.exemplar.handle_add()
        bpy.ops.object.mode_set(mode="OBJECT")
        centre = support.bar_positions()[level(12)].mean(axis=0)
        self.assertClose(bar.exemplar.handles[0].empty.location, centre)

    def test_add_takes_the_parent_of_the_mesh(self):
        root = bpy.data.objects.new("Root", None)
        self.scene.collection.objects.link(root)
        root.matrix_world = support.AWKWARD
        bar = support.make_bar()
        bar.parent = root
        support.update()
        empty = support.add_handle(bar, level(0))
        support.update()
        self.assertEqual(empty.parent, root)
        centre = Vector(support.bar_positions()[level(0)].mean(axis=0))
        self.assertClose(empty.matrix_world.translation, bar.matrix_world @ centre)

    def test_add_nothing_selected(self):
        bar = support.make_bar()
        support.activate(bar)
        support.select(bar, [])
        self.assertFails("No vertices are selected", bpy.ops.exemplar.handle_add)
        self.assertEqual(len(bar.exemplar.handles), 0)

    def test_add_vertices_that_another_has(self):
        bar = support.make_bar()
        support.add_handle(bar, level(0))
        self.assertFails(
            "already in handle 'Handle.001'", support.add_handle, bar, level(0)[:3] + level(1)
        )
        self.assertEqual(len(bar.exemplar.handles), 1)
        self.assertEqual(len(bar.vertex_groups), 1)

    def test_remove(self):
        bar, empties = support.make_rig(bind=False)
        bar.exemplar.handle_index = 1
        bpy.ops.exemplar.handle_remove()
        self.assertEqual([h.empty for h in bar.exemplar.handles], [empties[0], empties[2]])
        self.assertNotIn("Handle.002", bpy.data.objects)
        self.assertNotIn("Handle.002", bar.vertex_groups)

    def test_remove_from_the_empty_itself(self):
        bar, empties = support.make_rig(bind=False)
        support.activate(empties[2])
        bar.exemplar.handle_index = 2
        bpy.ops.exemplar.handle_remove()
        self.assertEqual(bpy.context.view_layer.objects.active, bar)

    def test_select(self):
        bar, empties = support.make_rig(bind=False)
        bar.exemplar.handle_index = 1
        bpy.ops.exemplar.handle_select()
        self.assertEqual(bpy.context.view_layer.objects.active, empties[1])
        self.assertEqual(bpy.context.selected_objects, [empties[1]])

    def test_kind_of_selected_empties(self):
        bar, empties = support.make_rig(bind=False)
        support.activate(empties[0])
        empties[2].select_set(True)
        bpy.ops.exemplar.handle_kind(kind="ORIENTED")
        kinds = [item.kind for item in bar.exemplar.handles]
        self.assertEqual(kinds, ["ORIENTED", "PINNED", "ORIENTED"])
        self.assertEqual(empties[0].empty_display_type, "ARROWS")

    def test_radius_grows_along_the_surface_and_stops_at_others(self):
        bar, _ = support.make_rig(bind=False)
        rest = support.bar_positions()
        items = list(bar.exemplar.handles)
        step = support.HEIGHT / (support.RINGS - 1)
        sets = handles.vertex_sets(bar, items, [1.5 * step, 100.0, 0.0], rest)
        self.assertEqual(sets[0].tolist(), level(0) + level(1))
        self.assertEqual(sets[1].min(), level(2)[0])
        self.assertEqual(sets[1].max(), level(11)[-1])
        self.assertEqual(sets[2].tolist(), level(12))

    def test_vertex_group_renamed(self):
        bar, _ = support.make_rig(bind=False)
        bar.vertex_groups["Handle.002"].name = "Waist"
        bpy.ops.exemplar.bind()
        self.assertEqual(bar.exemplar.handles[1].group, "Waist")


class Bind(SceneCase):
    def test_bind_leaves_the_artists_keys_alone(self):
        bar, empties = support.make_rig(bind=False)
        before = support.artists_keys(bar)
        bpy.ops.exemplar.bind()
        empties[2].location.x += 0.5
        support.update()
        self.assertEqual(support.artists_keys(bar), before)
        self.assertTrue(bar.exemplar.bound)
        self.assertTrue(self.scene.render.use_lock_interface)

    def test_bind_at_rest_shows_the_rest(self):
        bar, _ = support.make_rig(matrix=support.AWKWARD)
        self.assertClose(support.visible(bar), support.bar_positions(), 1e-4)

    def test_bind_puts_empties_at_their_vertices(self):
        bar, empties = support.make_rig(matrix=support.AWKWARD, bind=False)
        empties[1].location.x += 5
        bpy.ops.exemplar.bind()
        support.update()
        centre = Vector(support.bar_positions()[level(6)].mean(axis=0))
        self.assertClose(empties[1].matrix_world.translation, bar.matrix_world @ centre)

    def test_bind_leaves_animated_empties_to_their_animation(self):
        bar, empties = support.make_rig(bind=False)
        empties[1].location.x = 5
        empties[1].keyframe_insert("location", frame=1)
        bpy.ops.exemplar.bind()
        self.assertEqual(empties[1].location.x, 5)

    def test_rebind_keeps_the_pose_and_puts_new_handles_into_it(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.8, 0, 2.0)
        support.update()
        posed = support.visible(bar)
        place = empties[2].location.copy()
        new = support.add_handle(bar, level(9))
        bpy.ops.exemplar.rebind()
        self.assertClose(empties[2].location, place)
        self.assertClose(new.location, posed[level(9)].mean(axis=0), 1e-4)
        self.assertEqual(bindings.state_of(bar).deformer.info.handle_count, 4)
        self.assertEqual(
            [k.name for k in bar.data.shape_keys.key_blocks],
            ["Basis", "Bend", "Fat", "Exemplar Result"],
        )

    def test_unbind_gives_back_what_was(self):
        bar, empties = support.make_rig(bind=False)
        before = support.artists_keys(bar)
        bar.active_shape_key_index = 2
        bpy.ops.exemplar.bind()
        self.assertEqual(bar.active_shape_key_index, 2)
        bpy.ops.exemplar.unbind()
        self.assertEqual(support.artists_keys(bar), before)
        self.assertEqual(list(bar.data.shape_keys.key_blocks.keys()), ["Basis", "Bend", "Fat"])
        self.assertEqual(bar.active_shape_key_index, 2)
        self.assertEqual([h.empty for h in bar.exemplar.handles], empties)
        self.assertIsNone(bar.animation_data)
        self.assertEqual(bindings.deformer_count(), 0)
        bpy.ops.exemplar.bind()
        self.assertTrue(bar.exemplar.bound)

    def test_cancel_leaves_everything(self):
        bar, _ = support.make_rig(bind=False)
        gathered = setup.prepare(bar)
        with self.assertRaises(bindings.ExemplarError) as caught:
            bindings.build(gathered, lambda fraction, stage: True)
        self.assertTrue(caught.exception.cancelled)
        self.assertFalse(bar.exemplar.bound)
        self.assertEqual(list(bar.data.shape_keys.key_blocks.keys()), ["Basis", "Bend", "Fat"])

    def test_progress_rises(self):
        bar, _ = support.make_rig(bind=False)
        seen = []
        deformer, _ = bindings.build(setup.prepare(bar), lambda f, stage: seen.append((f, stage)))
        deformer.close()
        fractions = [fraction for fraction, _ in seen]
        self.assertTrue(seen)
        self.assertEqual(fractions, sorted(fractions))
        self.assertTrue(all(0 <= f <= 1 for f in fractions))

    def test_exemplars_that_are_switched_off(self):
        bar, _ = support.make_rig(bind=False)
        bpy.ops.exemplar.exemplar_toggle(name="Fat")
        bpy.ops.exemplar.bind()
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 2)
        bpy.ops.exemplar.exemplar_toggle(name="Fat")
        self.assertIn("exemplars", status.pending(bar))
        bpy.ops.exemplar.rebind()
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 3)
        self.assertEqual(status.pending(bar), "")

    def test_switched_off_exemplar_renamed(self):
        bar, _ = support.make_rig(bind=False)
        bpy.ops.exemplar.exemplar_toggle(name="Fat")
        bar.data.shape_keys.key_blocks["Fat"].name = "Thick"
        bpy.ops.exemplar.bind()
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 2)

    def test_pending_changes_are_named(self):
        bar, _ = support.make_rig()
        bar.exemplar.handles[0].kind = "ORIENTED"
        bar.exemplar.amrap.edge_groups = 4
        bar.exemplar.target = "OBJECT"
        self.assertEqual(status.pending(bar), "handles, regions and place of the result")

    def test_edge_groups(self):
        bar, _ = support.make_rig(bind=False)
        bar.exemplar.amrap.edge_groups = 3
        bpy.ops.exemplar.bind()
        self.assertEqual(bindings.state_of(bar).deformer.info.edge_group_count, 3)


class Transforms(SceneCase):
    """Targets are in the mesh's space, whatever stands between it and the world."""

    def test_every_exemplar_comes_back(self):
        bar, _ = support.make_rig(matrix=support.AWKWARD)
        for name in ("Bend", "Fat", "Basis"):
            bpy.ops.exemplar.pose_to_exemplar(name=name)
            support.update()
            self.assertClose(support.visible(bar), support.key(bar, name), 1e-4, name)

    def test_moving_mesh_and_empties_together_changes_nothing(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.7, 0.1, 2.0)
        support.update()
        posed = support.visible(bar)
        motion = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.7, 4, (1, 2, 3))
        for obj in (bar, *empties):
            obj.matrix_world = motion @ obj.matrix_world
        support.update()
        self.assertClose(support.visible(bar), posed, 1e-4)

    def test_rigid_motion_of_the_empties_moves_the_result(self):
        for kinds in (("PINNED",) * 3, ("ORIENTED",) * 3):
            bar, empties = support.make_rig("-".join(kinds), kinds=kinds)
            motion = Matrix.Translation((0.3, 0.2, 0.1)) @ Matrix.Rotation(0.8, 4, (1, 1, 0))
            for empty in empties:
                empty.matrix_world = motion @ empty.matrix_world
            support.update()
            expected = [motion @ Vector(p) for p in support.bar_positions()]
            self.assertClose(support.visible(bar), expected, 1e-4, str(kinds))

    def test_pinned_handles_are_met(self):
        bar, empties = support.make_rig(matrix=support.AWKWARD)
        empties[2].matrix_world = Matrix.Translation((1.2, -0.5, 2.5))
        support.update()
        local = bar.matrix_world.inverted() @ empties[2].matrix_world.translation
        self.assertClose(support.visible(bar)[level(12)].mean(axis=0), local, 1e-4)

    def test_oriented_handles_start_from_the_turn_they_have_at_bind(self):
        bar, empties = support.make_rig(kinds=("ORIENTED",) * 3, matrix=support.AWKWARD, bind=False)
        empties[1].rotation_euler = (0.4, 0.5, 0.6)
        bpy.ops.exemplar.bind()
        support.update()
        self.assertClose(support.visible(bar), support.bar_positions(), 1e-4)

    def test_reset_pose(self):
        bar, empties = support.make_rig(kinds=("ORIENTED",) * 3, matrix=support.AWKWARD)
        rest = [empty.matrix_world.copy() for empty in empties]
        empties[2].matrix_world = Matrix.Translation((1, 1, 1)) @ Matrix.Rotation(1, 4, "Y")
        support.update()
        self.assertFar(support.visible(bar), support.bar_positions())
        bpy.ops.exemplar.pose_reset()
        support.update()
        for empty, matrix in zip(empties, rest):
            self.assertClose(empty.matrix_world, matrix, 1e-4)
        self.assertClose(support.visible(bar), support.bar_positions(), 1e-4)

    def test_mesh_scaled_to_nothing(self):
        bar, _ = support.make_rig()
        bar.scale = (0, 1, 1)
        support.update()
        self.assertIn("scaled to nothing", support.problem(bar))
        bar.scale = (1, 1, 1)
        support.update()
        self.assertEqual(support.problem(bar), "")


class Results(SceneCase):
    def test_other_keys_are_compensated(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.8, 0, 2.0)
        support.update()
        expected = support.solved(bar)
        keys = bar.data.shape_keys.key_blocks
        keys["Fat"].value = 0.7
        keys["Bend"].value = 0.4
        support.update()
        self.assertClose(support.visible(bar), expected, 1e-5)
        keys["Bend"].mute = True
        support.update()
        self.assertClose(support.visible(bar), expected, 1e-5)
        self.assertAlmostEqual(keys["Fat"].value, 0.7, 6)

    def test_compensation_honours_relative_keys_and_vertex_groups(self):
        bar, empties = support.make_rig()
        half = bar.vertex_groups.new(name="Half")
        half.add(list(range(50)), 0.5, "REPLACE")
        keys = bar.data.shape_keys.key_blocks
        keys["Fat"].relative_key = keys["Bend"]
        keys["Fat"].vertex_group = "Half"
        keys["Fat"].value = 0.9
        empties[2].location = (0.8, 0, 2.0)
        support.update()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)

    def test_compensation_of_driven_and_animated_values(self):
        bar, _ = support.make_rig()
        keys = bar.data.shape_keys.key_blocks
        driver = keys["Fat"].driver_add("value").driver
        driver.expression = "frame / 20"
        keys["Bend"].keyframe_insert("value", frame=1)
        keys["Bend"].value = 1.0
        keys["Bend"].keyframe_insert("value", frame=10)
        for frame in (4, 9, 1):
            self.scene.frame_set(frame)
            self.assertClose(support.visible(bar), support.bar_positions(), 1e-4, str(frame))

    def test_separate_object(self):
        bar, empties = support.make_rig(matrix=support.AWKWARD, bind=False)
        before = support.artists_keys(bar)
        bar.exemplar.target = "OBJECT"
        bpy.ops.exemplar.bind()
        empties[2].matrix_world = Matrix.Translation((1.2, -0.5, 2.5))
        support.update()
        result = bar.exemplar.result_object
        self.assertIsNone(result.data.shape_keys)
        self.assertFalse(result.is_property_set("exemplar") and result.exemplar.bound)
        self.assertEqual(list(bar.data.shape_keys.key_blocks.keys()), ["Basis", "Bend", "Fat"])
        self.assertEqual(support.artists_keys(bar), before)
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)
        self.assertClose(result.matrix_world, bar.matrix_world)
        bar.location.x += 1
        support.update()
        self.assertClose(result.matrix_world, bar.matrix_world)
        self.assertTrue(bar.hide_render)
        bpy.ops.exemplar.unbind()
        self.assertNotIn("Bar Result", bpy.data.objects)
        self.assertNotIn("Bar Result", bpy.data.meshes)
        self.assertFalse(bar.hide_render)
        self.assertEqual(bar.display_type, "TEXTURED")

    def test_panel_knows_the_result_object(self):
        bar, _ = support.make_rig(bind=False)
        bar.exemplar.target = "OBJECT"
        bpy.ops.exemplar.bind()
        support.activate(bar.exemplar.result_object)
        bpy.ops.exemplar.rebind()
        self.assertEqual(support.problem(bar), "")

    def test_change_of_target_at_rebind(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.8, 0, 2.0)
        support.update()
        posed = support.visible(bar)
        for target in ("OBJECT", "KEY"):
            bar.exemplar.target = target
            bpy.ops.exemplar.rebind()
            self.assertClose(support.visible(bar), posed, 1e-5)
        self.assertNotIn("Bar Result", bpy.data.objects)

    def test_mesh_of_two_objects(self):
        bar, _ = support.make_rig(bind=False)
        twin = bpy.data.objects.new("Twin", bar.data)
        self.scene.collection.objects.link(twin)
        self.assertFails("'Twin' has the same mesh", bpy.ops.exemplar.bind)
        self.assertFalse(bar.exemplar.bound)
        bar.exemplar.target = "OBJECT"
        bpy.ops.exemplar.bind()
        self.assertTrue(bar.exemplar.bound)

    def test_absolute_keys(self):
        bar, _ = support.make_rig(bind=False)
        bar.data.shape_keys.use_relative = False
        self.assertFails("absolute", bpy.ops.exemplar.bind)

    def test_result_key_removed(self):
        bar, empties = support.make_rig()
        bar.shape_key_remove(bar.data.shape_keys.key_blocks["Exemplar Result"])
        empties[2].location.x += 0.2
        support.update()
        self.assertIn("was removed since Bind", support.problem(bar))
        bpy.ops.exemplar.rebind()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)

    def test_result_object_removed(self):
        bar, empties = support.make_rig(bind=False)
        bar.exemplar.target = "OBJECT"
        bpy.ops.exemplar.bind()
        support.activate(bar.exemplar.result_object)
        bpy.ops.object.delete()
        empties[2].location.x += 0.2
        support.update()
        self.assertIn("separate object was removed", support.problem(bar))
        support.activate(bar)
        bpy.ops.exemplar.rebind()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)


class BadInput(SceneCase):
    """Each has a sentence of its own, and changes nothing."""

    def refuses(self, bar, part, operator=bpy.ops.exemplar.bind):
        before = (len(bpy.data.objects), bar.exemplar.bound, bar.exemplar.uuid)
        sentence = self.assertFails(part, operator)
        self.assertEqual(before, (len(bpy.data.objects), bar.exemplar.bound, bar.exemplar.uuid))
        return sentence

    def warns(self, bar, part):
        bpy.ops.exemplar.bind()
        sentences = [line.text for line in status.describe(bar)]
        self.assertTrue(any(part in sentence for sentence in sentences), sentences)
        self.assertTrue(len(status.problem_vertices(bar)))

    def test_nothing_selected(self):
        self.assertFails("Select a mesh", bpy.ops.exemplar.bind)

    def test_no_shape_keys(self):
        bar, _ = support.make_rig(poses={}, bind=False)
        self.refuses(bar, "shape keys")
        self.assertFails("has no shape keys", setup.prepare, bar)

    def test_one_exemplar(self):
        bar, _ = support.make_rig(bind=False)
        bpy.ops.exemplar.exemplar_switch_all(enabled=False)
        self.assertFails("No exemplar is switched on", setup.prepare, bar)
        bpy.ops.exemplar.exemplar_toggle(name="Fat")
        self.assertFails("Only one exemplar is switched on", setup.prepare, bar)
        self.refuses(bar, "two or more exemplars")

    def test_no_handles_and_one(self):
        bar = support.make_bar()
        support.activate(bar)
        self.refuses(bar, "Add handles")
        self.assertFails("There are no handles", setup.prepare, bar)
        support.add_handle(bar, level(0))
        self.refuses(bar, "one more handle")
        self.assertFails("There is one handle", setup.prepare, bar)

    def test_no_handle_that_holds(self):
        bar, _ = support.make_rig(kinds=("FREE",) * 3, bind=False)
        self.refuses(bar, "Every handle is free")

    def test_not_a_number(self):
        bar, _ = support.make_rig(bind=False)
        bar.data.shape_keys.key_blocks["Fat"].data[17].co.y = float("nan")
        self.refuses(bar, "'Fat' has coordinates that are not numbers, at vertex 17")
        self.assertEqual(list(status.problem_vertices(bar)), [17])
        bpy.ops.exemplar.select_problem()
        bpy.ops.object.mode_set(mode="OBJECT")
        self.assertEqual([v.index for v in bar.data.vertices if v.select], [17])

    def test_infinite(self):
        bar, _ = support.make_rig(bind=False)
        positions = support.key(bar, "Basis")
        positions[3, 0] = numpy.inf
        support.versions.set_key_positions(bar.data.shape_keys.key_blocks["Basis"], positions)
        self.refuses(bar, "'Basis' has coordinates that are not numbers")

    def test_keys_of_another_size(self):
        bar, _ = support.make_rig(bind=False)
        mesh = bar.data
        mesh.vertices.add(1)
        self.refuses(bar, "has 104 points, the mesh has 105 vertices")

    def test_no_faces(self):
        wire = support.make_mesh("Wire", numpy.eye(3), [], {"Moved": lambda p: p + 1})
        support.add_handle(wire, [0])
        support.add_handle(wire, [1])
        self.refuses(wire, "has no faces")

    def test_loose_parts(self):
        bar, _ = support.make_rig(bind=False)
        self._join_squares(bar, 2)
        self.refuses(bar, "2 loose parts (8 vertices)")
        self.assertEqual(list(status.problem_vertices(bar)), list(range(104, 112)))

    def test_loose_vertex(self):
        bar, _ = support.make_rig(bind=False)
        self._edit(bar, lambda bm: bm.verts.new((5, 5, 5)))
        self.refuses(bar, "One loose part (1 vertices)")

    def test_loose_part_with_a_free_handle(self):
        bar, _ = support.make_rig(bind=False)
        self._join_squares(bar, 1)
        support.add_handle(bar, [104, 105], "FREE")
        self.refuses(bar, "only free handles")

    def test_shared_vertex(self):
        bar, _ = support.make_rig(bind=False)
        bar.vertex_groups["Handle.002"].add(level(0)[:2], 1.0, "REPLACE")
        self.refuses(bar, "'Handle.001' and 'Handle.002' share 2 vertices")
        self.assertEqual(list(status.problem_vertices(bar)), level(0)[:2])

    def test_empty_group(self):
        bar, _ = support.make_rig(bind=False)
        bar.vertex_groups["Handle.002"].remove(level(6))
        self.refuses(bar, "'Handle.002' has no vertices")

    def test_removed_group(self):
        bar, _ = support.make_rig(bind=False)
        bar.vertex_groups.remove(bar.vertex_groups["Handle.003"])
        self.refuses(bar, "vertex group of handle 'Handle.003' is gone")

    def test_empty_deleted_before_bind(self):
        bar, empties = support.make_rig(bind=False)
        support.activate(empties[1])
        bpy.ops.object.delete()
        support.activate(bar)
        self.refuses(bar, "The empty of handle 'Handle.002' was deleted")

    def test_edit_mode(self):
        bar, _ = support.make_rig(bind=False)
        bpy.ops.object.mode_set(mode="EDIT")
        self.refuses(bar, "Leave Edit Mode")
        bpy.ops.object.mode_set(mode="OBJECT")

    def test_zero_area_binds_with_a_warning(self):
        positions = support.bar_positions()
        faces = support.bar_faces() + [(0, 1, 2)]
        positions[1] = (positions[0] + positions[2]) / 2
        bar = support.make_mesh("Bar", positions, faces)
        for where in (3, 12):
            support.add_handle(bar, level(where))
        self.warns(bar, "no area")

    def test_non_manifold_binds_with_a_warning(self):
        faces = support.bar_faces() + [(0, 1, 60)]
        bar = support.make_mesh("Bar", support.bar_positions(), faces)
        for where in (3, 12):
            support.add_handle(bar, level(where))
        self.warns(bar, "non-manifold")

    def test_camel(self):
        """A real mesh with a hard life."""
        camel = numpy.load(support.data("camel.npz"))
        poses = {f"Pose {index}": (lambda _, p=p: p) for index, p in enumerate(camel["poses"][1:3])}
        obj = support.make_mesh("Camel", camel["poses"][0], camel["faces"].tolist(), poses)
        far = numpy.argsort(camel["poses"][0][:, 1])
        for vertices in (far[:5], far[-5:]):
            support.add_handle(obj, vertices)
        self.warns(obj, "non-manifold")
        bpy.ops.exemplar.pose_to_exemplar(name="Pose 1")
        support.update()
        self.assertEqual(support.problem(obj), "")
        self.assertTrue(numpy.isfinite(support.visible(obj)).all())

    def test_two_exemplars_are_enough(self):
        bar, _ = support.make_rig(poses={"Bend": support.pose_bend})
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 2)

    def _join_squares(self, bar, count):
        def squares(bm):
            for index in range(count):
                corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
                bm.faces.new([bm.verts.new((5 + 2 * index + x, y, 0)) for x, y in corners])

        self._edit(bar, squares)

    def _edit(self, bar, change):
        import bmesh

        support.activate(bar)
        bpy.ops.object.mode_set(mode="EDIT")
        change(bmesh.from_edit_mesh(bar.data))
        bmesh.update_edit_mesh(bar.data)
        bpy.ops.object.mode_set(mode="OBJECT")


if __name__ == "__main__":
    support.run(globals())
