# SPDX-License-Identifier: GPL-3.0-or-later
"""Where handles are likely to be wanted, from the exemplars alone: tips, joints, and what is far
from both. Knows arrays, not Blender.

Distances run along the edges, and an edge is longer the more the exemplars bend it. In this metric
the tips of limbs are what is farthest from the middle of the body, and a joint keeps its two sides
apart. Each next handle goes to the place that is farthest from all before it: the tips come first,
then the joints between them and the body.
"""

import heapq
from dataclasses import dataclass

import numpy

from .parts import components

MOST = 64
# Chosen for the artist: handles until the next would be this much nearer to others than the first.
ENOUGH = 0.45
MOST_BY_ITSELF = 16
# A full radian of bending, averaged over the exemplars, counts like this share of the mesh's size.
BEND_LENGTH = 0.1
# Shares of the mesh's size.
TIP_RADIUS = 0.03
RING_HEIGHT = 0.03
RING_WIDEST = 0.22
# A finer mesh is looked at in patches: proposals need no more, and plain Python is slow.
FINEST = 6000


@dataclass(frozen=True)
class Proposal:
    role: str  # "ROOT", "TIP", "JOINT"
    vertices: numpy.ndarray  # uint32


def propose(reference, triangles, exemplars, taken=(), count=0):
    """[Proposal], the most useful first.

    reference [V][3], triangles [F][3], exemplars [S][V][3]
    taken     vertices of handles that are there already; proposals keep away from them
    count     how many handles to propose; 0: as many as the shape asks for
    """
    patches, positions, edges, poses = _coarsened(
        numpy.asarray(reference, numpy.float64),
        numpy.asarray(triangles, numpy.int64),
        numpy.asarray(exemplars, numpy.float64),
    )
    is_taken = numpy.zeros(len(positions), bool)
    is_taken[patches[numpy.asarray(taken, int)]] = True
    found = _Proposer(positions, edges, poses, is_taken).run(count)
    return [
        Proposal(role, numpy.flatnonzero(numpy.isin(patches, nodes)).astype(numpy.uint32))
        for role, nodes in found
    ]


