# SPDX-License-Identifier: GPL-3.0-or-later
"""The native library missing, of another version, for another machine: each is said in words, and
the add-on registers all the same."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from unittest import mock

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, blender_addon  # noqa: E402
from blender_addon.native import LibraryError, library  # noqa: E402
from blender_addon.scene import status  # noqa: E402

loader = sys.modules["blender_addon.native.library"]

ANOTHER_VERSION = """
unsigned exm_abi_version(void) { return 4711; }
const char *exm_version(void) { return "9.8.7"; }
"""


class Library(SceneCase):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = Path(folder.name) / loader.file_name()

    def fails(self, *parts):
        """Loading says all of `parts`; so do the panel and Bind."""
        bar, _ = support.make_rig(bind=False)
        patches = (
            mock.patch.dict(os.environ, {loader.VARIABLE: str(self.file)}),
            mock.patch.object(loader, "bundled_path", lambda: Path("/nowhere")),
            mock.patch.object(loader, "_loaded", None),
            mock.patch.object(status, "_library_checked", (0.0, None)),
        )
        for patch in patches:
            patch.start()
            self.addCleanup(patch.stop)
        with self.assertRaises(LibraryError) as caught:
            library()
        for part in parts:
            self.assertIn(part, str(caught.exception))
        blender_addon.unregister()
        blender_addon.register()
        self.assertEqual(status.describe(bar)[0].text, str(caught.exception))
        self.assertFails(parts[0], bpy.ops.exemplar.bind)
        support.update()

    def test_missing_where_the_variable_says(self):
        self.fails(str(self.file), loader.VARIABLE)

    def test_missing_altogether(self):
        with mock.patch.object(loader, "_newest_build", lambda folder: None):
            with mock.patch.object(loader, "bundled_path", lambda: self.file):
                with mock.patch.dict(os.environ):
                    os.environ.pop(loader.VARIABLE, None)
                    self.assertFails(str(self.file), loader.find)

    def test_another_version(self):
        source = self.file.with_suffix(".c")
        source.write_text(ANOTHER_VERSION)
        subprocess.run(["gcc", "-shared", "-fPIC", source, "-o", self.file], check=True)
        self.fails("9.8.7", "interface 4711", "needs interface 1")

    def test_another_machine(self):
        binary = bytearray(loader.library_path().read_bytes())
        binary[18:20] = (0xB7).to_bytes(2, "little")
        self.file.write_bytes(binary)
        self.fails("Linux on aarch64", f"this machine is {loader.this_machine()}")

    def test_another_system(self):
        self.file.write_bytes(b"MZ" + bytes(100))
        self.fails("was built for Windows")

    def test_cut_short(self):
        self.file.write_bytes(loader.library_path().read_bytes()[:5000])
        self.fails("cut short")

    def test_no_library_at_all(self):
        self.file.write_text("hello")
        self.fails("cannot be loaded")

    def test_some_other_library(self):
        shutil.copy(self._other_library(), self.file)
        self.fails("is not the Exemplar library")

    def _other_library(self):
        with open("/proc/self/maps") as maps:
            return next(line.split()[-1] for line in maps if re.search(r"libm\.so", line))


class Version(SceneCase):
    def test_stated_alike_everywhere(self):
        root = Path(support.ROOT)
        cmake = re.search(r"project\(\w+ VERSION ([\d.]+)", (root / "CMakeLists.txt").read_text())
        manifest = (root / "blender_addon" / "blender_manifest.toml").read_text()
        stated = re.search(r'^version = "([\d.]+)"', manifest, re.MULTILINE)
        self.assertEqual(stated[1], cmake[1])
        self.assertEqual(".".join(map(str, blender_addon.bl_info["version"])), cmake[1])
        self.assertEqual(library().exm_version().decode(), cmake[1])


if __name__ == "__main__":
    support.run(globals())
