# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on in a real window, under Xvfb: what only an event loop shows."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402
import windows  # noqa: E402

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


class Window(windows.WindowTests):
    script = "window_addon.py"
    size = (1280, 1100)
    timeout = 550

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)
        self.assertNotIn("Error", self.output.replace("EGL Error", ""))

    def test_order_of_dependencies(self):
        self.assertNotIn("Dependency cycle", self.output)


windows.add_steps(Window, STEPS)

if __name__ == "__main__":
    support.run(globals())