class _Proposer:
    """Works on the nodes of a graph: vertices, or patches of a fine mesh."""

    def __init__(self, positions, edges, poses, is_taken):
        self.positions = positions
        self.size = float(numpy.linalg.norm(numpy.ptp(positions, axis=0))) or 1.0
        spans = positions[edges[:, 1]] - positions[edges[:, 0]]
        lengths = numpy.linalg.norm(spans, axis=1) / self.size
        bent = bending(positions, edges, poses)
        self.plain = _Graph(len(positions), edges, lengths)
        self.bent = _Graph(len(positions), edges, lengths + BEND_LENGTH * bent)
        self.sharpness = _blurred(len(positions), edges, bent)
        self.is_taken = is_taken
        # A node without edges cannot be held by what holds its neighbours, for it has none.
        self.has_edges = numpy.zeros(len(positions), bool)
        self.has_edges[edges] = True

    def run(self, count):
        found = []
        nearest = self.bent.distances(numpy.flatnonzero(self.is_taken).tolist())
        if not self.is_taken.any():
            root = self._middle()
            found.append(self._claim("ROOT", root))
            self.bent.lower(nearest, [root])
        self.from_root = numpy.array(nearest)
        held = numpy.flatnonzero(self.from_root == 0).tolist()
        self.height = numpy.array(self.plain.distances(held))
        first = None
        while len(found) < (count or MOST):
            distance = numpy.where(self.is_taken | ~self.has_edges, -1.0, nearest)
            site = int(distance.argmax())
            gap = distance[site]
            if gap < 0:
                break
            if numpy.isinf(gap):
                role, site = "JOINT", self._middle_of_part(distance)
            else:
                first = first or gap
                if not count and (gap < ENOUGH * first or len(found) >= MOST_BY_ITSELF):
                    break
                role, site = self._settle(site, gap)
            found.append(self._claim(role, site))
            self.bent.lower(nearest, [site])
        return found

    def _middle(self):
        """The vertex whose farthest tip is nearest, in the largest part."""
        farthest = numpy.zeros(len(self.positions))
        nearest = numpy.full(len(self.positions), numpy.inf)
        site = int(self.has_edges.argmax())
        part = numpy.isfinite(self.bent.distances([site]))
        site = int(numpy.where(part, self.bent.distances([site]), -1.0).argmax())
        for _ in range(6):
            distances = numpy.array(self.bent.distances([site]))
            farthest = numpy.maximum(farthest, distances)
            nearest = numpy.minimum(nearest, distances)
            site = int(numpy.where(part, nearest, -1.0).argmax())
        return int(numpy.where(part, farthest, numpy.inf).argmin())

    def _middle_of_part(self, distance):
        """A loose part is held at its middle: of those out of reach the one nearest their first."""
        start = int(distance.argmax())
        part = numpy.flatnonzero(numpy.isfinite(self.plain.distances([start])) & ~self.is_taken)
        centre = self.positions[part].mean(axis=0)
        return int(part[numpy.linalg.norm(self.positions[part] - centre, axis=1).argmin()])

    def _settle(self, site, gap):
        """A tip stays; anything else goes to where the exemplars bend most nearby."""
        around = numpy.flatnonzero(
            numpy.isfinite(self.bent.distances([site], 0.4 * gap)) & ~self.is_taken
        )
        if self.from_root[site] >= self.from_root[around].max():
            return "TIP", site
        return "JOINT", int(around[self.sharpness[around].argmax()])

    def _claim(self, role, site):
        nodes = self._ring(site) if role == "JOINT" else None
        if nodes is None:
            nodes = numpy.flatnonzero(numpy.isfinite(self.plain.distances([site], TIP_RADIUS)))
        nodes = nodes[~self.is_taken[nodes]]
        self.is_taken[nodes] = True
        return role, nodes

    def _ring(self, site):
        """The band of a limb about `site`; None where it is not on a limb."""
        if not numpy.isfinite(self.height[site]):
            return None
        band = numpy.abs(self.height - self.height[site]) < RING_HEIGHT / 2
        inside = self.plain.distances([site], numpy.inf, band)
        band = numpy.flatnonzero(band & numpy.isfinite(inside))
        extent = numpy.linalg.norm(numpy.ptp(self.positions[band], axis=0)) / self.size
        return band if extent < RING_WIDEST else None


# ----------------------------------------------------------------------------------------- graphs


def _coarsened(positions, triangles, poses):
    """(node of each vertex [V], positions [N][3], edges [E][2], poses [S][N][3]).

    The nodes are the vertices, or for a fine mesh patches: what is connected within a cell of a
    grid, so that two fingers in one cell stay two.
    """
    edges = _edges(triangles)
    if len(positions) <= FINEST:
        return numpy.arange(len(positions)), positions, edges, poses
    corners = positions[triangles]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * numpy.linalg.norm(normals, axis=1).sum()
    # A grid cuts a surface into about two patches for each square of its cell's side.
    side = numpy.sqrt(2 * area / FINEST) or 1.0
    cells = numpy.floor((positions - positions.min(axis=0)) / side).astype(numpy.int64)
    inside = edges[(cells[edges[:, 0]] == cells[edges[:, 1]]).all(axis=1)]
    labels = components(len(positions), inside[:, [0, 1, 1]])
    _, patches = numpy.unique(labels, return_inverse=True)
    between = numpy.sort(patches[edges], axis=1)
    between = numpy.unique(between[between[:, 0] != between[:, 1]], axis=0)
    count = patches.max() + 1
    sizes = numpy.bincount(patches, minlength=count)[:, None]

    def means(shape):
        sums = [numpy.bincount(patches, shape[:, k], count) for k in range(3)]
        return numpy.stack(sums, axis=1) / sizes

    return patches, means(positions), between, numpy.array([means(pose) for pose in poses])


