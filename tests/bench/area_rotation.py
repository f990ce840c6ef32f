# SPDX-License-Identifier: GPL-3.0-or-later
"""Closest rotations of many 3 x 3 matrices."""

import tempfile
from pathlib import Path

import numpy

from measure import Worker, interleave, timed
from peers import program

COUNT = 20000


def run(bench):
    for row, make in (
        ("rotation/batch/fit3", stretched_rotations),
        ("rotation/batch/fit3_random", random_matrices),
    ):
        bench.run([row, f"{row}_eigen"], lambda bench, r=row, m=make: _measure(bench, r, m()))


def random_matrices():
    """Half of them inverted: the worst that may come."""
    return numpy.random.default_rng(1).normal(size=(COUNT, 3, 3))


def stretched_rotations():
    """What local steps have: a turn, a stretch, a little noise."""
    generator = numpy.random.default_rng(2)
    stretches = numpy.eye(3) * generator.uniform(0.3, 3, (COUNT, 1, 3))
    return closest(random_matrices()) @ stretches + generator.normal(0, 0.05, (COUNT, 3, 3))


def _measure(bench, row, matrices):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "rotation.bin"
        with open(file, "wb") as out:
            out.write(numpy.int64(COUNT).tobytes() + matrices.tobytes())
        with Worker(bench.build / "library" / "tests" / "bench_rotation", file) as worker:
            _against_numpy(bench, row, worker, matrices)
            _against_eigen(bench, row, worker, file)


def _against_numpy(bench, row, worker, matrices):
    same = _traces_agree(worker.ask("trace")[0], (matrices * closest(matrices)).sum())
    numpy_seconds = timed(closest, matrices)
    ours, peer = interleave(
        bench.repeats(21, 7), worker.seconds("go"), lambda: numpy_seconds() / COUNT
    )
    bench.add(row, ours * 1e9, peer * 1e9, "ns", "numpy.linalg.svd, batched", same)


def _against_eigen(bench, row, worker, file):
    path = program(bench, "eigen_rotation")
    if path is None or not bench.wants(f"{row}_eigen"):
        return
    with Worker(path, file) as other:
        same = _traces_agree(worker.ask("trace")[0], other.ask("trace")[0])
        ours, peer = interleave(bench.repeats(21, 7), worker.seconds("go"), other.seconds("go"))
    bench.add(f"{row}_eigen", ours * 1e9, peer * 1e9, "ns", "Eigen JacobiSVD", same)


def _traces_agree(ours, theirs):
    """The closest rotations have the largest sum of products with their matrices."""
    difference = abs(ours - theirs) / abs(theirs)
    if difference > 1e-12:
        raise RuntimeError(f"the rotations differ: {ours} and {theirs}")
    return f"a matrix, {COUNT} at a time; sums of <M, R> agree to {max(difference, 1e-16):.0g}"


def closest(matrices):
    left, _, right = numpy.linalg.svd(matrices)
    left[:, :, 2] *= numpy.sign(numpy.linalg.det(left @ right))[:, None]
    return left @ right
