# SPDX-License-Identifier: GPL-3.0-or-later
"""What the reduced solver reports is the energy of the mesh it never looks at [AMRAP, eq. 7-10]."""

import unittest

import numpy

import amrap_support
import support
from amrap_support import Amrap, AmrapSettings, Kind, Mesh, MeshEnergy
from native.declarations import Blend, Descent

SETTINGS = {
    "usual": AmrapSettings(),
    "one iteration": AmrapSettings(iterations=1),
    "lambda 5": AmrapSettings(lambda_=5),
    "global": AmrapSettings(blend=Blend.GLOBAL),
    "guarded": AmrapSettings(descent=Descent.TRUST_REGION),
    "converged": AmrapSettings(tolerance=1e-6),
    "no rotations": AmrapSettings(rotations=False),
}


class _Case:
    """A bound mesh and its energy from the definition."""

    def __init__(self, poses, faces, handles):
        self.poses = poses
        self.mesh = Mesh(poses[0], faces)
        self.deformer = Amrap(self.mesh, poses, handles)
        self.energy = MeshEnergy(self.mesh, self.deformer, poses, faces)
        self.size = amrap_support.diagonal(poses[0])

    def targets(self, s):
        return amrap_support.between(self.deformer, s, (s + 1) % len(self.poses), 0.45)


class Energy(unittest.TestCase):
    def check_objective(self, case, settings, targets):
        """E of eq. 10 over the edges of the triangles, to 1e-6."""
        deformer = case.deformer
        report = deformer.solve(targets, settings)
        blend, energies = deformer.blend_weights(), deformer.exemplar_energies()
        elastic = case.energy.elastic(deformer.positions_f64(), blend, deformer.rotations())
        strength = 0.5 if settings.lambda_ is None else settings.lambda_
        objective = numpy.sqrt(elastic) + strength * (blend * numpy.sqrt(energies)).sum()
        # Where nothing is strained, what is left is the rounding of positions.
        rounding = 1e-7 * case.size
        self.assertLess(abs(objective - report.objective), 1e-6 * objective + rounding)
        self.assertLess(
            abs(numpy.sqrt(elastic) - numpy.sqrt(report.elastic_energy)),
            1e-6 * numpy.sqrt(elastic) + rounding,
        )

    def check_exemplars(self, case, targets):
        """D is what the exemplars' own poses cost, with the rotations that suit those best."""
        # To a tolerance: by default they are found by a fixed number of iterations.
        case.deformer.solve(targets, AmrapSettings(tolerance=1e-8))
        energies = case.deformer.exemplar_energies()
        for s in range(len(case.poses)):
            positions = case.deformer.exemplar_positions(s)
            rotations = case.energy.fitted(positions, s)
            measured = case.energy.single(positions, s, rotations)
            # Their alternation stops short of where it would end for ever: fitting anew gains.
            total = energies[:, s].sum()
            self.assertLess(measured.sum(), total * (1 + 1e-6) + 1e-13 * case.size**2)
            self.assertGreater(measured.sum(), total * (1 - 1e-3) - 1e-13 * case.size**2)
            self.assertLess(abs(measured - energies[:, s]).max(), 5e-3 * total + 1e-13)

    def check(self, case):
        for s in range(2):
            targets = case.targets(s)
            for name, settings in SETTINGS.items():
                with self.subTest(settings=name, targets=s):
                    self.check_objective(case, settings, targets)
            with self.subTest(exemplars_for=s):
                self.check_exemplars(case, targets)

    def test_tube(self):
        poses, faces = amrap_support.tube_poses()
        self.check(_Case(poses, faces, amrap_support.spread_handles(poses, faces, 5)))

    def test_tube_with_oriented_and_free_handles(self):
        poses, faces = amrap_support.tube_poses()
        kinds = [Kind.ORIENTED, Kind.PINNED, Kind.ORIENTED, Kind.FREE, Kind.FREE]
        handles = amrap_support.spread_handles(poses, faces, 5, kinds, rings=1)
        self.check(_Case(poses, faces, handles))

    def test_plane(self):
        """A planar mesh in a tilted plane."""
        flat = numpy.stack(numpy.meshgrid(numpy.arange(13), numpy.arange(7)), axis=-1) / 6
        corners = numpy.arange(13 * 7).reshape(7, 13)
        a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
        faces = numpy.concatenate(
            [numpy.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
        )
        flat = numpy.concatenate([flat.reshape(-1, 2), numpy.zeros((91, 1))], axis=1)
        tilt = numpy.linalg.qr(numpy.array([[1, 2, 3], [0, 1, 4], [5, 6, 0.0]]))[0]
        poses = [flat, amrap_support.bent(flat, 1.2, puff=0.3), amrap_support.bent(flat, -0.8)]
        poses = (numpy.array(poses) @ tilt.T + [1, 2, 3]).astype(numpy.float32)
        case = _Case(poses, faces, amrap_support.spread_handles(poses, faces, 4))
        self.assertEqual(case.deformer.info.dimension, 2)
        self.check(case)

    def check_data(self, name, pose_count, handle_count):
        poses, faces = amrap_support.data(name, pose_count)
        handles = amrap_support.spread_handles(poses, faces, handle_count)
        self.check(_Case(poses, faces, handles))

    def test_horse(self):
        self.check_data("horse", 3, 10)

    def test_lion(self):
        self.check_data("lion", 6, 7)

    def test_cat(self):
        self.check_data("cat", 6, 7)

    def test_face(self):
        self.check_data("arkit_face", 8, 9)


if __name__ == "__main__":
    support.run(globals())
