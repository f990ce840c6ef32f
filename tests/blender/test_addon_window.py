# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on in a real window, under Xvfb: what only an event loop shows."""

import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402

SCREENSHOTS = Path(os.environ.get("EXEMPLAR_SCREENSHOTS", support.ROOT / "build" / "screenshots"))
STEPS = (
    "open",
    "bind",
    "drag",
    "undo",
    "edit_mode",
    "playback",
    "render",
    "deleted_empty",
    "escape",
)


class Window(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if not shutil.which("xvfb-run"):
            raise unittest.SkipTest("xvfb-run is not installed")
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        command = ["xvfb-run", "-a", "-s", "-screen 0 1280x1100x24", bpy.app.binary_path]
        command += ["--factory-startup", "--enable-event-simulate", "--no-window-focus"]
        command += ["--window-geometry", "0", "0", "1280", "1100", "--python"]
        command += [str(Path(__file__).with_name("window_addon.py")), "--", str(SCREENSHOTS)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=550)
        cls.output = done.stdout + done.stderr

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)
        self.assertNotIn("Error", self.output.replace("EGL Error", ""))

    def test_order_of_dependencies(self):
        self.assertNotIn("Dependency cycle", self.output)


def _test_of(step):
    def test(self):
        self.assertIn(f"ok {step}\n", self.output, self.output)

    return test


for _step in STEPS:
    setattr(Window, f"test_{_step}", _test_of(_step))


if __name__ == "__main__":
    support.run(globals())
