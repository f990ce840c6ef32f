# SPDX-License-Identifier: GPL-3.0-or-later
"""What r does to a bend [Rigidity, figures 3 and 6]: numbers for what the paper shows."""

import sys

import numpy

import support
from rigidity_support import Handles, Kind, Mesh, Rigidity, RigiditySettings

sys.path.insert(0, str(support.ROOT / "tests" / "bench"))

from inputs import box_bar  # noqa: E402

TO_THE_END = RigiditySettings(tolerance=1e-8, iterations=5000)


def lifted(radius):
    """The paper's bar of 1154 vertices, one end held, the other lifted without being turned:
    (local rotation of each section in the plane of the bend, energy of each section)."""
    positions, triangles = box_bar(6, 45)
    x = positions[:, 0]
    ends = [numpy.flatnonzero(x < 0.05 * x.max()), numpy.flatnonzero(x > 0.95 * x.max())]
    handles = Handles([Kind.ORIENTED] * 2, [end.astype(numpy.uint32) for end in ends])
    with Rigidity(Mesh(positions, triangles), handles, radius, handle_size=0) as deformer:
        targets = deformer.handle_pose(0)
        targets[1, :, 3] += [-1.5, 3.5, 0]
        deformer.solve(targets, TO_THE_END)
        rotations, energies = deformer.rotations(), deformer.energies()
    sections = [x == place for place in numpy.unique(x)]
    means = [rotations[section].mean(axis=0) for section in sections]
    angles = [numpy.arctan2(m[1, 0] - m[0, 1], m[0, 0] + m[1, 1]) for m in means]
    return numpy.unwrap(angles), numpy.array([energies[section].sum() for section in sections])


def spread(values):
    """The share of them that an even distribution of the same unevenness would have: 1 where all
    are equal, 1 / n where there is but one."""
    return values.sum() ** 2 / (len(values) * (values**2).sum())


def test_bending_spreads_and_lessens_as_r_grows():
    found = []
    for radius in (1, 2, 5, 10, 15, 20):
        angles, energies = lifted(radius)
        bends = numpy.abs(numpy.diff(angles))
        found.append((spread(bends), bends.max() / bends.mean(), bends.sum(), spread(energies)))
        print(
            f"  r = {radius:2}: bending over {found[-1][0]:.2f} of the length, sharpest "
            f"{found[-1][1]:.2f} times the mean, {found[-1][2]:.2f} radians in all; energy over "
            f"{found[-1][3]:.2f}"
        )
    over, sharpest, total, _ = numpy.array(found).T
    assert (over[1:] > 1.35 * over[0]).all(), over
    assert (sharpest[1:] < 0.7 * sharpest[0]).all(), sharpest
    assert (numpy.diff(total[1:]) < 0).all() and total[-1] < 0.2 * total[0], total


def test_figure_3_spreads_the_energy():
    """Bent by half a turn, what r = 1 gathers in a fold is even from r = 2 on."""
    from area_rigidity import SIZES, Bar

    bar = Bar(*SIZES["bar1k"])
    spreads = {}
    for radius in (1, 2, 10):
        with bar.bind(radius) as deformer:
            deformer.solve(bar.targets(numpy.pi))
            energies = deformer.energies()
        x = bar.positions[:, 0]
        spreads[radius] = spread(numpy.array([energies[x == p].sum() for p in numpy.unique(x)]))
    print("  energy of figure 3 over", {r: round(float(s), 2) for r, s in spreads.items()})
    assert spreads[1] < 0.6 < 0.85 < spreads[2] < spreads[10]


def test_iterations_fall_as_r_grows():
    from area_rigidity import SIZES, Bar

    bar = Bar(*SIZES["bar1k"])
    for acceleration in (False, True):
        counts = []
        for radius in (1, 2, 4, 6, 10):
            with bar.bind(radius) as deformer:
                settings = RigiditySettings(acceleration=acceleration)
                counts.append(deformer.solve(bar.targets(numpy.pi), settings).iterations)
        print("  iterations", "with acceleration" if acceleration else "plain", counts)
        assert counts == sorted(counts, reverse=True)


if __name__ == "__main__":
    support.run(globals())
