# SPDX-License-Identifier: GPL-3.0-or-later
"""The cone program over simplices, against a general conic solver on the same programs."""

import tempfile
from pathlib import Path

import numpy

from inputs import Missing
from measure import Worker, interleave, timed

try:
    import cvxopt
    import cvxopt.solvers
except ImportError:
    cvxopt = None

BLOCKS, SIZE = 20, 6
ROW = f"cone/{BLOCKS}x{SIZE}/solve"


def run(bench):
    bench.run([ROW], _measure)


def _measure(bench):
    if cvxopt is None:
        raise Missing("python3-cvxopt is not installed")
    programs = [random_program(seed) for seed in range(bench.repeats(20, 5))]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cone.bin"
        write_programs(file, programs)
        with Worker(bench.build / "library" / "tests" / "bench_cone", file) as worker:
            ours = worker.ask("values")
            theirs = [conelp(program)["primal objective"] for program in programs]
            worst = max(abs(a - b) / abs(b) for a, b in zip(ours, theirs))
            if worst > 1e-6:
                raise RuntimeError(f"the optima differ by {worst:.2g}")
            solve_all = timed(lambda: [conelp(program) for program in programs])
            ours, peer = interleave(
                bench.repeats(15, 7),
                worker.seconds("go"),
                lambda: solve_all() / len(programs),
            )
    notes = f"from a cold start; the optima agree to {worst:.1g}"
    bench.add(ROW, ours * 1e3, peer * 1e3, "ms", "cvxopt conelp", notes)


def random_program(seed):
    """min over simplices of sqrt(1/2 |A B - b|^2 + c^2) + l'B, with columns that are nearly
    parallel within a block, as exemplars that agree in a region are."""
    generator = numpy.random.default_rng(seed)
    count, rows = BLOCKS * SIZE, 3 * BLOCKS
    common = numpy.repeat(generator.normal(size=(rows, BLOCKS)), SIZE, axis=1)
    A = common + generator.uniform(0.1, 1, count) * generator.normal(size=(rows, count))
    blend = generator.dirichlet(numpy.full(SIZE, 0.4), BLOCKS).ravel()
    b = A @ blend + 0.3 * generator.normal(size=rows)
    return A, b, generator.uniform(0.1, 1), generator.uniform(0, 0.5, count)


def write_programs(path, programs):
    with open(path, "wb") as file:
        file.write(numpy.array([len(programs), BLOCKS * SIZE, BLOCKS], numpy.int64).tobytes())
        for A, b, c, costs in programs:
            for part in (A.T @ A, A.T @ b, costs, numpy.array([b @ b / 2 + c * c])):
                file.write(numpy.ascontiguousarray(part).tobytes())


def conelp(program):
    """The same as a second-order cone program in (B, t)."""
    A, b, c, costs = program
    rows, count = A.shape
    objective = numpy.append(costs, 1.0)
    nonnegative = numpy.hstack([-numpy.eye(count), numpy.zeros((count, 1))])
    cone = numpy.zeros((rows + 2, count + 1))
    cone[0, -1] = -1
    cone[1 : rows + 1, :count] = -A / numpy.sqrt(2)
    right = numpy.concatenate([numpy.zeros(count + 1), -b / numpy.sqrt(2), [c]])
    sums = numpy.kron(numpy.eye(BLOCKS), numpy.ones(SIZE))
    sums = numpy.hstack([sums, numpy.zeros((BLOCKS, 1))])
    return cvxopt.solvers.conelp(
        cvxopt.matrix(objective),
        cvxopt.matrix(numpy.vstack([nonnegative, cone])),
        cvxopt.matrix(right),
        {"l": count, "q": [rows + 2], "s": []},
        cvxopt.matrix(sums),
        cvxopt.matrix(numpy.ones(BLOCKS)),
        options={"show_progress": False, "abstol": 1e-9, "reltol": 1e-9, "feastol": 1e-9},
    )
