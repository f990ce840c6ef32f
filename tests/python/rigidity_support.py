# SPDX-License-Identifier: GPL-3.0-or-later
"""[Rigidity] once more, by loops and dense algebra: eq. 1 as it is printed, nothing
shared with the library."""

import os
import sys

import numpy

import support

os.environ.setdefault("EXEMPLAR_LIBRARY", str(support.LIBRARY))
sys.path.insert(0, str(support.ROOT / "blender_addon"))

from native import (  # noqa: E402,F401
    Handles,
    Kind,
    Mesh,
    Rigidity,
    RigiditySettings,
    learn_radii,
    radius_energies,
)


def cotangent_weights(positions, triangles):
    """{(i, j): w_ij} of eq. 2, negative cotangents as zero."""
    weights = {}
    for triangle in triangles:
        for corner in range(3):
            a, b, c = (int(triangle[(corner + k) % 3]) for k in range(3))
            u, v = positions[b] - positions[a], positions[c] - positions[a]
            cotangent = u @ v / numpy.linalg.norm(numpy.cross(u, v))
            for edge in ((b, c), (c, b)):
                weights[edge] = weights.get(edge, 0) + max(cotangent, 0) / 2
    return weights


def rings(vertex_count, triangles):
    neighbours = [set() for _ in range(vertex_count)]
    for a, b, c in triangles:
        neighbours[a] |= {int(b), int(c)}
        neighbours[b] |= {int(a), int(c)}
        neighbours[c] |= {int(a), int(b)}
    return neighbours


def ball(neighbours, vertex, steps):
    """Vertices within so many edges."""
    found = front = {vertex}
    for _ in range(steps):
        front = set().union(*(neighbours[v] for v in front)) - found if front else set()
        found = found | front
    return found


def closest_rotation(moment):
    u, _, vt = numpy.linalg.svd(moment)
    sign = numpy.sign(numpy.linalg.det(u @ vt))
    return u @ numpy.diag([1, 1, sign]) @ vt


class Oracle:
    """The energy of every neighbourhood, by eq. 1."""

    def __init__(self, positions, triangles, radii):
        self.positions = numpy.asarray(positions, float)
        weights = cotangent_weights(self.positions, triangles)
        neighbours = rings(len(positions), triangles)
        self.edges = []
        for k, radius in enumerate(radii):
            edges = [(i, j) for i in sorted(ball(neighbours, k, radius - 1)) for j in neighbours[i]]
            self.edges.append(
                (numpy.array(edges, int).reshape(-1, 2), numpy.array([weights[e] for e in edges]))
            )

    def local(self, deformed):
        """(rotations [V][3][3], energies [V]) of the best rotations."""
        rotations, energies = [], []
        for edges, weights in self.edges:
            before = self.positions[edges[:, 0]] - self.positions[edges[:, 1]]
            after = deformed[edges[:, 0]] - deformed[edges[:, 1]]
            rotation = closest_rotation((after * weights[:, None]).T @ before)
            rotations.append(rotation)
            energies.append((weights * ((after - before @ rotation.T) ** 2).sum(axis=1)).sum())
        return numpy.array(rotations), numpy.array(energies)

    def system(self, rotations):
        """(A, b): the gradient of eq. 1 in the positions is 2 (A p' - b)."""
        count = len(self.positions)
        matrix, right = numpy.zeros((count, count)), numpy.zeros((count, 3))
        for (edges, weights), rotation in zip(self.edges, rotations):
            turned = (self.positions[edges[:, 0]] - self.positions[edges[:, 1]]) @ rotation.T
            i, j = edges.T
            numpy.add.at(matrix, (i, i), weights)
            numpy.add.at(matrix, (j, j), weights)
            numpy.add.at(matrix, (i, j), -weights)
            numpy.add.at(matrix, (j, i), -weights)
            numpy.add.at(right, i, weights[:, None] * turned)
            numpy.add.at(right, j, -weights[:, None] * turned)
        return matrix, right

    def minimise(self, fixed, places, iterations):
        """Local and global steps from the identity, vertices `fixed` held; energies after each."""
        free = numpy.setdiff1d(numpy.arange(len(self.positions)), fixed)
        rotations = numpy.tile(numpy.eye(3), (len(self.positions), 1, 1))
        deformed, history = self.positions.copy(), []
        deformed[fixed] = places
        matrix, _ = self.system(rotations)
        for _ in range(iterations):
            right = self.system(rotations)[1]
            right = right[free] - matrix[numpy.ix_(free, fixed)] @ places
            deformed[free] = numpy.linalg.solve(matrix[numpy.ix_(free, free)], right)
            rotations, energies = self.local(deformed)
            history.append(energies.sum())
        return deformed, numpy.array(history)


def bar(along=12, around=8, length=4.0, radius=0.4):
    """A closed tube about the x axis, its triangles acute or nearly so: (positions, triangles)."""
    angle = 2 * numpy.pi * numpy.arange(around) / around
    points = []
    for step in range(along):
        turned = angle + numpy.pi / around * (step % 2)
        x = numpy.full(around, length * (step / (along - 1) - 0.5))
        points.append(numpy.stack([x, radius * numpy.cos(turned), radius * numpy.sin(turned)], 1))
    positions = numpy.concatenate([*points, [[-length / 2 - radius / 2, 0, 0]]])
    positions = numpy.concatenate([positions, [[length / 2 + radius / 2, 0, 0]]])
    first, last = along * around, along * around + 1
    triangles = []
    for step in range(along - 1):
        for k in range(around):
            a, b = step * around + k, step * around + (k + 1) % around
            c, d = a + around, b + around
            triangles += [(a, c, d), (a, d, b)] if step % 2 else [(a, c, b), (b, c, d)]
    for k in range(around):
        triangles.append((first, k, (k + 1) % around))
        end = (along - 1) * around
        triangles.append((last, end + (k + 1) % around, end + k))
    return positions.astype(numpy.float32), numpy.array(triangles, numpy.uint32)


def end_handles(positions, share=0.12, kind=Kind.ORIENTED):
    """Both ends of a bar as handles, and their vertices."""
    x = positions[:, 0]
    reach = share * numpy.ptp(x)
    ends = [
        numpy.flatnonzero(x < x.min() + reach).astype(numpy.uint32),
        numpy.flatnonzero(x > x.max() - reach).astype(numpy.uint32),
    ]
    return Handles([kind, kind], ends), ends


def turn(axis, angle):
    axis = numpy.asarray(axis, float) / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross
