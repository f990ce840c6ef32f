# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigidity in Blender: bound without shape keys, painted, filled, learned, baked."""

import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import bake_support  # noqa: E402
from addon_support import SceneCase, bindings, level  # noqa: E402
from blender_addon import native  # noqa: E402
from blender_addon.scene import (  # noqa: E402
    background,
    inputs,
    learning,
    meshes,
    solving,
    status,
    stiffness,
    versions,
)
from blender_addon.scene.baking import job, pc2  # noqa: E402

HALF = numpy.arange(6 * support.CORNERS)  # the lower half of the bar


def make(name="Bar", kinds=("PINNED",) * 3, bind=True, poses=None, target="KEY", **settings):
    """A bar for Rigidity, without shape keys unless `poses` says so; (object, empties)."""
    bar, empties = support.make_rig(name, kinds=kinds, bind=False, poses=poses or {})
    bar.exemplar.deformer = "RIGIDITY"
    bar.exemplar.target = target
    for setting, value in settings.items():
        setattr(bar.exemplar.rigidity, setting, value)
    if bind:
        bpy.ops.exemplar.bind()
    return bar, empties


def native_solution(bar, radii, depsgraph=None):
    """By the library alone, from arrays."""
    gathered = inputs.as_bound(bar, [])
    targets = solving.handles.targets(bar, depsgraph or support.depsgraph(), gathered.centres)
    with native.Mesh(gathered.reference, gathered.triangles) as mesh:
        handles = native.Handles(gathered.kinds, gathered.vertex_sets)
        with native.Rigidity(mesh, handles, radii) as deformer:
            deformer.solve(targets)
            return deformer.positions()


def radii_in_use(bar):
    return bindings.state_of(bar).deformer.radii()


class Binding(SceneCase):
    def test_result_key_on_a_mesh_without_keys(self):
        bar, empties = make()
        names = bar.data.shape_keys.key_blocks.keys()
        self.assertEqual(names, ["Basis", "Exemplar Result"])
        empties[2].location.x += 0.5
        support.update()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-6)
        self.assertClose(support.visible(bar)[level(12)].mean(axis=0)[0], 0.5, 1e-4)
        support.activate(bar)
        bpy.ops.exemplar.unbind()
        self.assertIsNone(bar.data.shape_keys)
        self.assertClose(versions.get_mesh_positions(bar.data), support.bar_positions(), 1e-6)

    def test_what_was_sculpted_while_bound_stays_after_unbind(self):
        bar, _ = make()
        edited = support.bar_positions().astype(numpy.float32)
        edited[level(12)] += (0, 0, 0.5)
        versions.set_key_positions(bar.data.shape_keys.reference_key, edited)
        bpy.ops.exemplar.unbind()
        self.assertIsNone(bar.data.shape_keys)
        self.assertClose(versions.get_mesh_positions(bar.data), edited, 0)

    def test_keys_made_while_bound_stay_after_unbind(self):
        bar, _ = make()
        bar.shape_key_add(name="Mine", from_mix=False)
        bpy.ops.exemplar.unbind()
        self.assertEqual(bar.data.shape_keys.key_blocks.keys(), ["Basis", "Mine"])

    def test_artists_keys_are_not_touched(self):
        bar, empties = make(poses=support.POSES)
        before = support.artists_keys(bar)
        empties[2].location.x += 0.5
        support.update()
        self.assertEqual(support.artists_keys(bar), before)
        bpy.ops.exemplar.unbind()
        self.assertEqual(support.artists_keys(bar), before)

    def test_separate_object_leaves_the_mesh_without_keys(self):
        bar, empties = make(target="OBJECT")
        self.assertIsNone(bar.data.shape_keys)
        empties[2].location.x += 0.5
        support.update()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-6)
        self.assertClose(versions.get_mesh_positions(bar.data), support.bar_positions(), 1e-6)
        support.activate(bar)
        bpy.ops.exemplar.unbind()
        self.assertIsNone(bar.data.shape_keys)
        self.assertEqual(len([o for o in bpy.data.objects if o.type == "MESH"]), 1)

    def test_one_handle_is_enough(self):
        bar = support.make_bar(poses={})
        bar.exemplar.deformer = "RIGIDITY"
        empty = support.add_handle(bar, level(0), "ORIENTED")
        bpy.ops.exemplar.bind()
        empty.location.z += 1
        support.update()
        moved = support.bar_positions() + (0, 0, 1)
        self.assertClose(support.visible(bar), moved, 1e-4)

    def test_result_is_the_librarys(self):
        bar, empties = make(matrix=None, radius=3)
        empties[2].location = (0.7, 0.2, 1.9)
        support.update()
        self.assertClose(support.visible(bar), native_solution(bar, 3), 1e-6)

    def test_with_transforms(self):
        bar, empties = make(bind=False)
        bar.matrix_world = support.AWKWARD
        support.update()
        bpy.ops.exemplar.bind()
        place = support.AWKWARD @ support.Matrix.Translation((0.6, 0.1, 2.0))
        empties[2].location = place.translation
        support.update()
        shown = support.visible(bar)
        self.assertClose(shown[level(12)].mean(axis=0), (0.6, 0.1, 2.0), 1e-4)
        self.assertClose(shown, support.solved(bar), 1e-6)


