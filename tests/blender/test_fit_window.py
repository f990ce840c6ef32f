# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit to Scan in a real window: landmarks by clicks, progress, Esc."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402
import windows  # noqa: E402

STEPS = ("panel", "pick", "escape", "fit", "undo")


class Window(windows.WindowTests):
    script = "window_fit.py"
    size = (1280, 1100)
    timeout = 400

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)
        self.assertNotIn("Error", self.output.replace("EGL Error", ""))


windows.add_steps(Window, STEPS)

if __name__ == "__main__":
    support.run(globals())