def _edges(triangles):
    pairs = numpy.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs.sort(axis=1)
    return numpy.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


class _Graph:
    """Shortest distances along edges; lists, for they are what plain Python reads fastest."""

    def __init__(self, vertex_count, edges, lengths):
        both = numpy.concatenate([edges, edges[:, ::-1]])
        order = numpy.argsort(both[:, 0], kind="stable")
        self.bounds = numpy.searchsorted(both[order, 0], numpy.arange(vertex_count + 1)).tolist()
        self.ends = both[order, 1].tolist()
        self.lengths = numpy.concatenate([lengths, lengths])[order].tolist()
        self.vertex_count = vertex_count

    def distances(self, sources, limit=numpy.inf, allowed=None):
        """[V], inf for what is beyond the limit or not allowed."""
        distances = [numpy.inf] * self.vertex_count
        self.lower(distances, sources, limit, allowed)
        return distances

    def lower(self, distances, sources, limit=numpy.inf, allowed=None):
        """Take more sources into `distances`; visits only what they are nearer to."""
        heap = [(0.0, source) for source in sources]
        for source in sources:
            distances[source] = 0.0
        bounds, ends, lengths = self.bounds, self.ends, self.lengths
        while heap:
            distance, vertex = heapq.heappop(heap)
            if distance > distances[vertex]:
                continue
            for k in range(bounds[vertex], bounds[vertex + 1]):
                end, further = ends[k], distance + lengths[k]
                if further < distances[end] and further <= limit:
                    if allowed is None or allowed[end]:
                        distances[end] = further
                        heapq.heappush(heap, (further, end))


def _blurred(vertex_count, edges, values):
    """Values of edges [E] at the nodes [N], averaged over a few rings: one crease is no joint."""
    first, second = edges.T
    degree = numpy.maximum(numpy.bincount(edges.ravel(), minlength=vertex_count), 1)

    def gathered(a, b):
        at_first = numpy.bincount(first, a, vertex_count)
        return (at_first + numpy.bincount(second, b, vertex_count)) / degree

    out = gathered(values, values)
    for _ in range(4):
        out = 0.5 * (out + gathered(out[second], out[first]))
    return out


# ---------------------------------------------------------------------------------------- bending


def bending(positions, edges, exemplars):
    """How much the exemplars turn the two ends of each edge against each other: radians [E],
    the mean over the exemplars."""
    first, second = edges.T
    total = numpy.zeros(len(edges))
    for exemplar in exemplars:
        rotations = _rotations(positions, exemplar, first, second)
        apart = rotations[first] - rotations[second]
        # The chord of a rotation by an angle a is 2 sqrt(2) sin(a / 2).
        chord = numpy.sqrt(numpy.einsum("eij,eij->e", apart, apart))
        total += 2 * numpy.arcsin(numpy.minimum(chord / numpy.sqrt(8), 1.0))
    return total / max(1, len(exemplars))


def _rotations(positions, exemplar, first, second):
    """The rotation of each vertex's neighbourhood of two rings [V][3][3], by Kabsch."""
    rest, posed = (shape[second] - shape[first] for shape in (positions, exemplar))
    outer = (rest[:, :, None] * posed[:, None, :]).reshape(-1, 9)
    count = len(positions)
    ring = numpy.empty((count, 9))
    wide = numpy.empty((count, 9))
    for k in range(9):
        ring[:, k] = numpy.bincount(first, outer[:, k], count)
        ring[:, k] += numpy.bincount(second, outer[:, k], count)
        wide[:, k] = ring[:, k] + numpy.bincount(first, ring[second, k], count)
        wide[:, k] += numpy.bincount(second, ring[first, k], count)
    left, _, right = numpy.linalg.svd(wide.reshape(count, 3, 3))
    # A reflection is no rotation: turn the least certain axis round.
    right[numpy.linalg.det(left @ right) < 0, 2] *= -1
    return left @ right
