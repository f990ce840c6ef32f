# SPDX-License-Identifier: GPL-3.0-or-later
"""Blended in Blender: bound, solved, baked; its weights as vertex groups."""

import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings, level  # noqa: E402
from blender_addon import native  # noqa: E402
from blender_addon.scene import inputs, interpolation, meshes, solving, status  # noqa: E402
from blender_addon.scene.baking import job, pc2  # noqa: E402


def make(name="Bar", kinds=("PINNED",) * 3, bind=True, poses=support.POSES, **settings):
    bar, empties = support.make_rig(name, kinds=kinds, bind=False, poses=poses)
    bar.exemplar.deformer = "BLENDED"
    for setting, value in settings.items():
        setattr(bar.exemplar.blended, setting, value)
    if bind:
        bpy.ops.exemplar.bind()
    return bar, empties


def elbow(rest, angle=1.2):
    """A stiff lower and a stiff upper half."""
    x, y, z = rest.T
    share = numpy.clip((z - 1.0) / 0.4, 0, 1)
    turn = angle * share
    above = numpy.maximum(z - 1.2, 0)
    return numpy.column_stack(
        [
            x * numpy.cos(turn) + above * numpy.sin(turn),
            y,
            numpy.minimum(z, 1.2) + above * numpy.cos(turn) - x * numpy.sin(turn),
        ]
    )


class Solving(SceneCase):
    def test_result_is_the_librarys(self):
        bar, empties = make()
        empties[2].location = (0.7, 0.2, 1.9)
        support.update()
        gathered = inputs.as_bound(bar, ["Basis", "Bend", "Fat"])
        targets = solving.handles.targets(bar, support.depsgraph(), gathered.centres)
        with native.Mesh(gathered.reference, gathered.triangles) as mesh:
            handles = native.Handles(gathered.kinds, gathered.vertex_sets)
            with native.Blended(mesh, gathered.exemplars, handles) as deformer:
                deformer.solve(targets, native.BlendedSettings(scale=False))
                expected = deformer.positions()
        self.assertClose(support.visible(bar), expected, 1e-5)
        self.assertClose(support.solved(bar), expected, 1e-5)

    def test_exemplar_comes_back(self):
        """Up to what the dictionary that was reduced costs."""
        bar, _ = make(atoms_kept=1.0, kinds=("ORIENTED",) * 3)
        for name in ("Bend", "Fat"):
            support.activate(bar)
            bpy.ops.exemplar.pose_to_exemplar(name=name)
            support.update()
            self.assertClose(support.visible(bar), support.key(bar, name), 0.02, name)

    def test_settings_count(self):
        # Few rounds: after many the first guess has been forgotten. And a pose that no exemplar is
        # near to, or it is found from there and not from the guess.
        bar, empties = make(average_iterations=0, minimal_iterations=1, final_iterations=1)
        empties[2].location = (-1, 0, -0.5)
        support.update()
        for setting, value in (
            ("constraint_weight", 1.0),
            ("smoothness", 0.01),
            ("scale", True),
            ("sparsity", 1.0),
            ("begin", "PLAIN"),
            ("final_iterations", 40),
        ):
            with self.subTest(setting):
                before, old = support.visible(bar), getattr(bar.exemplar.blended, setting)
                setattr(bar.exemplar.blended, setting, value)
                support.update()
                self.assertFar(support.visible(bar), before, 1e-5)
                self.assertClose(support.visible(bar), support.solved(bar), 1e-6)
                setattr(bar.exemplar.blended, setting, old)
                support.update()

    def test_energies_of_another_moment_leave_nothing_behind(self):
        """The deformer keeps them, and a stateless result may not depend on what it kept."""
        bar, empties = make()
        empties[2].location = (0.7, 0.6, 2.0)
        support.update()
        first = support.visible(bar)
        bar.exemplar.blended.constraint_weight = 2.0
        support.update()
        bar.exemplar.blended.constraint_weight = 30.0
        support.update()
        self.assertClose(support.visible(bar), first, 1e-6)

    def test_scale_is_found_and_told(self):
        bar, empties = make(scale=True, kinds=("ORIENTED",) * 3)
        for empty, where in zip(empties, support.LEVELS.values()):
            empty.location = support.bar_positions()[level(where)].mean(axis=0) * 1.5
            empty.scale = (1.5, 1.5, 1.5)
        support.update()
        self.assertClose(support.visible(bar), 1.5 * support.bar_positions(), 0.05)
        self.assertIn("scale 1.5", status.describe(bar)[0].text)

    def test_without_shape_keys(self):
        bar, empties = make(poses={})
        empties[2].location = (0.5, 0, 2.2)
        support.update()
        self.assertFar(support.visible(bar), support.bar_positions(), 0.1)
        self.assertClose(support.visible(bar), support.solved(bar), 1e-6)
        support.activate(bar)
        bpy.ops.exemplar.unbind()
        self.assertIsNone(bar.data.shape_keys)

    def test_bind_settings_wait_for_rebind(self):
        bar, _ = make()
        for setting, value, word in (
            ("dictionary", "SKELETON", "dictionary"),
            ("eigenfunctions", 8, "number of patterns"),
            ("bones", 3, "number of bones"),
            ("atoms_kept", 0.9, "richness"),
        ):
            setattr(bar.exemplar.blended, setting, value)
            self.assertIn(word, status.pending(bar))
            support.activate(bar)
            bpy.ops.exemplar.rebind()
            self.assertEqual(status.pending(bar), "")
        info = bindings.state_of(bar).deformer.blended_info()
        self.assertEqual((info.bone_count, info.weight_count), (3, 4))

    def test_switched_off_exemplars(self):
        bar, _ = make(bind=False)
        support.activate(bar)
        for name in ("Fat", "Bend"):
            bpy.ops.exemplar.exemplar_toggle(name=name)
        bpy.ops.exemplar.bind()
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 1)
        bpy.ops.exemplar.exemplar_toggle(name="Fat")
        self.assertIn("exemplars", status.pending(bar))


