# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: what it makes, and what each exit code means."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(__file__))
import bake_support  # noqa: E402
from bake_support import COMMAND_LINE, FIRST, LAST  # noqa: E402
import support  # noqa: E402

addon = bake_support.load_addon()
bindings = addon("scene.bindings")
mdd = addon("scene.baking.mdd")
pc2 = addon("scene.baking.pc2")

FRAMES = f"{FIRST}-{LAST}"


class CommandLine(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.blend = cls.folder / "scene.blend"
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bar = bake_support.make_bar(addon)
        cls.expected = bake_support.solved(addon, bar, range(FIRST, LAST + 1))
        loose = bpy.data.objects.new("Loose", bpy.data.meshes.new("Loose"))
        bpy.context.collection.objects.link(loose)
        bpy.ops.wm.save_as_mainfile(filepath=str(cls.blend))
        bindings.clear()

    def setUp(self):
        self.out = self.folder / f"{self.id().rpartition('.')[2]}.pc2"

    def call(self, *arguments, blend=None, script=COMMAND_LINE, **options):
        """Exit code, standard output and errors of our command line in a clean Blender."""
        done = bake_support.blender(
            "--factory-startup",
            blend or self.blend,
            "--python",
            script,
            "--",
            *arguments,
            **options,
        )
        return done.returncode, done.stdout, done.stderr

    def assert_exit(self, code, words, *arguments, **options):
        found, out, err = self.call(*arguments, **options)
        self.assertEqual(found, code, out + err)
        self.assertIn(words, err)
        self.assertNotIn("Traceback", err)

    def bake(self, *arguments, **options):
        code, out, err = self.call("bake", "--object", "Bar", *arguments, **options)
        self.assertEqual(code, 0, out + err)
        return out

    # ------------------------------------------------------------------------------------ it works

    def test_pc2_is_the_stateless_solve(self):
        out = self.bake("--frames", FRAMES, "--out", self.out)
        header, samples = pc2.read(self.out)
        self.assertEqual((header.start, header.sampling), (FIRST, 1.0))
        for sample, expected in zip(samples, self.expected.values()):
            np.testing.assert_allclose(sample, expected, atol=1e-6)
        self.assertIn(f"Frame {LAST} ({LAST} of {LAST})", out)

    def test_hidden_handles_move_all_the_same(self):
        """What keeps them moving names a property that Blender does not know when it loads the
        file, for nobody has enabled the add-on."""
        hidden = self.folder / "hidden.blend"
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        for item in bpy.data.objects["Bar"].exemplar.handles:
            item.empty.hide_viewport = item.empty.hide_render = True
        bpy.ops.wm.save_as_mainfile(filepath=str(hidden))
        self.bake("--frames", FRAMES, "--out", self.out, blend=hidden)
        for sample, expected in zip(pc2.read(self.out)[1], self.expected.values()):
            np.testing.assert_allclose(sample, expected, atol=1e-6)

    def test_scene_range_and_format_from_the_ending(self):
        out = self.out.with_suffix(".mdd")
        text = self.bake("--out", out, "--quiet")
        self.assertEqual(len(mdd.read(out)[1]), LAST - FIRST + 1)
        self.assertNotIn("Frame 1 ", text)

    def test_step_and_negative_frames(self):
        self.bake("--frames=-4-5:3", "--out", self.out)
        header, _ = pc2.read(self.out)
        self.assertEqual((header.start, header.sampling, header.sample_count), (-4.0, 3.0, 4))

    def test_saved_blend_plays_without_the_addon(self):
        folder = self.folder / "moved"
        folder.mkdir(exist_ok=True)
        cases = {"pc2": ("--out", folder / "a.pc2"), "shape-keys": ("--format", "shape-keys")}
        for name, arguments in cases.items():
            with self.subTest(name):
                saved = folder / f"{name}.blend"
                self.bake(*arguments, "--frames", FRAMES, "--save-blend", saved)
                self.assertLess(self.play(saved), 1e-6)
        # File and cache keep together.
        elsewhere = self.folder / "elsewhere"
        shutil.move(folder, elsewhere)
        self.assertLess(self.play(elsewhere / "pc2.blend"), 1e-6)

    def play(self, blend):
        data = self.folder / "expected.npz"
        np.savez(data, frames=list(self.expected), positions=np.stack(list(self.expected.values())))
        script = Path(__file__).with_name("play_bake.py")
        done = bake_support.blender(
            "--factory-startup", blend, "--python", script, "--", "Bar", data
        )
        line = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
        self.assertTrue(line, done.stdout + done.stderr)
        return json.loads(line[0].removeprefix("RESULT "))["on"]

    def test_weights(self):
        saved = self.folder / "weights.blend"
        out = self.bake("--format", "weights", "--frames", FRAMES, "--save-blend", saved)
        self.assertIn("3 shape keys", out)
        self.assertTrue(saved.is_file())

    def test_list(self):
        code, out, _ = self.call("list")
        self.assertEqual(code, 0)
        self.assertIn("Bar: 3 handles", out)
        code, out, _ = self.call("list", "--json")
        rows = json.loads(next(line for line in out.splitlines() if line.startswith("[")))
        self.assertEqual([row["object"] for row in rows], ["Bar"])
        self.assertEqual(rows[0]["handles"], 3)

    def test_help(self):
        for arguments in (("--help",), ("bake", "--help")):
            code, out, _ = self.call(*arguments)
            self.assertEqual(code, 0)
            self.assertIn("usage:", out)

    def test_in_a_blender_that_has_the_addon_enabled(self):
        """Not registered twice, and not taken from another place."""
        scripts = self.folder / "scripts"
        (scripts / "addons").mkdir(parents=True)
        (scripts / "addons" / "exemplar").symlink_to(COMMAND_LINE.parent)
        env = {**os.environ, "BLENDER_USER_SCRIPTS": str(scripts)}
        done = bake_support.blender(
            "--factory-startup", "--addons", "exemplar", self.blend,
            "--python", COMMAND_LINE, "--", "bake", "--object", "Bar", "--out", self.out,
            env=env,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertNotIn("registered before", done.stdout + done.stderr)
        self.assertTrue(self.out.is_file())

    # ---------------------------------------------------------------------------------- exit codes

    def test_2_usage(self):
        self.assert_exit(2, "required: COMMAND")
        self.assert_exit(2, "--object", "bake")
        self.assert_exit(2, "needs --out", "bake", "--object", "Bar")
        self.assert_exit(2, "A-B", "bake", "--object", "Bar", "--frames", "x", "--out", self.out)
        self.assert_exit(
            2, "--save-blend", "bake", "--object", "Bar", "--format", "weights"
        )  # fmt: skip

    def test_2_what_cannot_be_baked(self):
        self.assert_exit(
            2, "comes before", "bake", "--object", "Bar", "--frames", "9-1", "--out", self.out
        )
        self.assertFalse(self.out.exists())

    def test_3_no_such_object_or_not_bound(self):
        self.assert_exit(3, "no object 'Nobody'", "bake", "--object", "Nobody", "--out", self.out)
        self.assert_exit(3, "'Loose' is not bound", "bake", "--object", "Loose", "--out", self.out)
        self.assert_exit(
            3, "scene 'Other'", "bake", "--object", "Bar", "--scene", "Other", "--out", self.out
        )

    def test_4_solve_failed(self):
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        bar = bpy.data.objects["Bar"]
        bpy.data.objects.remove(bar.exemplar.handles[0].empty)
        broken = self.folder / "broken.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(broken))
        self.out.write_bytes(b"before")
        self.assert_exit(
            4, "was deleted", "bake", "--object", "Bar", "--out", self.out, blend=broken
        )
        self.assertEqual(self.out.read_bytes(), b"before")

    def test_5_cannot_write(self):
        missing = self.folder / "missing" / "a.pc2"
        self.assert_exit(5, str(missing), "bake", "--object", "Bar", "--out", missing)
        self.assert_exit(
            5, "Cannot save", "bake", "--object", "Bar", "--out", self.out,
            "--save-blend", self.folder / "missing" / "a.blend",
        )  # fmt: skip

    def test_5_disk_full(self):
        """A disk of 16 kB."""
        disk = self.folder / "disk"
        disk.mkdir()
        out = disk / "a.pc2"
        code, text, err = self.call(
            "bake", "--object", "Bar", "--frames", FRAMES, "--out", out, prefix=_small_disk(disk)
        )
        self.assertEqual(code, 5, text + err)
        self.assertIn(str(out), err)
        self.assertIn("18.8 kB", err)
        self.assertNotIn(".part", text)
        self.assertNotIn("\na.pc2", text)

    def test_6_no_library(self):
        copy = self.folder / "copy" / "exemplar"
        shutil.copytree(
            COMMAND_LINE.parent, copy, ignore=shutil.ignore_patterns("lib", "__pycache__")
        )
        env = {**os.environ, "EXEMPLAR_LIBRARY": ""}
        script = copy / "command_line.py"
        self.assert_exit(
            6, "library is missing", "bake", "--object", "Bar", "--out", self.out,
            script=script, env=env,
        )  # fmt: skip

    def test_143_terminated(self):
        """As a farm ends a job: no half file, no file left beside it."""
        folder = self.folder / "ended"
        folder.mkdir()
        out = folder / "a.pc2"
        command = [bpy.app.binary_path, "-b", "--factory-startup", str(self.blend)]
        command += ["--python", str(COMMAND_LINE), "--", "bake", "--object", "Bar"]
        command += ["--frames", "1-100000", "--out", str(out)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            for line in process.stdout:
                if line.startswith(b"Frame 3 "):
                    break
            self.assertEqual(len(list(folder.iterdir())), 1)
            process.send_signal(signal.SIGTERM)
            began = time.monotonic()
            _, errors = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 143, errors)
            self.assertLess(time.monotonic() - began, 20)
        self.assertEqual(list(folder.iterdir()), [])


def _small_disk(folder):
    """A command that runs another one with a very small disk at `folder`, and lists it at the end:
    the disk is there for that command only."""
    mount = f"mount -t tmpfs -o size=16k none '{folder}'"
    if subprocess.run(["unshare", "-rm", "sh", "-c", mount], capture_output=True).returncode:
        raise unittest.SkipTest("this user may not mount a small disk")
    within = f"""{mount} && "$@"; code=$?; ls -A '{folder}'; exit $code"""
    return ("unshare", "-rm", "sh", "-c", within, "sh")


if __name__ == "__main__":
    support.run(globals())
