#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The square of Wampler's figures 1 and 2: it puffs out as it is stretched, then thins.

Three shapes of one grid and three handles: the right one is dragged out and back, the middle one
stays halfway. Draws how the blend weights run (left) and what the shape does (right) for four
settings, and prints how far the curves are from what the paper shows. Needs numpy and the library,
not Blender.

    examples/square.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "blender_addon")]

import native  # noqa: E402
from drawing import Page  # noqa: E402

COLUMNS, ROWS = 24, 16  # cells of the grid
STRETCH = 1.0, 1.4, 1.8  # of the three shapes, evenly: the first and the last average to the second
COLOURS = np.array([[0.80, 0.22, 0.20], [0.25, 0.62, 0.25], [0.20, 0.36, 0.78]])
STEPS = 61  # on the way out, and as many on the way back


def grid():
    """Unit square: positions [V][3] and triangles [F][3]."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, COLUMNS + 1), np.linspace(-0.5, 0.5, ROWS + 1))
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    lower = np.stack([a, b, c], axis=-1).reshape(-1, 3)
    upper = np.stack([a, c, d], axis=-1).reshape(-1, 3)
    return positions, np.concatenate([lower, upper])


def shapes(square):
    """The square; stretched and puffed out; stretched further and thinned. The left end stays."""
    x, y, z = square.T
    middle = np.cos(np.pi * x)
    height = 1.0, 1.0 + 0.4 * middle, 1.0 - 0.3 * middle
    return np.stack(
        [np.stack([(x + 0.5) * s - 0.5, y * h, z], axis=1) for s, h in zip(STRETCH, height)]
    )


def handle_vertices(square):
    """Left, middle and right, on the axis: one vertex each."""
    x, y, _ = square.T
    return [np.flatnonzero((x == place) & (y == 0.0)) for place in (-0.5, 0.0, 0.5)]


def outline():
    """The boundary's vertices in order."""
    corner = np.arange((COLUMNS + 1) * (ROWS + 1)).reshape(ROWS + 1, COLUMNS + 1)
    return np.concatenate([corner[0], corner[1:, -1], corner[-1, -2::-1], corner[-2:0:-1, 0]])


def drag(deformer, settings):
    """Stretch [T] of the right handle out and back, averaged weights [T][S], shapes [T][V][3]."""
    out = np.linspace(STRETCH[0], STRETCH[-1], STEPS)
    stretch = np.concatenate([out, out[-2::-1]])
    first, last = deformer.handle_pose(0), deformer.handle_pose(len(STRETCH) - 1)
    blends, positions = [], []
    for value in stretch:
        share = (value - STRETCH[0]) / (STRETCH[-1] - STRETCH[0])
        deformer.solve((1.0 - share) * first + share * last, settings)
        blends.append(deformer.blend_average())
        positions.append(deformer.positions_f64())
    return stretch, np.array(blends), np.array(positions)


ROWS_OF_FIGURE = (
    ("a", "no rotations, lambda 0.5", dict(rotations=False, lambda_=0.5)),
    ("b", "rotations, lambda 0.5", dict(rotations=True, lambda_=0.5, iterations=300)),
    ("c", "lambda 10: jumps", dict(rotations=False, lambda_=10.0)),
    ("d", "lambda 0: the middle hardly counts", dict(rotations=False, lambda_=0.0)),
)


def piecewise_linear(stretch):
    """The weights that go straight from each shape to the next, [T][S]."""
    return np.stack([np.interp(stretch, STRETCH, row) for row in np.identity(3)], axis=1)


def there_and_back(values):
    """How much the way back differs from the way out."""
    return np.abs(values - values[::-1]).max()


def report(letter, title, stretch, blends, positions):
    print(f"{letter}) {title}")
    print(f"   from piecewise linear   {np.abs(blends - piecewise_linear(stretch)).max():.2e}")
    print(f"   middle weight at most   {blends[:, 1].max():.4f}")
    steps = np.abs(np.diff(blends, axis=0)).max()
    print(f"   largest step of weights {steps:.4f} (straight: {2.0 / (STEPS - 1):.4f})")
    print(f"   there and back          {there_and_back(blends):.2e} weights", end=", ")
    print(f"{there_and_back(positions):.2e} positions")


def draw_row(page, top, letter, title, stretch, blends, positions):
    left, right, high, low = 56, 346, top + 26, top + 136
    page.text((16, top + 84), letter, 20, bold=True)
    page.text((left, top + 14), title, 13)
    page.line([(left, high), (left, low), (right, low)], (0.6, 0.6, 0.6), 1.0)
    page.text((left - 14, high + 5), "1", 11)
    page.text((left - 14, low + 4), "0", 11)
    x = np.linspace(left, right, len(stretch))
    turn = x[len(x) // 2]
    page.line([(turn, high), (turn, low)], (0.85, 0.85, 0.85), 1.0)
    for column, colour in zip(blends.T, COLOURS):
        page.line(np.stack([x, low + (high - low) * column], axis=1), colour, 2.5)
    place, rim = right + 40.0, outline()
    for index in np.linspace(0, len(stretch) - 1, 13).round().astype(int):
        place = draw_shape(page, place, 0.5 * (high + low), positions[index], blends[index], rim)
    page.text((left, low + 17), "out", 11)
    page.text((right - 24, low + 17), "back", 11)


def draw_shape(page, place, middle, positions, blend, rim, unit=42.0):
    """One shape in the mixture of the exemplars' colours; returns where the next one goes."""
    points = positions[:, :2] * [unit, -unit]
    points += [place - points[:, 0].min(), middle]
    page.polygon(points[rim], 1.0 - 0.75 * (1.0 - blend @ COLOURS))
    mesh = points.reshape(ROWS + 1, COLUMNS + 1, 2)
    for line in (*mesh[::4], *mesh.transpose(1, 0, 2)[::4]):
        page.line(line, (1.0, 1.0, 1.0), 0.7)
    page.line(points[np.append(rim, rim[0])], (0.25, 0.25, 0.25), 1.2)
    for vertices in handle_vertices(grid()[0]):
        page.disc(points[vertices].mean(axis=0), 3.2, (0.0, 0.0, 0.0))
    return points[:, 0].max() + 16.0


def main(folder):
    square, triangles = grid()
    exemplars = shapes(square)
    mesh = native.Mesh(square, triangles)
    handles = native.Handles([native.Kind.PINNED] * 3, handle_vertices(square))
    page = Page(1440, 80 + 172 * len(ROWS_OF_FIGURE))
    page.text((56, 34), "blend weights", 15)
    page.text((386, 34), "the shape, while the right handle is dragged out and back", 15)
    with native.Amrap(mesh, exemplars, handles, edge_group_count=3) as deformer:
        for index, (letter, title, settings) in enumerate(ROWS_OF_FIGURE):
            result = drag(deformer, native.AmrapSettings(**settings))
            report(letter, title, *result)
            draw_row(page, 56 + 172 * index, letter, title, *result)
    folder.mkdir(parents=True, exist_ok=True)
    page.write_svg(folder / "square.svg")
    page.write_png(folder / "square.png")
    print(f"drawn: {folder / 'square.svg'} and square.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parent / "build" / "examples")
