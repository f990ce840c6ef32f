# SPDX-License-Identifier: GPL-3.0-or-later
"""A script in a Blender with a real window, under Xvfb: each of its steps becomes a test.

The script prints "ok STEP" for each step that held, and leaves screenshots in the folder that it
is given after "--".
"""

import fcntl
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import bpy
import support

SCREENSHOTS = Path(os.environ.get("EXEMPLAR_SCREENSHOTS", support.ROOT / "build" / "screenshots"))
# xvfb-run looks for a free display and then takes it: two that do so at once may take the same.
LOCK = Path(tempfile.gettempdir()) / "exemplar-xvfb.lock"


class WindowTests(unittest.TestCase):
    """Base of a test case; `script`, `size` and `timeout` are set by the file that derives it."""

    script = None
    size = (1280, 800)
    timeout = 300

    @classmethod
    def setUpClass(cls):
        if not shutil.which("xvfb-run"):
            raise unittest.SkipTest("xvfb-run is not installed")
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        width, height = map(str, cls.size)
        screen = f"-screen 0 {width}x{height}x24"
        command = ["xvfb-run", "-a", "-s", screen, bpy.app.binary_path]
        command += ["--factory-startup", "--enable-event-simulate", "--no-window-focus"]
        command += ["--window-geometry", "0", "0", width, height, "--python"]
        command += [str(Path(__file__).with_name(cls.script)), "--", str(SCREENSHOTS)]
        with open(LOCK, "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            done = subprocess.run(command, capture_output=True, text=True, timeout=cls.timeout)
        cls.output = done.stdout + done.stderr

    def check_step(self, step):
        self.assertIn(f"ok {step}\n", self.output, self.output)


def add_steps(case, steps):
    """One test a step, so that a report says which of them failed."""
    for step in steps:
        setattr(case, f"test_{step}", lambda self, step=step: self.check_step(step))
