# SPDX-License-Identifier: GPL-3.0-or-later
"""Blended in a real window: bound, dragged, interpolated, switched to another deformer."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402
import windows  # noqa: E402

STEPS = ("choose", "bind", "drag", "interpolate", "skin", "switch")


class Window(windows.WindowTests):
    script = "window_blended.py"
    size = (1280, 1100)
    timeout = 550

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)
        self.assertNotIn("Error", self.output.replace("EGL Error", ""))


windows.add_steps(Window, STEPS)

if __name__ == "__main__":
    support.run(globals())
