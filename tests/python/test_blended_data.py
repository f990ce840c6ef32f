# SPDX-License-Identifier: GPL-3.0-or-later
"""Blended on a real mesh: exemplars come back, a left-out pose's size is found, single precision is
enough, rows of every kind hold. Distances are shares of the bounding box's diagonal."""

import unittest

import numpy

import amrap_support
import support
from amrap_support import Mesh
from native import Blended, BlendedBinding, Dictionary, Handles, Kind, decompose

POINTS = 10


class _Bound:
    def __init__(self):
        self.poses, self.faces = amrap_support.data("lion", 8)
        self.mesh = Mesh(self.poses[0], self.faces)
        spread = amrap_support.spread_handles(self.poses, self.faces, POINTS)
        self.points = spread.vertices[spread.offsets[:-1]]
        self.handles = Handles([Kind.PINNED] * POINTS, [numpy.array([v]) for v in self.points])
        self.size = amrap_support.diagonal(self.poses[0].astype(float))
        self.deformer = Blended(self.mesh, self.poses[:7], self.handles)

    def targets(self, points):
        targets = numpy.zeros((POINTS, 3, 4))
        targets[:, :, :3] = numpy.eye(3)
        targets[:, :, 3] = points
        return targets

    def distance(self, positions, pose):
        return numpy.linalg.norm(positions - pose, axis=1).max() / self.size


_bound = []


def bound():
    if not _bound:
        _bound.append(_Bound())
    return _bound[0]


class Lion(unittest.TestCase):
    def test_exemplars_come_back_in_both_precisions(self):
        it = bound()
        for s in range(7):
            it.deformer.solve(it.deformer.handle_pose(s))
            self.assertEqual(it.deformer.outcome().exemplar, s)
            self.assertLess(it.distance(it.deformer.positions_f64(), it.poses[s]), 1e-5)
            self.assertLess(it.distance(it.deformer.positions(), it.poses[s]), 2e-5)

    def test_size_of_a_left_out_pose(self):
        it = bound()
        pose = it.poses[7].astype(float)
        for size in (1.5, 0.7):
            it.deformer.solve(it.targets(size * pose[it.points]))
            self.assertLess(abs(it.deformer.outcome().scale / size - 1), 0.15)
            self.assertLess(it.distance(it.deformer.positions_f64() / size, pose), 0.15)

    def test_discs_and_differences_hold(self):
        it = bound()
        rows = [it.mesh.disc(v, 0.05 * it.size) for v in it.points[:3]]
        rows.append(it.mesh.differential(int(it.points[4])))
        for vertices, coefficients in rows[:3]:
            self.assertGreater(len(vertices), 5)
            self.assertAlmostEqual(coefficients.sum(), 1, places=12)
        self.assertLess(abs(rows[3][1].sum()), 1e-9 * abs(rows[3][1]).max())
        pose = it.poses[3].astype(float)
        values = numpy.array([coefficients @ pose[vertices] for vertices, coefficients in rows])
        it.deformer.add_rows(rows, [1, 1, 1, 1e-4])
        try:
            it.deformer.solve(it.deformer.handle_pose(3), row_targets=values)
            self.assertLess(it.distance(it.deformer.positions_f64(), it.poses[3]), 1e-5)
        finally:
            it.deformer.remove_rows(0, len(rows))

    def test_reduction_halves_and_says_what_it_costs(self):
        info = bound().deformer.blended_info()
        self.assertEqual(info.atom_count, -(-info.whole_atom_count // 2))
        self.assertTrue(0 < info.reduction_error < 1)

    def test_skeleton_weights_are_a_decomposition(self):
        it = bound()
        binding = BlendedBinding(dictionary=Dictionary.SKELETON)
        with Blended(it.mesh, it.poses[:7], it.handles, binding) as deformer:
            weights = deformer.functions()
            self.assertTrue((weights[0] == 1).all())
            self.assertLess(abs(weights[1:].sum(axis=0) - 1).max(), 1e-5)
            self.assertLessEqual((weights[1:] > 0).sum(axis=0).max(), 4)
        found = decompose(it.mesh, it.poses[:7])
        self.assertLess(found.error, 0.7 * found.begin_error)
        self.assertLess(found.error / it.size, 0.01)


if __name__ == "__main__":
    support.run(globals())