class Frames(SceneCase):
    def setUp(self):
        super().setUp()
        self.bar, self.empties = make(kinds=("ORIENTED", "FREE", "ORIENTED"))
        for frame, place, turn in ((1, (0, 0, 2.4), 0), (9, (1.2, 0.3, 1.2), 1.4)):
            self.empties[2].location = place
            self.empties[2].keyframe_insert("location", frame=frame)
            self.empties[2].rotation_euler.y = turn
            self.empties[2].keyframe_insert("rotation_euler", frame=frame)

    def at(self, frame):
        self.scene.frame_set(int(frame), subframe=frame % 1)
        return support.visible(self.bar)

    def test_order_of_frames_and_subframes(self):
        frames = (1, 4, 4.25, 4.75, 5, 9)
        first = {frame: self.at(frame) for frame in frames}
        for frame in (9, 4.75, 4, 5, 1, 4.25):
            self.assertTrue(numpy.array_equal(self.at(frame), first[frame]), frame)
        self.assertFar(first[4.25], first[4.75], 1e-3)
        self.assertClose(self.at(5), support.solved(self.bar), 1e-6)

    def test_after_warm_solves(self):
        expected = self.at(6)
        self.at(2)
        for _ in range(4):
            solving.solve(self.bar, stateless=False)
        self.assertTrue(numpy.array_equal(self.at(6), expected))

    def test_motion_blur_renders(self):
        expected = self.at(5)
        support.small_render(self.scene)
        self.scene.render.use_motion_blur = True
        seen = []

        def look(scene, *_):
            seen.append(support.key(self.bar, "Exemplar Result"))

        bpy.app.handlers.render_post.append(look)
        self.addCleanup(bpy.app.handlers.render_post.remove, look)
        bpy.ops.render.render()
        self.assertEqual(len(seen), 1)
        self.assertClose(self.at(5), expected, 0)

    def test_bakes(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = str(Path(folder.name) / "bar.pc2")
        expected = {frame: self.at(frame) for frame in range(1, 10)}
        steps = job.run(
            self.bar, self.scene, bpy.context.view_layer, job.Settings("PC2", 1, 9, filepath=path)
        )
        list(steps)
        _, samples = pc2.read(path)
        for frame, sample in zip(expected, samples):
            self.assertClose(sample, expected[frame], 1e-6)

    def test_bake_to_shape_keys(self):
        expected = {frame: self.at(frame) for frame in (1, 5, 9)}
        settings = job.Settings("SHAPE_KEYS", 1, 9)
        list(job.run(self.bar, self.scene, bpy.context.view_layer, settings))
        for frame in expected:
            self.assertClose(self.at(frame), expected[frame], 1e-5)

    def test_bake_to_values_needs_keys(self):
        settings = job.Settings("WEIGHTS", 1, 9)
        with self.assertRaises(job.SettingsError) as caught:
            list(job.run(self.bar, self.scene, bpy.context.view_layer, settings))
        self.assertIn("no exemplar beside its Basis", str(caught.exception))

    def test_bake_to_values(self):
        bar, empties = make("Keyed", poses=support.POSES)
        empties[2].location = (0.5, 0, 2.1)
        support.update()
        list(job.run(bar, self.scene, bpy.context.view_layer, job.Settings("WEIGHTS", 1, 2)))
        self.assertTrue(any(k.value > 0.1 for k in bar.data.shape_keys.key_blocks[1:3]))

    def test_command_line(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        blend, out = Path(folder.name) / "bar.blend", Path(folder.name) / "bar.pc2"
        expected = self.at(7)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        arguments = ["bake", "--object", "Bar", "--frames", "7-7", "--out", out]
        done = bake_support.blender(
            "--factory-startup", blend, "--python", bake_support.COMMAND_LINE, "--", *arguments
        )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        _, samples = pc2.read(str(out))
        self.assertClose(samples[0], expected, 1e-6)


class Painting(SceneCase):
    def test_fill(self):
        bar, empties = make()
        empties[2].location = (0.9, 0, 1.8)
        support.update()
        soft = support.visible(bar)
        deformer = bindings.state_of(bar).deformer
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        self.assertEqual(bar.exemplar.rigidity.source, "PAINTED")
        expected = numpy.full(len(bar.data.vertices), 2)
        expected[HALF] = 6
        self.assertTrue(numpy.array_equal(radii_in_use(bar), expected))
        self.assertIs(bindings.state_of(bar).deformer, deformer, "no full bind")
        self.assertFar(support.visible(bar), soft, 1e-3)
        self.assertClose(support.visible(bar), native_solution(bar, expected), 1e-5)

    def test_stiff_parts_bend_less(self):
        bar, empties = make(kinds=("ORIENTED", "FREE", "PINNED"), radius_max=10)
        empties[2].location = (1.6, 0, 1.4)
        support.update()

        def bend_of_lower_half():
            """How far its rings are from one line."""
            rings = support.visible(bar).reshape(support.RINGS, support.CORNERS, 3).mean(axis=1)
            lower = rings[1:7]
            return numpy.linalg.svd(lower - lower.mean(axis=0))[1][1]

        soft = bend_of_lower_half()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        self.assertLess(bend_of_lower_half(), 0.7 * soft)

    def test_fill_in_edit_mode_is_taken_up_on_leaving_it(self):
        bar, _ = make()
        support.activate(bar)
        support.select(bar, level(3))
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        bpy.ops.object.mode_set(mode="OBJECT")
        support.update()
        solving.solve(bar)
        self.assertEqual(set(radii_in_use(bar)[level(3)]), {6})
        self.assertEqual(set(radii_in_use(bar)[level(9)]), {2})

    def test_weights_changed_by_script_are_taken_up(self):
        bar, empties = make(source="UNIFORM")
        empties[2].location = (0.9, 0, 1.8)
        support.activate(bar)
        bpy.ops.exemplar.rigidity_paint()
        self.assertEqual(bar.mode, "WEIGHT_PAINT")
        self.assertEqual(bar.vertex_groups.active.name, "Rigidity")
        support.update()
        before = support.visible(bar)
        bar.vertex_groups["Rigidity"].add(HALF.tolist(), 0.6, "REPLACE")
        bar.data.update_tag()
        support.update()
        self.assertEqual(set(radii_in_use(bar)[HALF]), {4})
        self.assertFar(support.visible(bar), before, 1e-4)
        bpy.ops.exemplar.rigidity_paint()
        self.assertEqual(bar.mode, "OBJECT")

    def test_group_begins_as_stiff_as_the_mesh_was(self):
        bar, _ = make(radius=3)
        stiffness.ensure_group(bar)
        self.assertEqual(set(stiffness.radii(bar)), {3})

    def test_range_is_taken_up_at_once(self):
        bar, _ = make()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        bar.exemplar.rigidity.radius_max = 12
        support.update()
        self.assertEqual(set(radii_in_use(bar)[HALF]), {12})

    def test_uniform_again(self):
        bar, _ = make()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        bar.exemplar.rigidity.source = "UNIFORM"
        support.update()
        self.assertEqual(set(radii_in_use(bar)), {2})

    def test_outside_of_the_group_is_softest(self):
        bar, _ = make()
        group = bar.vertex_groups.new(name="Rigidity")
        group.add(level(5), 1.0, "REPLACE")
        bar.exemplar.rigidity.group = "Rigidity"
        bar.exemplar.rigidity.source = "PAINTED"
        support.update()
        radii = radii_in_use(bar)
        self.assertEqual(set(radii[level(5)]), {6})
        self.assertEqual(set(numpy.delete(radii, level(5))), {1})

    def test_renamed_group(self):
        bar, _ = make()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        bar.vertex_groups["Rigidity"].name = "Material"
        bar.data.update_tag()
        support.update()
        self.assertEqual(support.problem(bar), "")
        self.assertEqual(set(radii_in_use(bar)[HALF]), {6})

    def test_save_and_load(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        bar, empties = make()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        empties[2].location = (0.9, 0, 1.8)
        support.update()
        shown, radii = support.visible(bar), radii_in_use(bar)
        path = str(Path(folder.name) / "bar.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        bar = bpy.data.objects["Bar"]
        self.assertClose(support.solved(bar), shown, 1e-5)
        self.assertTrue(numpy.array_equal(radii_in_use(bar), radii))


class Learning(SceneCase):
    def test_from_shape_keys(self):
        bar, _ = make(poses={"Bend": upper_bend, "More": lambda p: upper_bend(p, 2.5)})
        support.activate(bar)
        bpy.ops.exemplar.rigidity_learn_keys()
        rest = support.bar_positions().astype(numpy.float32)
        with native.Mesh(rest, meshes.triangles(bar.data)) as mesh:
            poses = [support.key(bar, name) for name in ("Bend", "More")]
            expected = native.learn_radii(mesh, poses, 1, 6, bar.exemplar.rigidity.omega)
        self.assertTrue(numpy.array_equal(stiffness.radii(bar), expected))
        self.assertTrue(numpy.array_equal(radii_in_use(bar), expected))
        self.assertGreater(expected[level(1)].mean(), expected[level(9)].mean())

    def test_exemplars_that_are_off_do_not_count(self):
        bar, _ = make(poses={"Bend": upper_bend, "Fat": support.pose_fat})
        support.activate(bar)
        bpy.ops.exemplar.exemplar_toggle(name="Fat")
        problem = learning.from_keys(bar)
        self.assertEqual(len(problem.poses), 1)
        self.assertClose(problem.poses[0], support.key(bar, "Bend"), 0)

    def test_from_animation(self):
        bar, _ = make()
        actor = support.make_bar("Actor", poses={"Bend": upper_bend})
        key = actor.data.shape_keys.key_blocks["Bend"]
        key.value = 0
        key.keyframe_insert("value", frame=1)
        key.value = 1
        key.keyframe_insert("value", frame=9)
        self.scene.frame_start, self.scene.frame_end = 1, 9
        self.scene.frame_set(4)
        bar.exemplar.rigidity.animated = actor
        bar.exemplar.rigidity.frame_step = 4
        support.activate(bar)
        bpy.ops.exemplar.rigidity_learn_animation()
        self.assertEqual(self.scene.frame_current, 4)
        rest = support.bar_positions().astype(numpy.float32)
        poses = []
        for frame in (5, 9):  # frame 1 is the rest
            self.scene.frame_set(frame)
            poses.append(versions.get_mesh_positions(actor.evaluated_get(support.depsgraph()).data))
        with native.Mesh(rest, meshes.triangles(bar.data)) as mesh:
            expected = native.learn_radii(mesh, poses, 1, 6, bar.exemplar.rigidity.omega)
        self.assertTrue(numpy.array_equal(stiffness.radii(bar), expected))

    def test_learned_can_be_painted_over(self):
        bar, _ = make(poses={"Bend": upper_bend})
        support.activate(bar)
        bpy.ops.exemplar.rigidity_learn_keys()
        before = stiffness.radii(bar)
        support.select(bar, level(9))
        bpy.ops.exemplar.rigidity_fill(value=0.2)
        after = stiffness.radii(bar)
        self.assertEqual(set(after[level(9)]), {2})
        others = numpy.delete(numpy.arange(len(after)), level(9))
        self.assertTrue(numpy.array_equal(after[others], before[others]))

    def test_cancelled(self):
        """What the window's Esc does: the thread ends, and nothing has changed."""
        bar, _ = make(poses={"Bend": upper_bend})
        before = stiffness.key(bar)
        problem = learning.from_keys(bar)
        done = background.BackgroundJob(lambda report: learning.learn(problem, lambda *_: True))
        with self.assertRaises(native.ExemplarError) as caught:
            done.result()
        self.assertTrue(caught.exception.cancelled)
        self.assertEqual(stiffness.key(bar), before)
        self.assertNotIn("Rigidity", bar.vertex_groups)

    def test_cancelled_among_the_frames(self):
        bar, _ = make(poses={"Bend": upper_bend})
        self.scene.frame_set(3)
        steps = learning.from_animation(bar, bar, self.scene, support.depsgraph, range(10, 20))
        next(steps)
        self.assertEqual(self.scene.frame_current, 10)
        steps.close()
        self.assertEqual(self.scene.frame_current, 3)


def upper_bend(rest, angle=1.5):
    """The lower half stays as it is."""
    x, y, z = rest.T
    above = numpy.maximum(z - support.HEIGHT / 2, 0)
    bend = angle * above
    return numpy.column_stack(
        [
            x * numpy.cos(bend) + above * numpy.sin(bend),
            y,
            numpy.minimum(z, support.HEIGHT / 2) + above * numpy.cos(bend) - x * numpy.sin(bend),
        ]
    )


class Switching(SceneCase):
    def test_takes_effect_at_rebind_and_says_so(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.9, 0.2, 1.8)
        support.update()
        blended = support.visible(bar)
        bar.exemplar.deformer = "RIGIDITY"
        support.update()
        self.assertClose(support.visible(bar), blended, 0)
        self.assertEqual(status.pending(bar), "deformer")
        support.activate(bar)
        bpy.ops.exemplar.rebind()
        self.assertEqual(status.pending(bar), "")
        self.assertClose(support.visible(bar), native_solution(bar, 2), 1e-5)
        self.assertClose(empties[2].matrix_world.translation, (0.9, 0.2, 1.8), 1e-6)
        bar.exemplar.deformer = "AMRAP"
        bpy.ops.exemplar.rebind()
        self.assertClose(support.visible(bar), blended, 1e-5)

    def test_pose_to_exemplar(self):
        bar, empties = make(poses=support.POSES, kinds=("ORIENTED", "PINNED", "PINNED"))
        support.activate(bar)
        bpy.ops.exemplar.pose_to_exemplar(name="Bend")
        bend = support.key(bar, "Bend")
        for empty, where in zip(empties, support.LEVELS.values()):
            place = bend[level(where)].mean(axis=0)
            self.assertClose(empty.matrix_world.translation, place, 1e-5)
        self.assertFails("no shape key 'Nod'", bpy.ops.exemplar.pose_to_exemplar, name="Nod")

    def test_edited_exemplars_do_not_matter(self):
        bar, empties = make(poses=support.POSES)
        key = bar.data.shape_keys.key_blocks["Fat"]
        versions.set_key_positions(key, support.key(bar, "Bend"))
        bar.data.update_tag()
        empties[2].location.x = 0.4
        support.update()
        self.assertEqual(support.problem(bar), "")
        self.assertClose(support.visible(bar), support.solved(bar), 1e-6)

    def test_undo_of_a_rebind(self):
        bpy.ops.ed.undo_push(message="empty")
        bar, empties = support.make_rig()
        bpy.ops.ed.undo_push(message="bound")
        bar.exemplar.deformer = "RIGIDITY"
        bpy.ops.exemplar.rebind()
        bpy.ops.ed.undo_push(message="rebound")
        bpy.ops.ed.undo()
        bar = bpy.data.objects["Bar"]
        bar.exemplar.handles[2].empty.location.x = 0.5
        support.update()
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)
        self.assertIsInstance(bindings.state_of(bar).deformer, native.Amrap)


class BadInput(SceneCase):
    def test_no_handle(self):
        bar = support.make_bar(poses={})
        bar.exemplar.deformer = "RIGIDITY"
        self.assertFails("Add handles", bpy.ops.exemplar.bind)

    def test_only_free_handles(self):
        bar = support.make_bar(poses={})
        bar.exemplar.deformer = "RIGIDITY"
        support.add_handle(bar, level(0), "FREE")
        self.assertFails("Every handle is free", bpy.ops.exemplar.bind)

    def test_group_missing_at_bind(self):
        self.assertFails("is gone", make, source="PAINTED", group="Rigidity")

    def test_group_removed_while_bound(self):
        bar, empties = make()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        bar.vertex_groups.remove(bar.vertex_groups["Rigidity"])
        bar.data.update_tag()
        support.update()
        self.assertIn("'Rigidity', which says how stiff", support.problem(bar))
        bar.exemplar.rigidity.source = "UNIFORM"
        support.update()
        self.assertEqual(support.problem(bar), "")

    def test_range_upside_down(self):
        bar, _ = make()
        support.activate(bar)
        support.select(bar, HALF)
        bpy.ops.exemplar.rigidity_fill(value=1.0)
        bar.exemplar.rigidity.radius_min = 8
        support.update()
        self.assertIn("Softest is 8 rings", support.problem(bar))
        self.assertFails("Softest is 8", bpy.ops.exemplar.rebind)

    def test_fill_of_nothing(self):
        bar, _ = make()
        support.activate(bar)
        support.select(bar, [])
        self.assertFails("No vertices are selected", bpy.ops.exemplar.rigidity_fill)
        self.assertNotIn("Rigidity", bar.vertex_groups)

    def learns_not(self, part, bar, how="keys"):
        support.activate(bar)
        self.assertFails(part, getattr(bpy.ops.exemplar, f"rigidity_learn_{how}"))
        self.assertNotIn("Rigidity", bar.vertex_groups)

    def test_learn_without_keys(self):
        bar, _ = make(target="OBJECT")
        self.learns_not("no shape keys to learn from", bar)

    def test_learn_from_the_basis_alone(self):
        bar, _ = make(poses={"Bend": upper_bend})
        support.activate(bar)
        bpy.ops.exemplar.exemplar_toggle(name="Bend")
        self.learns_not("Only 'Basis' is switched on", bar)

    def test_learn_from_poses_that_are_the_rest(self):
        bar, _ = make(poses={"Same": lambda rest: rest})
        self.learns_not("same as the mesh at rest", bar)

    def test_learn_from_a_still_animation(self):
        bar, _ = make()
        self.scene.frame_start, self.scene.frame_end = 1, 3
        self.learns_not("same as the mesh at rest", bar, "animation")

    def test_learn_from_another_count(self):
        bar, _ = make()
        other = support.make_mesh("Other", support.bar_positions()[:-1], [(0, 1, 2)], {})
        bar.exemplar.rigidity.animated = other
        self.learns_not("'Other' has 103 vertices on frame 1, and 'Bar' has 104", bar, "animation")

    def test_learn_from_a_modifier_that_changes_the_count(self):
        bar, _ = make()
        actor = support.make_bar("Actor", poses={})
        actor.modifiers.new("More", "SUBSURF")
        bar.exemplar.rigidity.animated = actor
        self.learns_not("switch off modifiers", bar, "animation")

    def test_learn_from_other_faces(self):
        bar, _ = make()
        faces = support.bar_faces()
        other = support.make_mesh("Other", support.bar_positions(), faces[::-1], {})
        bar.exemplar.rigidity.animated = other
        self.learns_not("has other faces", bar, "animation")

    def test_learn_from_no_frames(self):
        bar, _ = make(use_scene_range=False, frame_start=5, frame_end=2)
        self.learns_not("comes before the first", bar, "animation")

    def test_learn_with_nothing_to_choose(self):
        bar, _ = make(poses={"Bend": upper_bend}, radius_min=3, radius_max=3)
        self.learns_not("nothing to learn", bar)

    def test_learn_from_numbers_that_are_none(self):
        def broken(rest):
            rest = rest.copy()
            rest[7] = numpy.nan
            return rest

        bar, _ = make(poses={"Broken": broken})
        self.learns_not("'Broken' has coordinates that are not numbers, at vertex 7", bar)


if __name__ == "__main__":
    support.run(globals())
