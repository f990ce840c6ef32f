# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed surfaces from distance fields: swept balls that melt together, meshed by surface nets."""

import numpy as np


def sweep(points, centres, radii):
    """Distance from points [n][3] to balls swept along a polyline, to first order where their radii
    change.
    """
    distance = np.full(len(points), np.inf)
    x, y, z = np.ascontiguousarray(points.T)
    for start, step, radius, growth in zip(
        centres, np.diff(centres, axis=0), radii, np.diff(radii)
    ):
        dx, dy, dz = x - start[0], y - start[1], z - start[2]
        along = (dx * step[0] + dy * step[1] + dz * step[2]) / max(step @ step, 1e-12)
        np.clip(along, 0.0, 1.0, out=along)
        dx -= along * step[0]
        dy -= along * step[1]
        dz -= along * step[2]
        here = np.sqrt(dx * dx + dy * dy + dz * dz) - (radius + along * growth)
        np.minimum(distance, here, out=distance)
    return distance


def ellipsoid(points, centre, radii):
    """Distance to an ellipsoid, to first order at its surface."""
    scaled = (points - centre) / radii
    length = np.linalg.norm(scaled, axis=1)
    gradient = np.linalg.norm(scaled / radii, axis=1)
    return np.where(
        length < 1e-9, -np.min(radii), length * (length - 1.0) / np.maximum(gradient, 1e-12)
    )


def melt(a, b, radius):
    """Union with a fillet of about that radius (the cubic smooth minimum, which is C2)."""
    near = np.maximum(radius - np.abs(a - b), 0.0) / radius
    return np.minimum(a, b) - near**3 * radius / 6.0


def carve(a, b, radius):
    """`a` without `b`, with a rounded rim."""
    return -melt(-a, b, radius)


def surface_net(field, low, high, cell):
    """Quads where field(points) = 0: one vertex in each cell that the surface crosses.

    The grid is symmetric in x, so that a symmetric field gives a symmetric mesh. Returns positions
    [V][3] and quads [Q][4], oriented outwards.
    """
    half = int(np.ceil(max(abs(low[0]), abs(high[0])) / cell))
    xs = (np.arange(-half, half + 1)) * cell
    ys = np.arange(low[1], high[1] + cell, cell)
    zs = np.arange(low[2], high[2] + cell, cell)
    grid = np.stack(np.meshgrid(xs, ys, zs, indexing="ij"), axis=-1)
    values = field(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    values[:half] = values[:half:-1]  # mirrored to the bit
    values = _without_pinches(values)
    inside = values < 0.0

    cells = tuple(n - 1 for n in values.shape)
    total, count = np.zeros(cells + (3,)), np.zeros(cells, dtype=int)
    for axis in range(3):
        _add_crossings(grid, values, inside, axis, total, count)
    crossed = count > 0
    index = np.full(cells, -1)
    index[crossed] = np.arange(crossed.sum())
    positions = total[crossed] / count[crossed][:, None]
    quads = np.concatenate([_quads(inside, index, axis) for axis in range(3)])
    return positions, quads


def _without_pinches(values, rounds=20):
    """Values whose signs give a manifold: no grid square, and no cell, with only two opposite
    corners alike.

    Where the surface just touches a plane of the grid such squares occur, however smooth it is. The
    corner nearest to the surface changes sides.
    """
    values = values.copy()
    square, cube = np.array([(0, 0), (0, 1), (1, 1), (1, 0)]), np.array(list(np.ndindex(2, 2, 2)))
    for _ in range(rounds):
        pinched = np.zeros_like(values, dtype=bool)
        for axis in range(3):
            _mark(values, np.insert(square, axis, 0, axis=1), [(0, 2), (1, 3)], pinched)
        _mark(values, cube, [(0, 7), (1, 6), (2, 5), (3, 4)], pinched)
        if not pinched.any():
            return values
        values[pinched] = -np.copysign(1e-6, values[pinched])
    raise RuntimeError("the surface is too thin for this cell size")


def _mark(values, corners, diagonals, pinched):
    """Mark the corner nearest to zero where one diagonal of corners alone is inside, or alone
    outside.
    """
    shape = np.array(values.shape) - np.max(corners, axis=0)
    corner = np.stack([values[tuple(slice(o, o + n) for o, n in zip(c, shape))] for c in corners])
    for flip in (corner < 0.0, corner >= 0.0):
        for diagonal in diagonals:
            alone = flip.sum(axis=0) == 2
            alone &= flip[list(diagonal)].all(axis=0)
            for where in np.argwhere(alone):
                nearest = np.argmin(np.abs(corner[(slice(None), *where)]))
                pinched[tuple(where + corners[nearest])] = True


def _add_crossings(grid, values, inside, axis, total, count):
    """Add the points where grid edges along `axis` meet the surface to the four cells around each
    edge.
    """
    start, end = _ends(values, axis), _ends(values, axis, end=True)
    crossing = inside[start] != inside[end]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(crossing, values[start] / (values[start] - values[end]), 0.0)
    point = grid[start] + share[..., None] * (grid[end] - grid[start])
    others = [a for a in range(3) if a != axis]
    for shift in ((0, 0), (0, 1), (1, 0), (1, 1)):
        window = [slice(None)] * 3
        for other, s in zip(others, shift):
            size = total.shape[other]
            window[other] = slice(s, s + size)
        window = tuple(window)
        total += np.where(crossing[window][..., None], point[window], 0.0)
        count += crossing[window]


def _ends(values, axis, end=False):
    window = [slice(None)] * 3
    window[axis] = slice(1, None) if end else slice(None, -1)
    return tuple(window)


def _quads(inside, index, axis):
    """A quad around each crossed grid edge along `axis`, from the four cells that share it."""
    start, end = inside[_ends(inside, axis)], inside[_ends(inside, axis, end=True)]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    ijk = np.argwhere(start != end)
    keep = (ijk[:, u] > 0) & (ijk[:, v] > 0)
    keep &= (ijk[:, u] < index.shape[u]) & (ijk[:, v] < index.shape[v])
    ijk = ijk[keep]
    corners = []
    for du, dv in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
        cell = ijk.copy()
        cell[:, u] += du
        cell[:, v] += dv
        corners.append(index[tuple(cell.T)])
    quads = np.stack(corners, axis=1)
    outward = start[tuple(ijk.T)]
    quads[~outward] = quads[~outward, ::-1]
    return quads


def gradient(field, points, step=1e-4):
    """By four samples at the corners of a tetrahedron."""
    corners = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], dtype=float)
    return sum(field(points + step * c)[:, None] * c for c in corners) / (4.0 * step)


