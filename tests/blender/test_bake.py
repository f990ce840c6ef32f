# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes play what was solved, without the add-on; and a bake that fails or is cancelled changes
nothing."""

import json
import os
import resource
import signal
import sys
import tempfile
import unittest
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(__file__))
import bake_support  # noqa: E402
from bake_support import FIRST, LAST  # noqa: E402
import support  # noqa: E402

addon = bake_support.load_addon()
bakers = addon("scene.baking.bakers")
bindings = addon("scene.bindings")
errors = addon("scene.baking.errors")
job = addon("scene.baking.job")
mdd = addon("scene.baking.mdd")
pc2 = addon("scene.baking.pc2")
playback = addon("scene.baking.playback")
native = addon("native")

FORMATS = ("PC2", "MDD", "SHAPE_KEYS", "WEIGHTS")


class BarCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.bar = bake_support.make_bar(addon)
        self.scene = bpy.context.scene

    def tearDown(self):
        bindings.clear()

    def settings(self, kind, **changes):
        options = {"format": kind, "start": FIRST, "end": LAST, "filepath": self.path(kind)}
        return job.Settings(**{**options, **changes})

    def path(self, kind):
        return str(self.folder / f"bar.{kind.lower()}")

    def run_job(self, settings):
        return job.run(self.bar, self.scene, bpy.context.view_layer, settings)

    def bake(self, kind, **changes):
        """The Result of a whole bake."""
        steps = self.run_job(self.settings(kind, **changes))
        while True:
            try:
                next(steps)
            except StopIteration as stop:
                return stop.value

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())

    def play_elsewhere(self, expected, name="Bar"):
        """Largest differences in another Blender that has no add-on."""
        blend, data = self.folder / "baked.blend", self.folder / "expected.npz"
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
        np.savez(data, frames=list(expected), positions=np.stack(list(expected.values())))
        script = Path(__file__).with_name("play_bake.py")
        done = bake_support.blender(
            "--factory-startup", blend, "--python", script, "--", name, data
        )
        line = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
        self.assertTrue(line, done.stdout + done.stderr)
        return json.loads(line[0].removeprefix("RESULT "))


class PlaysWithoutTheAddon(BarCase):
    def check(self, kind, frames, tolerance=1e-6, between=2e-6, **changes):
        before = bake_support.artists_data(self.bar)
        expected = bake_support.solved(addon, self.bar, frames)
        moved = max(np.abs(p - expected[frames[0]]).max() for p in expected.values())
        self.assertGreater(moved, 0.1, "the test's own animation stands still")
        self.bake(kind, start=frames.start, end=frames[-1], step=frames.step, **changes)
        played = self.play_elsewhere(expected)
        self.assertLess(played["on"], tolerance)
        self.assertLess(played["between"], between)
        after = bake_support.artists_data(self.bar)
        self.assertEqual({name: after[name] for name in before}, before)

    def test_pc2(self):
        self.check("PC2", range(FIRST, LAST + 1))

    def test_mdd(self):
        self.check("MDD", range(FIRST, LAST + 1))

    def test_pc2_every_third_frame_from_before_zero(self):
        self.check("PC2", range(-4, 12, 3), between=1e-4)

    def test_mdd_every_other_frame_from_five(self):
        self.check("MDD", range(5, 12, 2))

    def test_shape_keys(self):
        self.check("SHAPE_KEYS", range(FIRST, LAST + 1))

    def test_shape_keys_every_third_frame_from_before_zero(self):
        self.check("SHAPE_KEYS", range(-4, 12, 3))

    def test_sliders_that_the_artist_has_moved_do_not_add(self):
        self.bar.data.shape_keys.key_blocks["Fat"].value = 0.7
        for kind in ("PC2", "SHAPE_KEYS"):
            with self.subTest(kind):
                self.check(kind, range(FIRST, 6))

    def test_one_bake_after_another_and_a_modifier_of_the_artist(self):
        """Each takes the place of the one before it, at the head of the stack."""
        self.bar.modifiers.new("Array", "ARRAY").count = 1
        for kind in ("SHAPE_KEYS", "PC2", "WEIGHTS", "SHAPE_KEYS", "MDD"):
            self.bake(kind)
        names = [modifier.name for modifier in self.bar.modifiers]
        self.assertEqual(names, ["Exemplar Bake", "Array"])
        self.check("SHAPE_KEYS", range(2, 9))
        baked = [k.name for k in self.bar.data.shape_keys.key_blocks if k.name[-1].isdigit()]
        self.assertEqual(baked, [f"Exemplar {frame:04d}" for frame in range(2, 9)])
        self.check("PC2", range(2, 9))

    def test_result_in_a_separate_object(self):
        self.bar.exemplar.target = "OBJECT"
        bake_support.bind(addon, self.bar)
        shown = self.bar.exemplar.result_object
        expected = bake_support.solved(addon, self.bar, range(FIRST, 6))
        for kind in ("PC2", "SHAPE_KEYS"):
            with self.subTest(kind):
                self.bake(kind, end=5)
                self.assertLess(self.play_elsewhere(expected, shown.name)["on"], 1e-6)

    def test_weights(self):
        """What the other Blender shows is the blend of keys that was fitted."""
        frames = range(FIRST, LAST + 1)
        result = self.bake("WEIGHTS")
        fitted = {}
        for frame in frames:
            self.scene.frame_set(frame)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            fitted[frame] = bake_support.evaluated_positions(self.bar, depsgraph)
        self.assertLess(self.play_elsewhere(fitted)["on"], 1e-6)
        self.check_misfit(fitted, result.misfit)

    def check_misfit(self, fitted, misfit):
        """The reported error is the distance between what plays and what was solved."""
        expected = bake_support.solved(addon, self.bar, fitted)
        distances = {f: np.linalg.norm(fitted[f] - expected[f], axis=1) for f in fitted}
        rest = np.array([vertex.co for vertex in self.bar.data.vertices])
        diagonal = np.linalg.norm(np.ptp(rest, axis=0))
        rms = np.sqrt(np.mean(np.square(list(distances.values())))) / diagonal
        largest = max(d.max() for d in distances.values()) / diagonal
        self.assertAlmostEqual(misfit.rms, rms, places=5)
        self.assertAlmostEqual(misfit.largest, largest, places=5)
        worst = max(distances, key=lambda frame: distances[frame].max())
        self.assertEqual(misfit.worst_frame, worst)


class Files(BarCase):
    def test_headers_say_what_was_baked(self):
        self.scene.render.fps, self.scene.render.fps_base = 30, 1.001
        self.bake("PC2", start=3, end=9, step=3)
        self.bake("MDD", start=3, end=9, step=3)
        header, samples = pc2.read(self.path("PC2"))
        count = len(self.bar.data.vertices)
        self.assertEqual(header, pc2.Header(count, 3, 3.0, 3.0))
        mdd_header, mdd_samples = mdd.read(self.path("MDD"))
        np.testing.assert_allclose(mdd_header.times, np.arange(3) * 3 * 1.001 / 30, rtol=1e-6)
        self.assertEqual(samples.tobytes(), mdd_samples.tobytes())

    def test_default_path_is_named_after_the_object_beside_the_file(self):
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "scene.blend"))
        self.bar.name = "Bar: 1"
        result = self.bake("PC2", filepath="")
        self.assertEqual(Path(result.filepath).parent, self.folder)
        self.assertTrue(os.path.isfile(result.filepath))
        stored = self.bar.modifiers["Exemplar Bake"].filepath
        self.assertTrue(stored.startswith("//"), stored)

    def test_ending_follows_the_format(self):
        cases = {
            ("PC2", "//a.mdd"): "//a.pc2",
            ("MDD", "//a.PC2"): "//a.mdd",
            ("PC2", "//a.v2"): "//a.v2.pc2",
            ("PC2", "//a.PC2"): "//a.PC2",
            ("MDD", "//a"): "//a.mdd",
        }
        for (kind, path), expected in cases.items():
            settings = self.settings(kind, filepath=path)
            self.assertEqual(bakers.default_path(self.bar, settings), expected)

    def test_relative_path_in_a_file_that_was_never_saved(self):
        with self.assertRaises(errors.SettingsError) as caught:
            self.bake("PC2", filepath="//bar.pc2")
        self.assertIn("not been saved", str(caught.exception))

    def test_without_a_modifier_the_object_is_left_alone(self):
        before = bake_support.scene_state(self.bar)
        self.bake("PC2", use_modifier=False, stop_live=False)
        self.assertEqual(bake_support.scene_state(self.bar), before)


class ChangesNothing(BarCase):
    """Cancelled or failed, the previous file and the scene are as they were."""

    def setUp(self):
        super().setUp()
        for kind in ("PC2", "MDD"):
            Path(self.path(kind)).write_bytes(b"before")
        self.scene.frame_set(4, subframe=0.5)
        self.before = bake_support.scene_state(self.bar)

    def assert_nothing_changed(self):
        self.assertEqual(bake_support.scene_state(self.bar), self.before)
        self.assertEqual(self.files(), ["bar.mdd", "bar.pc2"])
        for kind in ("PC2", "MDD"):
            self.assertEqual(Path(self.path(kind)).read_bytes(), b"before")

    def test_cancelled(self):
        for kind in FORMATS:
            for turns in (1, 5):
                with self.subTest(kind, turns=turns):
                    steps = self.run_job(self.settings(kind))
                    for _ in range(turns):
                        next(steps)
                    steps.close()
                    self.assert_nothing_changed()

    def test_solve_that_fails_on_a_frame(self):
        for frame, scale in ((1, 1.0), (5, 1.0), (6, 0.0)):
            self.bar.scale = (scale, scale, scale)
            self.bar.keyframe_insert("scale", frame=frame)
        self.scene.frame_set(4, subframe=0.5)
        self.before = bake_support.scene_state(self.bar)
        for kind in FORMATS:
            with self.subTest(kind):
                with self.assertRaises(native.ExemplarError) as caught:
                    self.bake(kind)
                self.assertIn("scaled to nothing", str(caught.exception))
                self.assert_nothing_changed()

    def test_empty_that_was_deleted(self):
        bpy.data.objects.remove(self.bar.exemplar.handles[1].empty)
        self.before = bake_support.scene_state(self.bar)
        for kind in FORMATS:
            with self.subTest(kind), self.assertRaises(native.ExemplarError):
                self.bake(kind)
            self.assert_nothing_changed()

    def test_disk_full(self):
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (5000, limits[1]))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_FSIZE, limits)
        for kind in ("PC2", "MDD"):
            with self.subTest(kind):
                with self.assertRaises(errors.WriteError) as caught:
                    self.bake(kind)
                self.assertIn(self.path(kind), str(caught.exception))
                self.assertIn("18.8 kB", str(caught.exception))
                self.assert_nothing_changed()

    def test_settings_that_make_no_sense(self):
        for changes in ({"start": 5, "end": 4}, {"step": 0}, {"end": 2_000_000}):
            for kind in FORMATS:
                with self.subTest(kind, **changes):
                    with self.assertRaises(errors.SettingsError):
                        self.bake(kind, **changes)
                    self.assert_nothing_changed()
        with self.assertRaises(errors.SettingsError):
            self.bake("OBJ")

    def test_value_that_has_a_driver(self):
        self.bar.data.shape_keys.key_blocks["Bend"].driver_add("value")
        self.before = bake_support.scene_state(self.bar)
        with self.assertRaises(errors.SettingsError) as caught:
            self.bake("WEIGHTS")
        self.assertIn("Bend", str(caught.exception))
        self.assert_nothing_changed()

    def test_absolute_keys(self):
        self.bar.data.shape_keys.use_relative = False
        for kind in ("SHAPE_KEYS", "WEIGHTS"):
            with self.assertRaises(native.ExemplarError):
                self.bake(kind)
        self.assert_nothing_changed()


class Weights(BarCase):
    def curves(self):
        """{key name: [(frame, value)]}"""
        key = self.bar.data.shape_keys
        found = addon("scene.versions").find_curves(key) or ()
        return {
            curve.data_path.split('"')[1]: [tuple(point.co) for point in curve.keyframe_points]
            for curve in found
        }

    def test_positions_that_come_from_sliders_give_the_sliders_back(self):
        blocks = self.bar.data.shape_keys.key_blocks
        blocks["Bend"].slider_min, blocks["Fat"].slider_max = -0.5, 2.0
        blocks["Twist"].relative_key = blocks["Fat"]
        blocks["Bend"].vertex_group = "Half"
        half = self.bar.vertex_groups.new(name="Half")
        for vertex in range(40, 130):
            half.add([vertex], 0.01 * (vertex - 30) * 0.9, "REPLACE")
        blocks[self.bar.exemplar.result_key].mute = True
        random = np.random.default_rng(5)
        known = {"Bend": (-0.5, 1.0), "Fat": (0.0, 2.0), "Twist": (0.0, 1.0)}
        frames = range(3, 13, 3)
        values = {n: random.uniform(*r, len(frames)).astype(np.float32) for n, r in known.items()}
        values["Bend"][0], values["Fat"][1], values["Twist"][2] = -0.5, 2.0, 0.0
        samples = []
        for index in range(len(frames)):
            for name, row in values.items():
                blocks[name].value = row[index]
            depsgraph = bpy.context.evaluated_depsgraph_get()
            samples.append(bake_support.evaluated_positions(self.bar, depsgraph))
        settings = self.settings("WEIGHTS")
        with bakers.WeightBaker(self.bar, self.scene, settings, frames) as baker:
            for sample in samples:
                baker.add(sample)
            baker.finish()
        found = self.curves()
        for name, row in values.items():
            self.assertEqual([frame for frame, _ in found[name]], list(frames))
            np.testing.assert_allclose([value for _, value in found[name]], row, atol=2e-6)
        self.assertLess(baker.misfit.largest, 1e-6)

    def test_values_stay_in_their_sliders(self):
        self.bar.data.shape_keys.key_blocks["Bend"].slider_max = 0.25
        self.bake("WEIGHTS")
        for name, points in self.curves().items():
            block = self.bar.data.shape_keys.key_blocks[name]
            for _, value in points:
                self.assertTrue(block.slider_min <= value <= block.slider_max, (name, value))

    def test_keyframes_of_the_artist_on_other_keys_stay(self):
        extra = self.bar.shape_key_add(name="Extra", from_mix=False)
        for frame, value in ((1, 0.0), (9, 1.0)):
            extra.value = value
            extra.keyframe_insert("value", frame=frame)
        self.bake("WEIGHTS")
        found = self.curves()
        self.assertEqual(found["Extra"], [(1.0, 0.0), (9.0, 1.0)])
        self.assertTrue(extra.mute, "it would add to the bake")
        self.assertEqual(set(found), {"Bend", "Fat", "Twist", "Extra"})

    def test_message_tells_the_error_and_where(self):
        result = self.bake("WEIGHTS")
        self.assertIn(f"frame {result.misfit.worst_frame}", result.message)
        self.assertIn(f"{result.misfit.rms:.2%}", result.message)


class BackToLive(BarCase):
    def test_every_format(self):
        for kind in FORMATS:
            with self.subTest(kind):
                before = bake_support.artists_data(self.bar)
                self.bake(kind)
                self.assertFalse(self.bar.exemplar.live)
                self.assertEqual(playback.is_baked(self.bar), kind != "WEIGHTS")
                playback.remove(self.bar)
                self.assertTrue(self.bar.exemplar.live)
                self.assertFalse(playback.is_baked(self.bar))
                self.assertEqual(bake_support.artists_data(self.bar), before)
                self.assertNotIn("Exemplar Bake", self.bar.modifiers)
                expected = bake_support.solved(addon, self.bar, [7])[7]
                self.scene.frame_set(7)
                depsgraph = bpy.context.evaluated_depsgraph_get()
                seen = bake_support.evaluated_positions(self.bar, depsgraph)
                self.assertLess(np.abs(seen - expected).max(), 1e-6)
                self.scene.frame_set(FIRST)

    def test_baked_keys_are_no_exemplars(self):
        names = set(addon("scene.exemplars").enabled_names(self.bar))
        self.bake("SHAPE_KEYS")
        self.assertEqual(set(addon("scene.exemplars").enabled_names(self.bar)), names)
        bake_support.bind(addon, self.bar)
        self.assertEqual(set(addon("scene.fingerprint").names(self.bar)), names)


class Operator(BarCase):
    def test_options_as_from_a_script(self):
        path = self.path("PC2")
        done = bpy.ops.exemplar.bake(
            format="PC2", filepath=path, use_scene_range=False, frame_start=2, frame_end=8,
            frame_step=2,
        )  # fmt: skip
        self.assertEqual(done, {"FINISHED"})
        header, _ = pc2.read(path)
        self.assertEqual((header.start, header.sampling, header.sample_count), (2.0, 2.0, 4))

    def test_scene_range_is_the_default(self):
        bpy.ops.exemplar.bake(format="MDD", filepath=self.path("MDD"))
        self.assertEqual(len(mdd.read(self.path("MDD"))[1]), LAST - FIRST + 1)

    def test_what_fails_is_reported(self):
        with self.assertRaisesRegex(RuntimeError, "there is no folder"):
            bpy.ops.exemplar.bake(format="PC2", filepath=str(self.folder / "no" / "a.pc2"))

    def test_refuses_what_is_not_bound(self):
        addon("scene.setup").unbind(self.bar)
        self.assertFalse(bpy.ops.exemplar.bake.poll())

    def test_remove(self):
        bpy.ops.exemplar.bake(format="PC2", filepath=self.path("PC2"))
        self.assertEqual(bpy.ops.exemplar.bake_remove(), {"FINISHED"})
        self.assertTrue(self.bar.exemplar.live)


if __name__ == "__main__":
    support.run(globals())
