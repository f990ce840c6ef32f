# SPDX-License-Identifier: GPL-3.0-or-later
"""[Rigidity, figure 14]: an unseen pose from where its handles are: by one radius for all, by
learned radii, and by AMRAP with the other poses as exemplars."""

import sys

import numpy

import support
from rigidity_support import (
    Handles,
    Kind,
    Mesh,
    Rigidity,
    RigiditySettings,
    learn_radii,
)

sys.path.insert(0, str(support.ROOT / "tests" / "bench"))

from inputs import regions  # noqa: E402
from native import Amrap  # noqa: E402

HANDLES, HELD_OUT = 20, (1, 4, 7, 10)
LEARNED = 0.1  # omega


def targets_of(pose, sets):
    targets = numpy.zeros((len(sets), 3, 4))
    targets[:, :, :3] = numpy.eye(3)
    targets[:, :, 3] = [pose[vertices].astype(float).mean(axis=0) for vertices in sets]
    return targets


def distances():
    """{what: [held-out poses] root mean square distance, as a share of the diagonal}"""
    with numpy.load(support.data("horse.npz")) as arrays:
        poses, triangles = arrays["poses"], arrays["faces"].astype(numpy.uint32)
    reference = poses[0]
    diagonal = numpy.linalg.norm(numpy.ptp(reference, axis=0))
    mesh = Mesh(reference, triangles)
    sets = regions(reference, triangles, HANDLES, rings=1)
    handles = Handles([Kind.PINNED] * HANDLES, sets)
    found = {}
    for pose in HELD_OUT:
        others = numpy.delete(poses[1:], pose - 1, axis=0)
        radii = {"r = 1": 1, "r = 3": 3, "learned": learn_radii(mesh, others, omega=LEARNED)}
        targets = targets_of(poses[pose], sets)
        results = {}
        with Rigidity(mesh, handles) as deformer:
            for name, values in radii.items():
                deformer.set_radii(values)
                deformer.solve(targets, RigiditySettings(tolerance=1e-4))
                results[name] = deformer.positions()
        exemplars = numpy.concatenate([reference[None], others])
        with Amrap(mesh, exemplars, handles) as deformer:
            deformer.solve(targets)
            results["AMRAP"] = deformer.positions()
        for name, positions in results.items():
            miss = ((positions - poses[pose]) ** 2).sum(axis=1).mean() ** 0.5 / diagonal
            found.setdefault(name, []).append(miss)
    return {name: numpy.array(values) for name, values in found.items()}


def test_learned_radii_come_closer_to_an_unseen_pose():
    found = distances()
    for name, values in found.items():
        shares = ", ".join(f"{100 * value:.2f}" for value in values)
        print(f"  {name:>8}: {100 * values.mean():.2f} % of the diagonal ({shares})")
    assert found["learned"].mean() < found["r = 1"].mean()
    assert (found["learned"] < 0.1).all()


if __name__ == "__main__":
    support.run(globals())
