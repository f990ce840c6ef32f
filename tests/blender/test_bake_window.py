# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in a real window, under Xvfb: progress, Esc, undo."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402
import windows  # noqa: E402

STEPS = ("panel", "escape", "bake", "undo", "another_file")


class Window(windows.WindowTests):
    script = "window_bake.py"

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)


windows.add_steps(Window, STEPS)

if __name__ == "__main__":
    support.run(globals())
