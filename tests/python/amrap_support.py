# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, handles and poses for tests of AMRAP, and its energy by definition [AMRAP, 5.2].

What is here sees the public interface only, and vertices where the library has none.
"""

import os
import sys

import numpy

import support

os.environ.setdefault("EXEMPLAR_LIBRARY", str(support.LIBRARY))
sys.path.insert(0, str(support.ROOT / "blender_addon"))

from native.amrap import Amrap, AmrapSettings  # noqa: E402
from native.declarations import Kind  # noqa: E402
from native.handles import Handles  # noqa: E402
from native.mesh import Mesh  # noqa: E402

# ------------------------------------------------------------------------------------- meshes


def tube(around=10, along=20, radius=0.25, length=3.0):
    """An open tube along x: positions [V][3], faces [F][3]. Bends and twists like a limb."""
    angle = numpy.arange(around) * 2 * numpy.pi / around
    ring = numpy.stack([0 * angle, radius * numpy.cos(angle), radius * numpy.sin(angle)], axis=1)
    steps = numpy.linspace(0, length, along + 1)
    positions = (ring[None] + steps[:, None, None] * [1, 0, 0]).reshape(-1, 3)
    faces = []
    for i in range(along):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            faces += [[a, b, b + around], [a, b + around, a + around]]
    return positions, numpy.array(faces)


def bent(positions, angle, puff=0.0, twist=0.0):
    """The tube as an arc of `angle` in the plane x-y, thicker in the middle by `puff`."""
    length = numpy.ptp(positions[:, 0])
    share = (positions[:, 0] - positions[:, 0].min()) / length
    wide = 1 + puff * numpy.sin(numpy.pi * share)
    cosine, sine = numpy.cos(twist * share), numpy.sin(twist * share)
    y = wide * (cosine * positions[:, 1] - sine * positions[:, 2])
    z = wide * (sine * positions[:, 1] + cosine * positions[:, 2])
    if angle == 0:
        return numpy.stack([positions[:, 0], y, z], axis=1)
    radius, turn = length / angle, angle * share
    out = [(radius - y) * numpy.sin(turn), radius - (radius - y) * numpy.cos(turn), z]
    return numpy.stack(out, axis=1)


def tube_poses():
    positions, faces = tube()
    poses = [
        positions,
        bent(positions, 1.6, puff=0.4),
        bent(positions, -1.1, puff=-0.3, twist=0.8),
        bent(positions, 0.7, twist=-1.2),
    ]
    return numpy.array(poses, numpy.float32), faces


def data(name, count):
    """The first `count` poses of a real set, and its faces; skips where the data is not there."""
    with numpy.load(support.data(f"{name}.npz")) as found:
        return found["poses"][:count].copy(), found["faces"].copy()


def diagonal(positions):
    return float(numpy.linalg.norm(numpy.ptp(positions, axis=0)))


# ------------------------------------------------------------------------------------ handles


def neighbours(vertex, faces):
    return numpy.unique(faces[(faces == vertex).any(axis=1)])


def spread_vertices(positions, count):
    """Vertices far from one another, the first of them furthest from the middle."""
    distance = numpy.linalg.norm(positions - positions.mean(axis=0), axis=1)
    chosen = [int(distance.argmax())]
    distance = numpy.linalg.norm(positions - positions[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(distance.argmax()))
        distance = numpy.minimum(
            distance, numpy.linalg.norm(positions - positions[chosen[-1]], axis=1)
        )
    return chosen


def spread_handles(poses, faces, count, kinds=None, rings=0):
    """Handles of one vertex, or of a vertex and its neighbours, spread over the reference."""
    sets = [[v] for v in spread_vertices(poses[0].astype(float), count)]
    for _ in range(rings):
        sets = [numpy.unique(numpy.concatenate([neighbours(v, faces) for v in s])) for s in sets]
    return Handles([Kind.PINNED] * count if kinds is None else kinds, sets)


def telling_handles(poses, count):
    """Handles of one vertex, by which the poses differ: as face artists would place them. The
    poses that are hardest to tell apart get the next handle, where they differ most."""
    chosen = spread_vertices(poses[0].astype(float), 2)
    while len(chosen) < count:
        held = poses[:, chosen].reshape(len(poses), -1)
        distance = numpy.linalg.norm(held[:, None] - held[None], axis=2)
        distance[numpy.tri(len(poses), dtype=bool)] = numpy.inf
        one, other = numpy.unravel_index(distance.argmin(), distance.shape)
        apart = numpy.linalg.norm(poses[one] - poses[other], axis=1)
        apart[chosen] = 0
        chosen.append(int(apart.argmax()))
    return Handles([Kind.PINNED] * count, [[v] for v in chosen])


def between(deformer, s, t, share):
    """Targets on the way from exemplar s to exemplar t, which neither of them meets."""
    return (1 - share) * deformer.handle_pose(s) + share * deformer.handle_pose(t)


# ------------------------------------------------------------------------------------- energy


class MeshEnergy:
    """Sums over the edges of the triangles, c_ge = cotangent weight x share of corners in g."""

    def __init__(self, mesh, deformer, exemplars, faces):
        self.faces = faces.astype(int)
        self.cotangents = mesh.cotangents()
        self.groups = deformer.edge_groups().astype(int)
        self.group_count = deformer.info.edge_group_count
        self.edges = self.edges_of(exemplars.astype(float))  # [S][F][3][3]

    def edges_of(self, positions):
        """[...][F][3][3]: the edge opposite to each corner."""
        corners = positions[..., self.faces, :]
        return corners[..., [2, 0, 1], :] - corners[..., [1, 2, 0], :]

    def by_group(self, positions, blended_edges):
        """1/2 sum c_ge |edge - blended edge|^2 for each group; blended_edges(groups of faces)."""
        edges = self.edges_of(positions)
        energies = numpy.zeros(self.group_count)
        for corner in range(3):
            groups = self.groups[self.faces[:, corner]]
            square = ((edges - blended_edges(groups)) ** 2).sum(axis=2)
            numpy.add.at(energies, groups, (self.cotangents * square).sum(axis=1) / 6)
        return energies

    def elastic(self, positions, blend, rotations):
        """E_d [AMRAP, eq. 9]. blend [G][S], rotations [G][S][3][3]."""
        turns = blend[:, :, None, None] * rotations

        def blended(groups):
            return numpy.einsum("fsij,sfej->fei", turns[groups], self.edges)

        return self.by_group(positions, blended).sum()

    def fitted(self, positions, exemplar):
        """The rotations of exemplar s closest to a pose [AMRAP, eq. 7], [G][3][3]."""
        edges = self.edges_of(positions)
        moments = numpy.zeros((self.group_count, 3, 3))
        for corner in range(3):
            groups = self.groups[self.faces[:, corner]]
            each = numpy.einsum("fe,fei,fej->fij", self.cotangents, edges, self.edges[exemplar])
            numpy.add.at(moments, groups, each)
        u, _, v = numpy.linalg.svd(moments)
        flip = numpy.ones((self.group_count, 3))
        flip[:, 2] = numpy.linalg.det(u @ v)
        return (u * flip[:, None, :]) @ v

    def single(self, positions, exemplar, rotations):
        """The ARAP energy of exemplar s in each group, [G]. rotations [G][3][3]."""

        def turned(groups):
            return numpy.einsum("fij,fej->fei", rotations[groups], self.edges[exemplar])

        return self.by_group(positions, turned)


__all__ = [name for name in dir() if not name.startswith("_")] + [
    "Amrap",
    "AmrapSettings",
    "Mesh",
]
