# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in a real window, by clicks on its buttons."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))
import support  # noqa: E402
import windows  # noqa: E402

STEPS = ("add", "bind", "pose", "bake")


class Panel(windows.WindowTests):
    script = "window_panel.py"
    size = (1280, 1100)
    timeout = 590

    def test_no_traceback(self):
        self.assertNotIn("Traceback", self.output)


windows.add_steps(Panel, STEPS)

if __name__ == "__main__":
    support.run(globals())
