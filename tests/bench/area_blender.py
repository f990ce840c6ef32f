# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: a step of a drag of the add-on beside the evaluation of it by Blender, and the
modifier Laplacian Deform on frames of the same drag on the same mesh.
"""

import shutil
import tempfile
from pathlib import Path

import numpy

import inputs
import peers
from area_amrap import TABLE_1
from characters import Drag, bind, drag_of, native
from inputs import Missing
from measure import Worker, interleave

ROW = "blender/laplacian_deform/frame"
LIVE = "blender/live_50k/frame"
LIVE_SCRIPT = Path(__file__).with_name("blender_live.py")
SCRIPT = Path(__file__).with_name("blender_laplacian.py")


def run(bench):
    bench.run([ROW], _measure)
    bench.run([LIVE], _measure_live)


def _measure_live(bench):
    blender = shutil.which("blender")
    if blender is None:
        raise Missing("blender is not installed")
    arguments = ["-b", "--factory-startup", "-t", "1", "--python-exit-code", "3"]
    with Worker(blender, *arguments, "--python", LIVE_SCRIPT, "--", "asked") as worker:
        frames = numpy.array([worker.ask("frame") for _ in range(60)])
    ours, rest = 1000 * numpy.median(frames, axis=0)
    notes = (
        "50 000 vertices, 8 shape keys, 10 handles; ours: the handler of one step of a drag; "
        "the target is 4 ms"
    )
    bench.add(LIVE, ours, rest, "ms", "Blender's own evaluation of that frame", notes)


def _measure(bench):
    blender = shutil.which("blender")
    if blender is None:
        raise Missing("blender is not installed")
    handle_count, shape_count, *_ = TABLE_1["horse"]
    character = inputs.real("horse", handle_count, shape_count)
    deformer = bind(character)
    targets = drag_of(deformer, character, 200)
    drag = Drag(deformer, targets, native.Start.WARM)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "laplacian.npz"
        numpy.savez(
            file,
            positions=character.positions,
            triangles=character.triangles,
            offsets=numpy.cumsum([0, *map(len, character.handles)]),
            vertices=numpy.concatenate(character.handles),
            displacements=peers.displacements(character, targets),
        )
        arguments = ["-b", "--factory-startup", "-t", "1", "--python-exit-code", "3"]
        with Worker(blender, *arguments, "--python", SCRIPT, "--", file) as worker:
            hooks = worker.ask("hooks")[0]
            ours, peer = interleave(
                bench.repeats(60, 15),
                drag.frame_with_positions,
                worker.seconds("frame"),
                burst=5,
            )
    notes = (
        "horse, 10 handles; ours: warm solve and positions of one frame; the peer's frame with "
        f"hooks alone takes {hooks * 1e3:.3g} ms"
    )
    bench.add(ROW, ours * 1e3, peer * 1e3, "ms", "Blender's Laplacian Deform", notes)
