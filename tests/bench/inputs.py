# SPDX-License-Identifier: GPL-3.0-or-later
"""What is measured on: real meshes, generated ones, handles on them and drags of those handles."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("EXEMPLAR_DATA", ROOT / ".." / "shared" / "data"))


class Missing(Exception):
    """A row cannot be measured here; the message says why."""


@dataclass(frozen=True)
class Character:
    """A mesh with exemplars and handles, as exm_amrap_create takes them."""

    positions: numpy.ndarray  # float32 [V][3], the reference
    triangles: numpy.ndarray  # uint32 [F][3]
    exemplars: numpy.ndarray  # float32 [S][V][3]
    handles: list  # [H] arrays of vertices

    @property
    def diagonal(self):
        return float(numpy.linalg.norm(numpy.ptp(self.positions, axis=0)))


# ------------------------------------------------------------------------------- real meshes


def real(name, handle_count, shape_count, rings=1):
    """`shape_count` poses of a data set, the reference first and the others spread evenly."""
    path = DATA / f"{name}.npz"
    if not path.exists():
        raise Missing(f"{name}.npz is not in the folder of real meshes (EXEMPLAR_DATA)")
    with numpy.load(path) as arrays:
        poses, faces = arrays["poses"], arrays["faces"].astype(numpy.uint32)
    if len(poses) < shape_count:
        raise Missing(f"{name}.npz has {len(poses)} poses, {shape_count} are needed")
    chosen = numpy.linspace(0, len(poses) - 1, shape_count).round().astype(int)
    exemplars = numpy.ascontiguousarray(poses[chosen], numpy.float32)
    return Character(
        exemplars[0], faces, exemplars, regions(exemplars[0], faces, handle_count, rings)
    )


# ------------------------------------------------------------------------------------ handles


def regions(positions, triangles, count, rings):
    """Vertex sets about points sampled farthest from each other; no vertex in two of them.

    Every connected part has one: sampling begins in each part with the vertex farthest from the
    part's centre.
    """
    centres = farthest_points(positions, triangles, count)
    neighbours = adjacency(len(positions), triangles) if rings else None
    taken = numpy.zeros(len(positions), bool)
    taken[centres] = True
    result = []
    for centre in centres:
        found = {int(centre)}
        for _ in range(rings):
            found |= {int(v) for u in list(found) for v in neighbours[u] if not taken[v]}
        members = numpy.array(sorted(found), numpy.uint32)
        taken[members] = True
        result.append(members)
    return result


def farthest_points(positions, triangles, count):
    parts = components(len(positions), triangles)
    chosen = []
    for part in numpy.unique(parts):
        members = numpy.flatnonzero(parts == part)
        away = positions[members] - positions[members].mean(axis=0)
        chosen.append(int(members[numpy.argmax((away**2).sum(axis=1))]))
    if len(chosen) > count:
        raise Missing(f"{len(chosen)} connected parts need as many handles, {count} are wanted")
    distance = numpy.full(len(positions), numpy.inf)
    for vertex in chosen:
        distance = numpy.minimum(distance, ((positions - positions[vertex]) ** 2).sum(axis=1))
    while len(chosen) < count:
        vertex = int(numpy.argmax(distance))
        chosen.append(vertex)
        distance = numpy.minimum(distance, ((positions - positions[vertex]) ** 2).sum(axis=1))
    return chosen


def adjacency(vertex_count, triangles):
    """The neighbours of every vertex, a list of arrays."""
    corners = triangles.astype(numpy.int64)
    edges = numpy.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    edges = numpy.unique(numpy.concatenate([edges, edges[:, ::-1]]), axis=0)
    starts = numpy.searchsorted(edges[:, 0], numpy.arange(1, vertex_count))
    return numpy.split(edges[:, 1], starts)


def components(vertex_count, triangles):
    """The connected part of every vertex, named by its lowest vertex."""
    parts = numpy.arange(vertex_count)
    while True:
        lowest = parts[triangles].min(axis=1)
        before = parts.copy()
        numpy.minimum.at(parts, triangles.ravel(), numpy.repeat(lowest, 3))
        parts = parts[parts]
        if (parts == before).all():
            return parts


# -------------------------------------------------------------------------------------- drags


def drag(poses, diagonal, frames, seed=1):
    """Targets [frames][H][3][4] of a drag, with every handle on the move in every frame.

    The handles go smoothly from exemplar to exemplar and back to the first, while handle 0 is also
    pulled about by a tenth of the mesh: so the exemplars, what is between and what is outside of
    them are all on the way.

    poses  [S][H][3][4] where each exemplar has the handles
    """
    poses = numpy.asarray(poses, float)
    generator = numpy.random.default_rng(seed)
    time = numpy.arange(frames) / frames
    leg = time * len(poses)
    index = leg.astype(int)
    share = (leg - index)[:, None, None, None]
    share = share * share * (3 - 2 * share)
    targets = (1 - share) * poses[index] + share * poses[(index + 1) % len(poses)]
    phase = generator.uniform(0, 2 * numpy.pi, 3)
    swing = numpy.sin(2 * numpy.pi * numpy.outer(time, [2, 3, 5]) + phase)
    targets[:, 0, :, 3] += 0.1 / numpy.sqrt(3) * diagonal * swing
    # Nobody's hand is steady, and a pose that was had before could be served from memory.
    targets[..., 3] += generator.normal(0, 1e-4 * diagonal, targets[..., 3].shape)
    return numpy.ascontiguousarray(targets)


# --------------------------------------------------------------------------- generated meshes


def bumpy_bar(vertex_count, shape_count, handle_count, rings=1):
    """A closed, bumpy bar of about `vertex_count` vertices that its exemplars bend, twist and
    swell: the same geometry at every resolution."""
    around = max(8, int(round(numpy.sqrt(vertex_count / 4))))
    along = max(8, (vertex_count - 2) // around)
    positions, triangles = _tube(along, around)
    exemplars = numpy.stack([_posed(positions, shape) for shape in range(shape_count)])
    exemplars = exemplars.astype(numpy.float32)
    return Character(
        exemplars[0], triangles, exemplars, regions(exemplars[0], triangles, handle_count, rings)
    )


def _tube(along, around):
    """Rings of vertices about the x axis, from -2 to 2, closed by a vertex at either end."""
    x = numpy.linspace(-2, 2, along)
    angle = 2 * numpy.pi * numpy.arange(around) / around
    radius = 0.4 + 0.05 * numpy.outer(numpy.sin(5 * x), numpy.cos(3 * angle))
    # Ends that close round.
    radius *= numpy.sqrt(numpy.clip(1 - (numpy.abs(x) / 2.02) ** 8, 0.01, 1))[:, None]
    rings = numpy.stack(
        [
            numpy.broadcast_to(x[:, None], radius.shape),
            radius * numpy.cos(angle),
            radius * numpy.sin(angle),
        ],
        axis=2,
    )
    positions = numpy.concatenate([rings.reshape(-1, 3), [[-2.05, 0, 0], [2.05, 0, 0]]])
    ring, step = numpy.meshgrid(numpy.arange(along - 1), numpy.arange(around), indexing="ij")
    a, b = ring * around + step, ring * around + (step + 1) % around
    c, d = a + around, b + around
    first, last = along * around, along * around + 1
    step = numpy.arange(around)
    following = (step + 1) % around
    end = (along - 1) * around
    triangles = numpy.concatenate(
        [
            numpy.stack([a, c, b], axis=2).reshape(-1, 3),
            numpy.stack([b, c, d], axis=2).reshape(-1, 3),
            numpy.stack([numpy.full(around, first), step, following], axis=1),
            numpy.stack([numpy.full(around, last), end + following, end + step], axis=1),
        ]
    )
    return positions, triangles.astype(numpy.uint32)


def _posed(positions, shape):
    """Exemplar `shape` of the bar; 0 is the reference."""
    if shape == 0:
        return positions.copy()
    generator = numpy.random.default_rng(shape)
    bend, twist = generator.uniform(-1, 1), generator.uniform(-1.5, 1.5)
    plane, middle = generator.uniform(0, 2 * numpy.pi), generator.uniform(-1, 1)
    swelling = generator.uniform(0.1, 0.5)
    x = positions[:, 0]
    section = positions[:, 1:] * (1 + swelling * numpy.exp(-2 * (x - middle) ** 2))[:, None]
    turned = _turn(section, twist * x / 2 - plane)
    # Bent into an arc: x is the length along it.
    angle = bend * x
    radius = 1 / bend if abs(bend) > 1e-3 else 1e3
    arc = numpy.stack(
        [
            (radius - turned[:, 0]) * numpy.sin(angle),
            radius - (radius - turned[:, 0]) * numpy.cos(angle),
            turned[:, 1],
        ],
        axis=1,
    )
    arc[:, 1:] = _turn(arc[:, 1:], plane)
    return arc


def _turn(points, angle):
    sine, cosine = numpy.sin(angle), numpy.cos(angle)
    return numpy.stack(
        [
            cosine * points[:, 0] - sine * points[:, 1],
            sine * points[:, 0] + cosine * points[:, 1],
        ],
        axis=1,
    )


def box_bar(across, along):
    """The surface of a bar of `across` x `across` x `along` cubes, 1 thick, along x: as Sorkine and
    Alexa's and Chen et al.'s bars are."""
    sides = {}
    positions, triangles = [], []

    def vertex(*place):
        if place not in sides:
            sides[place] = len(positions)
            positions.append(place)
        return sides[place]

    def quad(a, b, c, d):
        triangles.extend([(a, b, c), (a, c, d)])

    for i in range(along):
        for j in range(across):
            for k, turned in ((0, False), (across, True)):
                floor = [vertex(i, j, k), vertex(i, j + 1, k), vertex(i + 1, j + 1, k)]
                floor.append(vertex(i + 1, j, k))
                wall = [vertex(i, k, j), vertex(i + 1, k, j), vertex(i + 1, k, j + 1)]
                wall.append(vertex(i, k, j + 1))
                quad(*(floor[::-1] if turned else floor))
                quad(*(wall[::-1] if turned else wall))
    for j in range(across):
        for k in range(across):
            for i, turned in ((0, False), (along, True)):
                end = [vertex(i, j, k), vertex(i, j, k + 1), vertex(i, j + 1, k + 1)]
                end.append(vertex(i, j + 1, k))
                quad(*(end[::-1] if turned else end))
    return (
        numpy.array(positions, numpy.float32) / across,
        numpy.array(triangles, numpy.uint32),
    )
