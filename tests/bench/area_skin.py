# SPDX-License-Identifier: GPL-3.0-or-later
"""Coefficients applied to a mesh of 50 thousand vertices."""

import inputs
import peers
from characters import Drag, bind, drag_of, native
from measure import interleave

VERTICES, SHAPES, HANDLES = 50000, 8, 10
ROW = "skin/50k/apply"


def run(bench):
    bench.run([ROW], _measure)


def _measure(bench):
    character = inputs.bumpy_bar(VERTICES, SHAPES, HANDLES)
    deformer = bind(character)
    drag = Drag(deformer, drag_of(deformer, character, 20), native.Start.WARM)
    products, worst = peers.products(character, deformer)
    ours, *others = interleave(
        bench.repeats(60, 20), drag.positions_of_next, *products.values(), burst=5
    )
    peer, peer_name = min(zip(others, products))
    notes = (
        f"{len(character.positions)} vertices, {SHAPES} exemplars, {HANDLES} handles; "
        f"same positions to {worst:.1g} of the diagonal; "
        + ", ".join(f"{name} {value * 1e3:.3g} ms" for value, name in zip(others, products))
    )
    bench.add(ROW, ours * 1e3, peer * 1e3, "ms", peer_name, notes)
