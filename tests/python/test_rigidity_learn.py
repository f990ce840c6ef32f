# SPDX-License-Identifier: GPL-3.0-or-later
"""Learning radii [Rigidity, 3.4], against loops over vertices and poses; and on real meshes."""

import time

import numpy

import support
from rigidity_support import (
    Mesh,
    ball,
    bar,
    closest_rotation,
    cotangent_weights,
    learn_radii,
    radius_energies,
    rings,
)


def voronoi_areas(positions, triangles):
    """Mixed areas of Meyer et al., by circumcentres."""
    areas = numpy.zeros(len(positions))
    for triangle in triangles:
        corners = positions[triangle].astype(float)
        edges = [corners[(k + 2) % 3] - corners[(k + 1) % 3] for k in range(3)]
        area = numpy.linalg.norm(numpy.cross(edges[0], edges[1])) / 2
        dots = [-(edges[(k + 1) % 3] @ edges[(k + 2) % 3]) for k in range(3)]
        if min(dots) < 0:
            share = numpy.full(3, area / 4)
            share[numpy.argmin(dots)] = area / 2
        else:
            lengths = numpy.array([edge @ edge for edge in edges])
            weights = lengths * (lengths.sum() - 2 * lengths)
            centre = weights @ corners / weights.sum()
            share = numpy.empty(3)
            for k in range(3):
                ahead = (corners[k] + corners[(k + 1) % 3]) / 2
                behind = (corners[k] + corners[(k + 2) % 3]) / 2
                quad = numpy.cross(centre - corners[k], ahead - behind)
                share[k] = numpy.linalg.norm(quad) / 2
        areas[triangle] += share
    return areas


def energies_by_loops(positions, triangles, poses, radii):
    positions = positions.astype(float)
    weights = cotangent_weights(positions, triangles)
    neighbours = rings(len(positions), triangles)
    areas = voronoi_areas(positions, triangles)
    found = numpy.zeros((len(radii), len(positions)))
    for row, radius in enumerate(radii):
        for k in range(len(positions)):
            edges = [(i, j) for i in ball(neighbours, k, radius - 1) for j in neighbours[i]]
            w = numpy.array([weights[edge] for edge in edges])
            i, j = numpy.array(edges).T
            before = positions[i] - positions[j]
            area = areas[list(ball(neighbours, k, radius))].sum()
            for pose in poses.astype(float):
                after = pose[i] - pose[j]
                rotation = closest_rotation((after * w[:, None]).T @ before)
                energy = (w * ((after - before @ rotation.T) ** 2).sum(axis=1)).sum()
                found[row, k] += energy / area / len(poses)
    return found


def hinged(positions, angle):
    """A bar bent about its middle, sharply."""
    posed = positions.astype(float).copy()
    right = posed[:, 0] > 0
    sine, cosine = numpy.sin(angle), numpy.cos(angle)
    turned = numpy.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    posed[right] = posed[right] @ turned.T
    return posed.astype(numpy.float32)


def hinge():
    positions, triangles = bar(along=24)
    poses = numpy.stack([hinged(positions, angle) for angle in (0.9, -0.7, 1.2)])
    return positions, triangles, poses


def test_energies_are_those_of_the_formula():
    positions, triangles, poses = hinge()
    found = radius_energies(Mesh(positions, triangles), poses, 1, 4)
    expected = energies_by_loops(positions, triangles, poses, range(1, 5))
    numpy.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_radii_are_the_best_of_the_energies():
    positions, triangles, poses = hinge()
    mesh = Mesh(positions, triangles)
    for omega in (0, 0.05, 0.3, 10):
        for low, high in ((1, 6), (2, 4), (3, 3)):
            energies = radius_energies(mesh, poses, low, high)
            cost = energies + omega * numpy.arange(high - low, -1, -1)[:, None]
            best = high - numpy.argmin(cost[::-1], axis=0)
            radii = learn_radii(mesh, poses, low, high, omega)
            assert (radii == best).all(), (omega, low, high)


def test_rigid_poses_are_as_stiff_as_can_be():
    positions, triangles = bar()
    rotation = closest_rotation(numpy.random.default_rng(1).normal(size=(3, 3)))
    pose = (positions @ rotation.T + [1, 2, 3]).astype(numpy.float32)
    assert (learn_radii(Mesh(positions, triangles), pose[None]) == 6).all()


def test_a_hinge_is_soft_and_what_it_joins_is_stiff():
    positions, triangles, poses = hinge()
    radii = learn_radii(Mesh(positions, triangles), poses, omega=0.05)
    near = numpy.abs(positions[:, 0]) < 0.2
    far = numpy.abs(positions[:, 0]) > 1.5
    assert radii[near].max() <= 2, radii[near]
    assert radii[far].min() == 6, radii[far]


def test_scale_does_not_matter():
    positions, triangles, poses = hinge()
    small = radius_energies(Mesh(positions, triangles), poses)
    for scale in (1e-3, 1e4):
        mesh = Mesh((positions * scale).astype(numpy.float32), triangles)
        scaled = radius_energies(mesh, (poses * scale).astype(numpy.float32))
        numpy.testing.assert_allclose(scaled, small, rtol=1e-3, atol=1e-6)


def parts(positions):
    """Vertices of Sumner and Popovic's beasts, which stand along z, y up: shares of their size."""
    share = (positions - positions.min(axis=0)) / numpy.ptp(positions, axis=0)
    return {
        "head": share[:, 2] > 0.9,
        "hooves": share[:, 1] < 0.05,
        "shoulders, hips": (share[:, 1] > 0.3) & (share[:, 1] < 0.45),
    }


def test_heads_and_hooves_are_stiffer_than_joints():
    for name in ("horse", "lion", "cat"):
        with numpy.load(support.data(f"{name}.npz")) as arrays:
            poses, triangles = arrays["poses"], arrays["faces"].astype(numpy.uint32)
        mesh = Mesh(poses[0], triangles)
        for omega in (0.3, 0.1):
            radii = learn_radii(mesh, poses[1:], omega=omega)
            means = {part: radii[members].mean() for part, members in parts(poses[0]).items()}
            print(f"  {name}, omega {omega}: mean r", {k: round(v, 2) for k, v in means.items()})
            joints = means["shoulders, hips"]
            least = 1 if omega == 0.1 else 0
            assert means["head"] > joints + least, (name, omega)
            assert means["hooves"] > joints + least, (name, omega)


def test_two_hundred_frames():
    """Whole sequences are measured, and what moves most is softest."""
    with numpy.load(support.data("cow_sequence.npz")) as arrays:
        poses, triangles = arrays["poses"], arrays["faces"].astype(numpy.uint32)
    mesh = Mesh(poses[0], triangles)
    start = time.process_time()
    energies = radius_energies(mesh, poses[1:])
    print(f"  {len(poses) - 1} frames in {time.process_time() - start:.2f} s of processor time")
    some = radius_energies(mesh, poses[1::40])
    assert energies.shape == some.shape == (6, len(poses[0]))
    parted = [radius_energies(mesh, poses[1:103]), radius_energies(mesh, poses[103:])]
    numpy.testing.assert_allclose((parted[0] + parted[1]) / 2, energies, rtol=1e-9)


if __name__ == "__main__":
    support.run(globals())