class Frames(SceneCase):
    def setUp(self):
        super().setUp()
        self.bar, self.empties = make()
        for frame, place in ((1, (0, 0, 2.4)), (9, (1.2, 0.3, 1.4))):
            self.empties[2].location = place
            self.empties[2].keyframe_insert("location", frame=frame)

    def at(self, frame):
        self.scene.frame_set(int(frame), subframe=frame % 1)
        return support.visible(self.bar)

    def test_order_of_frames_and_subframes(self):
        frames = (1, 4, 4.25, 4.75, 5, 9)
        first = {frame: self.at(frame) for frame in frames}
        for frame in (9, 4.75, 4, 5, 1, 4.25):
            self.assertTrue(numpy.array_equal(self.at(frame), first[frame]), frame)
        self.assertFar(first[4.25], first[4.75], 1e-3)

    def test_after_warm_solves(self):
        expected = self.at(6)
        self.at(2)
        for _ in range(4):
            solving.solve(self.bar, stateless=False)
        self.assertTrue(numpy.array_equal(self.at(6), expected))

    def test_animated_settings(self):
        blended = self.bar.exemplar.blended
        blended.keyframe_insert("constraint_weight", frame=1)
        blended.constraint_weight = 1.0
        blended.keyframe_insert("constraint_weight", frame=9)
        first = {frame: self.at(frame) for frame in (2, 5, 8)}
        for frame in (8, 2, 5):
            self.assertClose(self.at(frame), first[frame], 1e-6)

    def test_bakes(self):
        expected = {frame: self.at(frame) for frame in range(1, 10)}
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "bar.pc2")
            settings = job.Settings("PC2", 1, 9, filepath=path, use_modifier=False)
            list(job.run(self.bar, self.scene, bpy.context.view_layer, settings))
            _, samples = pc2.read(path)
        for frame, sample in zip(expected, samples):
            self.assertClose(sample, expected[frame], 1e-6)
        for kind in ("SHAPE_KEYS", "WEIGHTS"):
            self.scene.frame_set(1)
            list(job.run(self.bar, self.scene, bpy.context.view_layer, job.Settings(kind, 1, 9)))
        bend = self.bar.data.shape_keys.key_blocks["Bend"].value
        self.scene.frame_set(9)
        self.assertNotAlmostEqual(self.bar.data.shape_keys.key_blocks["Bend"].value, bend, 2)


