# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences in a real window, under Xvfb: what only an event loop and a screen show."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402
import windows  # noqa: E402

STEPS = (
    "capture",
    "shapes_are_drawn",
    "drag_point",
    "undo_in_edit_mode",
    "drag_mark",
    "undo_of_mark",
    "playhead",
    "retime",
    "escape",
)


class Window(windows.WindowTests):
    script = "window_sequence.py"
    size = (1280, 1000)
    timeout = 850

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)
        self.assertNotIn("Error", self.output.replace("EGL Error", ""))

    def test_order_of_dependencies(self):
        self.assertNotIn("Dependency cycle", self.output)


windows.add_steps(Window, STEPS)

if __name__ == "__main__":
    support.run(globals())
