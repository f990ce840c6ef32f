# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of baking share. They run inside Blender:

    blender -b --factory-startup --python tests/blender/test_bake.py
"""

import contextlib
import os
import subprocess
import sys
import traceback
import unittest
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
COMMAND_LINE = ROOT / "blender_addon" / "command_line.py"


def load_addon():
    """A function that imports modules of the add-on of this source tree."""
    if str(COMMAND_LINE.parent) not in sys.path:
        sys.path.append(str(COMMAND_LINE.parent))
    import command_line

    return command_line.load_addon()


def run(name):
    """Run the tests of a module and leave Blender with what came of it."""
    code = 1
    try:
        import command_line

        argv = [name, *(command_line.own_arguments() or ["-v"])]
        program = unittest.main(name, argv=argv, exit=False)
        code = 0 if program.result.wasSuccessful() else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


@contextlib.contextmanager
def without_root():
    """Root may write anywhere; nobody may not."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def random_bounded_problem(random, trial):
    """(matrix, right, lower, upper, start): tall and wide, equal and empty columns, shut bounds."""
    columns, rows = random.integers(1, 30), random.integers(1, 90)
    matrix = random.normal(size=(rows, columns))
    if trial % 5 == 0:
        matrix[:, columns // 2] = matrix[:, 0]
    if trial % 7 == 0 and columns > 1:
        matrix[:, -1] = 0.0
    lower = random.uniform(-1.0, 0.0, columns)
    upper = lower + random.uniform(0.0, 1.5, columns) * (random.random(columns) > 0.1)
    right = matrix @ random.uniform(-1.5, 1.5, columns) + 0.1 * random.normal(size=rows)
    start = random.uniform(-2.0, 2.0, columns) if trial % 3 == 0 else None
    return matrix, right, lower, upper, start


def blender(*arguments, env=None, prefix=()):
    """Run another Blender, background and factory settings; returns the finished process."""
    import bpy

    command = [*prefix, bpy.app.binary_path, "-b", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=env, timeout=300)


def evaluated_positions(obj, depsgraph):
    """float32 [V][3], after modifiers."""
    mesh = obj.evaluated_get(depsgraph).data
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", positions.ravel())
    return positions