class Skinning(SceneCase):
    def make(self):
        poses = {"Elbow": elbow, "More": lambda rest: elbow(rest, 2.0)}
        return make(poses=poses, dictionary="SKELETON", bones=2)

    def weights(self, bar, names):
        return numpy.array([meshes.group_weights(bar, name) for name in names])

    def test_groups_are_the_librarys_weights(self):
        bar, empties = self.make()
        support.activate(bar)
        before = [group.name for group in bar.vertex_groups]
        bpy.ops.exemplar.skin_to_groups()
        names = [group.name for group in bar.vertex_groups if group.name not in before]
        expected = bindings.state_of(bar).deformer.functions()[1:]
        found = self.weights(bar, names)
        self.assertClose(found, expected, 2e-4)
        self.assertClose(found.sum(axis=0), numpy.ones(found.shape[1]), 1e-3)
        self.assertGreater(found[:, level(0)].max(), 0.9)
        self.assertGreater(abs(found[0, level(0)].mean() - found[0, level(12)].mean()), 0.8)
        empties[2].location.x = 0.4
        support.update()
        self.assertEqual(support.problem(bar), "", "handles are still found by their groups")

    def test_again_replaces_them(self):
        bar, _ = self.make()
        support.activate(bar)
        bpy.ops.exemplar.skin_to_groups()
        count = len(bar.vertex_groups)
        mine = bar.vertex_groups.new(name="Mine")
        mine.add([0], 1.0, "REPLACE")
        bpy.ops.exemplar.skin_to_groups()
        self.assertEqual(len(bar.vertex_groups), count + 1)
        self.assertEqual(meshes.group_weights(bar, "Mine")[0], 1.0)

    def test_an_armature_moves_it_like_the_exemplar(self):
        """What the groups are for: two bones that turn as the halves do."""
        bar, _ = self.make()
        support.activate(bar)
        bpy.ops.exemplar.skin_to_groups()
        names = [g.name for g in bar.vertex_groups if g.name.startswith("Bone")]
        weights = self.weights(bar, names)
        rest, pose = support.bar_positions(), elbow(support.bar_positions())
        rebuilt = numpy.zeros_like(rest)
        for values in weights:
            heavy = values > 0.9
            a, b = rest[heavy].mean(axis=0), pose[heavy].mean(axis=0)
            u, _, v = numpy.linalg.svd((pose[heavy] - b).T @ (rest[heavy] - a))
            turn = u @ numpy.diag([1, 1, numpy.linalg.det(u @ v)]) @ v
            rebuilt += values[:, None] * ((rest - a) @ turn.T + b)
        self.assertClose(rebuilt, pose, 0.12)


