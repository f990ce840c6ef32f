# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigidity against eq. 1, edge by edge, and against plain steps in dense algebra."""

import numpy

import support
from rigidity_support import Mesh, Oracle, Rigidity, RigiditySettings, bar, end_handles, turn


def bent(radii, angle=1.0):
    """A bar bent by its ends: (oracle, deformer, targets, fixed vertices, where they are)."""
    positions, triangles = bar()
    handles, ends = end_handles(positions)
    oracle = Oracle(positions, triangles, numpy.broadcast_to(radii, len(positions)))
    deformer = Rigidity(Mesh(positions, triangles), handles, radii, handle_size=0)
    targets = deformer.handle_pose(0)
    targets[1, :, :3] = turn([0, 1, 0.2], angle)
    targets[1, :, 3] += [-0.6, 0.3, -1.2]
    fixed = numpy.concatenate(ends)
    places = []
    for handle, vertices in enumerate(ends):
        arms = positions[vertices].astype(float) - positions[vertices].astype(float).mean(axis=0)
        places.append(arms @ targets[handle, :, :3].T + targets[handle, :, 3])
    return oracle, deformer, targets, fixed, numpy.concatenate(places)


def mixed(count=98):
    return numpy.random.default_rng(3).integers(1, 8, count).astype(numpy.int32)


def test_plain_steps_are_those_of_the_paper():
    plain = RigiditySettings(acceleration=False, tolerance=0, iterations=12, coarse_start=0)
    for radii in (1, 2, 4, 7, 40, mixed()):
        oracle, deformer, targets, fixed, places = bent(radii)
        with deformer:
            report = deformer.solve(targets, plain, history_capacity=12)
            deformed, history = oracle.minimise(fixed, places, 12)
            numpy.testing.assert_allclose(report.history, history, rtol=1e-9)
            numpy.testing.assert_allclose(deformer.positions_f64(), deformed, atol=1e-9)


def test_energies_and_rotations_are_those_of_the_positions():
    for radii in (1, 3, mixed()):
        oracle, deformer, targets, *_ = bent(radii)
        with deformer:
            report = deformer.solve(targets)
            rotations, energies = oracle.local(deformer.positions_f64())
            numpy.testing.assert_allclose(deformer.energies(), energies, atol=1e-11)
            numpy.testing.assert_allclose(deformer.rotations(), rotations, atol=1e-7)
            assert abs(report.elastic_energy - energies.sum()) < 1e-11 * energies.sum() + 1e-12


def test_acceleration_ends_lower_than_it_began_and_no_higher_than_plain_steps():
    for radii in (1, 2, 5, mixed()):
        _, deformer, targets, *_ = bent(radii, angle=2.5)
        with deformer:
            tight = RigiditySettings(tolerance=1e-9, iterations=5000, coarse_start=0)
            fast = deformer.solve(targets, tight, history_capacity=5000)
            plain = deformer.solve(
                targets,
                RigiditySettings(
                    tolerance=1e-9, iterations=5000, acceleration=False, coarse_start=0
                ),
                history_capacity=5000,
            )
            print(radii if numpy.ndim(radii) == 0 else "mixed", fast.iterations, plain.iterations)
            assert (numpy.diff(fast.history) <= 0).all()
            assert (numpy.diff(plain.history) <= 0).all()
            assert abs(fast.elastic_energy / plain.elastic_energy - 1) < 1e-4


if __name__ == "__main__":
    support.run(globals())
