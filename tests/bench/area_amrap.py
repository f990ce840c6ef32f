# SPDX-License-Identifier: GPL-3.0-or-later
"""Bind, frame and positions on the paper's characters, and on a face with many shapes."""

import statistics
import subprocess
import sys
from pathlib import Path

import inputs
import peers
from characters import Drag, bind, bind_seconds, drag_of, native
from measure import clock, interleave, samples

# [AMRAP, table 1]: handles, shapes, seconds of precomputation, seconds of one iteration
TABLE_1 = {"horse": (10, 3, 30, 0.05), "lion": (7, 6, 5, 0.15), "cat": (7, 6, 8, 0.15)}
FACE_HANDLES, FACE_SHAPES = 100, 30
BURST = 10


def run(bench):
    for name in TABLE_1:
        rows = [
            f"amrap/{name}/{row}"
            for row in (
                "frame_warm",
                "frame_warm_cgal",
                "frame_stateless",
                "frame_stateless_cgal",
                "positions",
                "bind",
                "bind_cgal",
            )
        ]
        bench.run(rows, lambda bench, name=name: _character(bench, name))
    face = [f"amrap/face100x30/{row}" for row in ("frame", "frame_stateless", "memory")]
    bench.run(face, _face)


def _character(bench, name):
    handle_count, shape_count, precomputation, iteration = TABLE_1[name]
    character = inputs.real(name, handle_count, shape_count)
    deformer = bind(character)
    targets = drag_of(deformer, character, 200)
    _frames(bench, name, character, deformer, targets, iteration)
    _positions(bench, name, character, deformer, targets)
    _bind(bench, name, character, targets, precomputation)


def _frames(bench, name, character, deformer, targets, iteration):
    frames = bench.repeats(200, 60)
    warm = Drag(deformer, targets, native.Start.WARM)
    stateless = Drag(bind(character), targets, native.Start.STATELESS)
    turns = [warm.solve, stateless.solve]
    with peers.cgal_arap(bench, character, targets) as cgal:
        if cgal:
            turns.append(cgal.seconds("iterate"))
        ours_warm, ours_stateless, *other = interleave(frames, *turns, burst=BURST)
    for mode, drag, ours in (
        ("warm", warm, ours_warm),
        ("stateless", stateless, ours_stateless),
    ):
        row = f"amrap/{name}/frame_{mode}"
        printed = f"AMRAP table 1: {iteration * 1e3:.0f} ms an iteration (printed)"
        bench.add(row, ours * 1e3, iteration * 1e3, "ms", printed, drag.notes(), is_printed=True)
        if other:
            bench.add(f"{row}_cgal", ours * 1e3, other[0] * 1e3, "ms", "CGAL ARAP, one iteration")


def _positions(bench, name, character, deformer, targets):
    if not bench.wants(f"amrap/{name}/positions"):
        return
    drag = Drag(deformer, targets, native.Start.WARM)
    products, worst = peers.products(character, deformer)
    ours, *others = interleave(
        bench.repeats(200, 40), drag.positions_of_next, *products.values(), burst=BURST
    )
    peer, peer_name = min(zip(others, products))
    notes = f"same positions to {worst:.1g} of the diagonal"
    bench.add(f"amrap/{name}/positions", ours * 1e3, peer * 1e3, "ms", peer_name, notes)


def _bind(bench, name, character, targets, precomputation):
    row = f"amrap/{name}/bind"
    if not bench.wants(row):
        return
    turns = [bind_seconds(character)]
    with peers.cgal_arap(bench, character, targets) as cgal:
        if cgal:
            turns.append(cgal.seconds("bind"))
        ours, *other = interleave(bench.repeats(5, 2), *turns)
    printed = f"AMRAP table 1: {precomputation} s of precomputation (printed)"
    bench.add(row, ours, precomputation, "s", printed, "weights included", is_printed=True)
    if other:
        bench.add(f"{row}_cgal", ours, other[0], "s", "CGAL ARAP up to preprocess(); no weights")


# -------------------------------------------------------------------------------- many shapes


def _face(bench):
    case = "amrap/face100x30"
    report = _face_in_own_process(bench.repeats(200, 20))
    budget = "target: 33 ms, thirty frames a second"
    for row, key in (("frame", "warm"), ("frame_stateless", "stateless")):
        notes = f"95 % of frames within {report[key + '_95'] * 1e3:.3g} ms"
        bench.add(f"{case}/{row}", report[key] * 1e3, 33, "ms", budget, notes, is_printed=True)
    bound = f"bound in {report['bind']:.3g} s; "
    notes = (
        f"{bound}peak of a process that binds and drags, {report['before']:.0f} MiB of it before"
    )
    bench.add(
        f"{case}/memory", report["peak"], 1024, "MiB", "target: 1 GiB", notes, is_printed=True
    )


def _face_in_own_process(frames):
    """The peak of memory is that of a process, so it has one to itself."""
    inputs.real("arkit_face", FACE_HANDLES, FACE_SHAPES, rings=0)  # or say what is missing
    command = [sys.executable, __file__, str(frames)]
    found = subprocess.run(command, capture_output=True, text=True)
    if found.returncode != 0:
        raise RuntimeError(found.stderr)
    words = found.stdout.split()
    return {key: float(value) for key, value in zip(words[::2], words[1::2])}


def _peak_mebibytes():
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    raise RuntimeError("no VmHWM in /proc/self/status")


def face_process(frames):
    character = inputs.real("arkit_face", FACE_HANDLES, FACE_SHAPES, rings=0)
    found = {"before": _peak_mebibytes()}
    start = clock()
    deformer = bind(character)
    found["bind"] = clock() - start
    targets = drag_of(deformer, character, frames)
    for key, start, count in (
        ("warm", native.Start.WARM, frames),
        ("stateless", native.Start.STATELESS, max(5, frames // 10)),
    ):
        drag = Drag(deformer, targets, start)
        (seconds,) = samples(count, drag.solve)
        drag.positions()
        found[key] = statistics.median(seconds)
        found[f"{key}_95"] = sorted(seconds)[int(0.95 * (count - 1))]
    found["peak"] = _peak_mebibytes()
    print(" ".join(f"{key} {value}" for key, value in found.items()))


if __name__ == "__main__":
    face_process(int(sys.argv[1]))