class Interpolation(SceneCase):
    def keyed(self, places, frames=(1, 9), turns=None, **settings):
        """A bar whose top is at `places` on `frames`."""
        bar, empties = make(kinds=("ORIENTED", "FREE", "ORIENTED"), **settings)
        for number, (frame, place) in enumerate(zip(frames, places)):
            empties[2].location = place
            if turns:
                empties[2].rotation_euler.y = turns[number]
            support.activate(bar)
            self.scene.frame_set(frame)
            empties[2].location = place
            if turns:
                empties[2].rotation_euler.y = turns[number]
            bpy.ops.exemplar.key_all()
        self.scene.frame_start, self.scene.frame_end = frames[0], frames[-1]
        return bar, empties

    def at(self, bar, frame):
        self.scene.frame_set(frame)
        return support.visible(bar)

    def test_frames_between_are_the_librarys(self):
        bar, _ = self.keyed([(0, 0, 2.4), (1.3, 0, 1.2)], turns=(0, 1.2))
        ends = {frame: self.at(bar, frame) for frame in (1, 9)}
        deformer = bindings.state_of(bar).deformer
        keys = []
        for frame in (1, 9):
            self.scene.frame_set(frame)
            solving.solve(bar)
            keys.append(deformer.key())
        expected = {}
        for frame in range(2, 9):
            deformer.interpolate(keys, [1, 9], frame)
            foot = deformer.result_pose()[0, :, 3]
            expected[frame] = deformer.positions() - foot.astype(numpy.float32)  # it stands still
        self.scene.frame_set(4)
        support.activate(bar)
        bpy.ops.exemplar.interpolate()
        self.assertEqual(self.scene.frame_current, 4)
        self.assertEqual(interpolation.keyed_frames(bar), list(range(1, 10)))
        for frame in (1, 9):
            self.assertClose(self.at(bar, frame), ends[frame], 1e-5)
        size = numpy.linalg.norm(numpy.ptp(ends[1], axis=0))
        for frame in range(2, 9):
            self.assertClose(self.at(bar, frame), expected[frame], 0.05 * size, frame)

    def test_parts_turn_and_do_not_shrink(self):
        """The whole bar turned by a quarter: half way it has turned by an eighth. On the straight
        line between its two places its top would come nearer."""
        turn, height = numpy.pi / 2, support.HEIGHT
        bar, empties = make(kinds=("ORIENTED", "FREE", "ORIENTED"))
        support.activate(bar)
        for frame, angle in ((1, 0.0), (9, turn)):
            self.scene.frame_set(frame)
            empties[2].location = (height * numpy.sin(angle), 0, height * numpy.cos(angle))
            for empty in (empties[0], empties[2]):
                empty.rotation_euler.y = angle
            bpy.ops.exemplar.key_all()
        straight = height * numpy.cos(turn / 2)
        self.assertAlmostEqual(self._length(empties[2], 5), straight, 2)
        bpy.ops.exemplar.interpolate()
        self.assertAlmostEqual(self._length(empties[2], 5), height, 2)
        place = empties[2].matrix_world.translation
        self.assertAlmostEqual(numpy.arctan2(place.x, place.z), turn / 2, 2)
        self.assertAlmostEqual(empties[2].rotation_euler.y, turn / 2, 2)

    def _length(self, empty, frame):
        self.scene.frame_set(frame)
        return empty.matrix_world.translation.length

    def test_all_keys(self):
        places = [(0, 0, 2.4), (1.2, 0, 1.4), (0.3, 0.8, 2.0)]
        bar, _ = self.keyed(places, (1, 7, 13))
        poses = {frame: self.at(bar, frame) for frame in (1, 7, 13)}
        support.activate(bar)
        bpy.ops.exemplar.interpolate(all_keys=True)
        self.assertEqual(interpolation.keyed_frames(bar), list(range(1, 14)))
        for frame in poses:
            self.assertClose(self.at(bar, frame), poses[frame], 1e-5)

    def test_only_the_frames_about_the_current_one(self):
        bar, _ = self.keyed([(0, 0, 2.4), (1.2, 0, 1.4), (0.3, 0.8, 2.0)], (1, 7, 13))
        support.activate(bar)
        self.scene.frame_set(9)
        bpy.ops.exemplar.interpolate()
        self.assertEqual(interpolation.keyed_frames(bar), [1, *range(7, 14)])

    def test_it_can_be_baked(self):
        bar, _ = self.keyed([(0, 0, 2.4), (1.2, 0, 1.4)])
        support.activate(bar)
        bpy.ops.exemplar.interpolate()
        expected = {frame: self.at(bar, frame) for frame in range(1, 10)}
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "bar.pc2")
            settings = job.Settings("PC2", 1, 9, filepath=path, use_modifier=False)
            list(job.run(bar, self.scene, bpy.context.view_layer, settings))
            _, samples = pc2.read(path)
        for frame, sample in zip(expected, samples):
            self.assertClose(sample, expected[frame], 1e-6)

    def test_stopped_on_its_way(self):
        bar, _ = self.keyed([(0, 0, 2.4), (1.2, 0, 1.4)])
        self.scene.frame_set(4)
        shown = support.visible(bar)
        steps = interpolation.find(bar, self.scene, support.depsgraph, [1, 9])
        for _ in range(4):
            next(steps)
        steps.close()
        self.assertEqual(self.scene.frame_current, 4)
        self.assertEqual(interpolation.keyed_frames(bar), [1, 9])
        support.update()
        self.assertClose(support.solved(bar), shown, 1e-5)

    def refuses(self, part, bar, **options):
        support.activate(bar)
        self.assertFails(part, bpy.ops.exemplar.interpolate, **options)

    def test_one_key(self):
        bar, _ = self.keyed([(0, 0, 2.4)], (1,))
        self.refuses("no two keyed poses", bar)

    def test_no_frame_between(self):
        bar, _ = self.keyed([(0, 0, 2.4), (1.2, 0, 1.4)], (1, 2))
        self.refuses("no frame to fill between 1 and 2", bar)

    def test_keys_outside_of_the_range(self):
        bar, _ = self.keyed([(0, 0, 2.4), (1.2, 0, 1.4)])
        self.scene.frame_start = 5
        self.refuses("no two keyed poses", bar, all_keys=True)

    def test_constraints_would_win(self):
        bar, empties = self.keyed([(0, 0, 2.4), (1.2, 0, 1.4)])
        empties[2].constraints.new("COPY_LOCATION")
        self.refuses("moved by constraints", bar)

    def test_another_deformer(self):
        bar, _ = support.make_rig()
        self.refuses("what the deformer Blended does", bar)