def edges_of(faces):
    """The distinct edges [E][2] of polygons of one size."""
    pairs = np.stack([faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()], axis=1)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def neighbour_mean(values, edges):
    """The mean over each vertex's neighbours of values [V] or [V][k]."""
    total = np.zeros_like(values, dtype=float)
    degree = np.bincount(edges.ravel(), minlength=len(values)).astype(float)
    np.add.at(total, edges[:, 0], values[edges[:, 1]])
    np.add.at(total, edges[:, 1], values[edges[:, 0]])
    return (total.T / np.maximum(degree, 1.0)).T


def relax(field, positions, quads, rounds):
    """Even out the quads without leaving the surface: tangential smoothing, then a Newton step onto
    it.
    """
    edges = edges_of(quads)
    slope = gradient(field, positions)
    for _ in range(rounds):
        normal = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
        move = 0.5 * (neighbour_mean(positions, edges) - positions)
        positions = positions + move - normal * np.sum(move * normal, axis=1, keepdims=True)
        positions, slope = onto(field, positions)
    return positions


def onto(field, positions):
    """A Newton step onto the surface; returns the slope of the field with the positions."""
    slope = gradient(field, positions)
    squared = np.maximum(np.sum(slope * slope, axis=1), 1e-9)
    return positions - slope * (field(positions) / squared)[:, None], slope


def snap_to_circle(field, positions, centre, radius, reach):
    """Move vertices within `reach` of a circle on the surface onto it: a clean edge of colour."""
    positions = positions.copy()
    away = np.linalg.norm(positions - centre, axis=1) - radius
    near = np.flatnonzero(np.abs(away) < reach)
    for _ in range(4):
        arm = positions[near] - centre
        length = np.linalg.norm(arm, axis=1, keepdims=True)
        positions[near] = onto(field, centre + arm * (radius / length))[0]
    return positions


def is_closed_manifold(faces, vertex_count):
    """Whether every edge has two faces of opposite direction and every vertex one fan of faces."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    directed = start.astype(np.int64) * vertex_count + end
    if len(np.unique(directed)) != len(directed):
        return False
    if not np.array_equal(np.sort(directed), np.sort(end.astype(np.int64) * vertex_count + start)):
        return False
    # One fan a vertex: from face to face around it, one comes by all of them.
    previous = np.roll(faces, 1, axis=1).ravel()
    fans = {}
    for vertex, incoming, outgoing in zip(start, previous, end):
        fans.setdefault(vertex, {})[incoming] = outgoing
    for fan in fans.values():
        first = at = next(iter(fan))
        steps = 0
        while True:
            at, steps = fan[at], steps + 1
            if at == first or steps > len(fan):
                break
        if steps != len(fan):
            return False
    return len(fans) == vertex_count
