# SPDX-License-Identifier: GPL-3.0-or-later
"""How frame and bind grow with handles, shapes and vertices, on generated bars.

The peer of a row is the smallest row of its sweep, grown in proportion: a ratio above 1 says that
the cost grew less than the number did.
"""

import figure
import inputs
from characters import Drag, bind, bind_seconds, drag_of, native
from measure import interleave, samples

SWEEPS = {
    "handles": (2, 5, 10, 20, 50),
    "shapes": (1, 2, 4, 8, 16, 30),
    "vertices": (2000, 8000, 32000, 128000),
}
BASE = {"handles": 10, "shapes": 4, "vertices": 8000}
QUICK = {"handles": (2, 10, 20), "shapes": (1, 4, 8), "vertices": (2000, 8000)}
QUANTITIES = ("frame", "frame_stateless", "positions", "bind")


def run(bench):
    points = []
    for sweep, sizes in (QUICK if bench.quick else SWEEPS).items():
        rows = [row_of(sweep, size, what) for size in sizes for what in QUANTITIES]
        bench.run(
            rows, lambda bench, sweep=sweep, sizes=sizes: points.extend(_sweep(bench, sweep, sizes))
        )
    if points:
        figure.write(bench.build / "sweep", points, QUANTITIES)


def row_of(sweep, size, what):
    size = f"{size // 1000}k" if sweep == "vertices" else size
    return f"amrap/sweep/{sweep}{size}_{what}"


def _sweep(bench, sweep, sizes):
    points = []
    for size in sizes:
        wanted = [what for what in QUANTITIES if bench.wants(row_of(sweep, size, what))]
        # The first of a sweep is what the others are compared with.
        if not wanted and points:
            continue
        milliseconds = _measure(bench, **{**BASE, sweep: size})
        points.append((sweep, size, milliseconds))
        _, smallest, first = points[0]
        for what in wanted:
            ours, peer = milliseconds[what], first[what] * size / smallest
            name = f"{sweep} {smallest} in proportion"
            bench.add(row_of(sweep, size, what), ours, peer, "ms", name)
    return points


def _measure(bench, handles, shapes, vertices):
    character = inputs.bumpy_bar(vertices, shapes, handles)
    (bound,) = interleave(bench.repeats(3, 1) if vertices < 50000 else 1, bind_seconds(character))
    deformer = bind(character)
    targets = drag_of(deformer, character, 200)
    # Few frames where one takes long.
    drag = Drag(deformer, targets, native.Start.STATELESS)
    (trial,) = samples(3, drag.solve)
    budget = 3.0 if not bench.quick else 0.5
    frames = int(min(200, max(5, budget / max(*trial, 1e-6))))
    (stateless,) = interleave(frames, drag.solve)
    warm = Drag(deformer, targets, native.Start.WARM)
    (frame,) = interleave(max(frames, 20), warm.solve)
    (positions,) = interleave(bench.repeats(50, 20), warm.positions_of_next)
    deformer.close()
    seconds = {
        "frame": frame,
        "frame_stateless": stateless,
        "positions": positions,
        "bind": bound,
    }
    return {what: value * 1e3 for what, value in seconds.items()}