class BadInput(SceneCase):
    def test_no_handle(self):
        bar = support.make_bar()
        bar.exemplar.deformer = "BLENDED"
        self.assertFails("Add handles", bpy.ops.exemplar.bind)

    def test_all_exemplars_off(self):
        bar, _ = make(bind=False)
        support.activate(bar)
        bpy.ops.exemplar.exemplar_switch_all(enabled=False)
        bpy.ops.exemplar.bind()
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 1)

    def test_identical_exemplars(self):
        first, one = make("One", poses={"Bend": support.pose_bend})
        second, two = make("Two", poses={"Bend": support.pose_bend, "Copy": support.pose_bend})
        for empties in (one, two):
            empties[2].location = (0.6, 0, 2.1)
        support.update()
        self.assertEqual(support.problem(second), "")
        texts = " ".join(line.text for line in status.describe(second))
        self.assertIn("are the same shape", texts)
        self.assertClose(support.visible(second), support.visible(first), 0.05)

    def test_weights_need_a_skeleton(self):
        bar, _ = make()
        support.activate(bar)
        self.assertFails("dictionary Skeleton", bpy.ops.exemplar.skin_to_groups)

    def test_weights_need_blended(self):
        bar, _ = support.make_rig()
        support.activate(bar)
        self.assertFails("deformer Blended", bpy.ops.exemplar.skin_to_groups)

    def test_one_pinned_handle_leaves_turns_open(self):
        bar = support.make_bar()
        bar.exemplar.deformer = "BLENDED"
        empty = support.add_handle(bar, level(0))
        bpy.ops.exemplar.bind()
        texts = [line.text for line in status.describe(bar)]
        self.assertTrue(any("leave turn" in text for text in texts), texts)
        self.assertNotIn("Tolerance", " ".join(texts))
        empty.location.x += 1
        support.update()
        self.assertClose(support.visible(bar)[level(0)].mean(axis=0), (1, 0, 0), 1e-3)


if __name__ == "__main__":
    support.run(globals())
