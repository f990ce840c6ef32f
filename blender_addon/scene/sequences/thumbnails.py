# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shapes to draw where in the pose plane, and how coarse. Knows nothing of Blender."""

import heapq
from dataclasses import dataclass
from typing import Any

import numpy

# Of all the triangles that are drawn: what a window redraws without being felt.
TRIANGLE_BUDGET = 60_000
# Squares along the longer side of the plane to begin with.
FIRST_ACROSS = 3
# Cells are not divided further than this.
DEEPEST = 5


@dataclass
class Cell:
    """A square of the plane, with the shape at its centre."""

    centre: tuple  # (x, y)
    size: float
    depth: int
    positions: Any  # float32 [n][3], of the vertices that are drawn


def coarse(positions, triangles, limit):
    """(vertices int [n], triangles int [m][3] into them): a mesh of at most about `limit`
    triangles, whose vertices are some of the mesh's own, so that it can be drawn in any shape."""
    if len(triangles) <= limit:
        used = numpy.unique(triangles)
        return used, numpy.searchsorted(used, triangles)
    low = positions.min(axis=0)
    extent = float(numpy.ptp(positions, axis=0).max()) or 1.0
    # A surface covers about three squares of cells times the number across, squared.
    across = max(4.0, numpy.sqrt(limit / 6.0))
    for _ in range(12):
        cells = numpy.floor((positions - low) / extent * across).astype(numpy.int64)
        keys = (cells[:, 0] * 4096 + cells[:, 1]) * 4096 + cells[:, 2]
        _, chosen, which = numpy.unique(keys, return_index=True, return_inverse=True)
        faces = which.ravel()[triangles]
        whole = (
            (faces[:, 0] != faces[:, 1])
            & (faces[:, 1] != faces[:, 2])
            & (faces[:, 2] != faces[:, 0])
        )
        faces = faces[whole]
        if len(faces) <= limit:
            break
        across *= 0.85
    return chosen, faces


def cells(low, high, shape_at, budget):
    """A grid that is finer where shapes differ more: a list of Cells, `budget` of them or a few
    more.

    low, high  corners of the plane's part to cover, [2]
    shape_at   (x, y) -> float32 [n][3]
    """
    low, high = numpy.asarray(low, float), numpy.asarray(high, float)
    size = float((high - low).max()) / FIRST_ACROSS
    counts = numpy.maximum(1, numpy.round((high - low) / size).astype(int))
    middle = (low + high) / 2
    queue, order = [], 0
    for column in range(counts[0]):
        for row in range(counts[1]):
            place = (numpy.array([column, row]) - (counts - 1) / 2) * size
            order += 1
            _push(queue, _cell(middle + place, size, 0, shape_at), shape_at, order)
    done = []
    while queue and len(done) + len(queue) < budget:
        _, _, cell, children = heapq.heappop(queue)
        if cell.depth >= DEEPEST:
            done.append(cell)
            continue
        for child in children:
            order += 1
            _push(queue, child, shape_at, order)
    return done + [entry[2] for entry in queue]


def _cell(centre, size, depth, shape_at):
    centre = (float(centre[0]), float(centre[1]))
    return Cell(centre, size, depth, shape_at(centre))


def _push(queue, cell, shape_at, order):
    """By how much the shape changes within the cell: the largest change is divided first."""
    quarter = cell.size / 4
    children = [
        _cell(
            (cell.centre[0] + x * quarter, cell.centre[1] + y * quarter),
            cell.size / 2,
            cell.depth + 1,
            shape_at,
        )
        for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1))
    ]
    change = max(_distance(cell.positions, child.positions) for child in children)
    heapq.heappush(queue, (-change, order, cell, children))


def _distance(first, second):
    return float(numpy.sqrt(numpy.mean((first - second) ** 2)))


def shaded(positions, triangles, light, colour):
    """float32 [n][4]: vertex colours of a mesh under a light, for shaders that know none."""
    corners = positions[triangles]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = numpy.zeros_like(positions, dtype=numpy.float64)
    for corner in range(3):
        numpy.add.at(summed, triangles[:, corner], normals)
    lengths = numpy.linalg.norm(summed, axis=1, keepdims=True)
    facing = (summed / numpy.maximum(lengths, 1e-30)) @ (light / numpy.linalg.norm(light))
    bright = 0.35 + 0.65 * numpy.clip(0.5 + 0.5 * facing, 0.0, 1.0)
    colours = numpy.ones((len(positions), 4), numpy.float32)
    colours[:, :3] = bright[:, None] * numpy.asarray(colour)
    return colours
