# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of one file inside Blender, each in an empty scene: see tests/README.md.

    import os, sys
    sys.path.insert(0, os.path.dirname(__file__))
    import support  # noqa: E402

    def test_something(): ...

    if __name__ == "__main__":
        support.run(globals())
"""

import importlib.util
from pathlib import Path

import bpy


def _runner():
    """tests/python/support.py, which has this module's name."""
    path = Path(__file__).resolve().parents[1] / "python" / "support.py"
    spec = importlib.util.spec_from_file_location("exemplar_test_runner", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


_python = _runner()
ROOT, LIBRARY, data = _python.ROOT, _python.LIBRARY, _python.data


def reset():
    """An empty file with factory preferences; no add-on is enabled."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


def run(namespace):
    _python.run(namespace, before_each=reset)
