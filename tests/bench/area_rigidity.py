# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigidity: the bar of the paper's table 1, the way to CGAL's energy, mixed radii, learning."""

import tempfile
from pathlib import Path

import numpy

import inputs
import peers
from characters import native
from inputs import Missing, box_bar
from measure import Worker, clock, interleave, timed

# [Rigidity, table 1]: seconds by r, and iterations
TABLE_1 = {1: (12.03, 477), 2: (6.06, 201), 4: (7.43, 124), 6: (7.34, 63), 10: (7.70, 33)}
# cells across and along; the first has the paper's 1154 vertices
SIZES = {"bar1k": (6, 45), "bar12k": (20, 146), "bar50k": (40, 292)}
SWEEP = {"2k": (8, 60), "12k": (20, 146), "50k": (40, 292), "200k": (80, 586)}
CGAL_TOLERANCE, CGAL_ITERATIONS = 1e-4, 300  # whichever is met first
LEARNING = 0.68e-3  # seconds for a vertex and a model, as printed


def run(bench):
    for r in TABLE_1:
        bench.run([f"rigidity/bar1k_r{r}/bend"], lambda bench, r=r: _table_1(bench, r))
    for name in SIZES:
        rows = [f"rigidity/{name}/to_energy", f"rigidity/{name}/iteration"]
        bench.run(rows, lambda bench, name=name: _to_energy(bench, name))
    rows = [f"rigidity/bar12k_mixed/{row}" for row in ("cold", "cold_paper", "frame")]
    bench.run(rows, _mixed)
    bench.run(["rigidity/cow/learn"], _learn)
    sweep = [f"rigidity/sweep/{size}_{row}" for size in SWEEP for row in ("bind", "cold", "frame")]
    bench.run(sweep, _sweep)


# --------------------------------------------------------------------------------- a bent bar


class Bar:
    """A bar whose ends are held; targets bend it to an arc."""

    def __init__(self, across, along):
        self.positions, self.triangles = box_bar(across, along)
        x = self.positions[:, 0]
        self.length = float(x.max())
        self.ends = [
            numpy.flatnonzero(x < 0.05 * self.length).astype(numpy.uint32),
            numpy.flatnonzero(x > 0.95 * self.length).astype(numpy.uint32),
        ]
        self.mesh = native.Mesh(self.positions, self.triangles)
        self.handles = native.Handles([native.Kind.ORIENTED] * 2, self.ends)

    def bind(self, radii):
        return native.Rigidity(self.mesh, self.handles, radii, handle_size=0)

    def targets(self, angle):
        """[2][3][4]: the first end stays, the second is where an arc of that angle has it."""
        centres = [self.positions[end].astype(float).mean(axis=0) for end in self.ends]
        targets = numpy.zeros((2, 3, 4))
        for target, centre in zip(targets, centres):
            target[:, :3], target[:, 3] = numpy.eye(3), centre
        angle = angle if abs(angle) > 1e-9 else 1e-9
        radius = self.length / angle
        first, last = (centre[0] / radius for centre in centres)
        arc = [[radius * numpy.sin(a), radius * (1 - numpy.cos(a)), 0] for a in (first, last)]
        back = _turned(-first)
        targets[1, :, :3] = _turned(last - first)
        targets[1, :, 3] = centres[0] + back @ numpy.subtract(arc[1], arc[0])
        return targets

    def places(self, targets):
        """The held vertices, and where."""
        vertices, places = numpy.concatenate(self.ends), []
        for end, target in zip(self.ends, targets):
            arms = self.positions[end].astype(float)
            places.append((arms - arms.mean(axis=0)) @ target[:, :3].T + target[:, 3])
        return vertices, numpy.concatenate(places)


def _turned(angle):
    cosine, sine = numpy.cos(angle), numpy.sin(angle)
    return numpy.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def _table_1(bench, r):
    bar = Bar(*SIZES["bar1k"])
    targets = bar.targets(numpy.pi)
    reports = {}

    def cold():
        with bar.bind(r) as deformer:
            reports["fast"] = deformer.solve(targets)

    with bar.bind(r) as deformer:
        plain = deformer.solve(targets, native.RigiditySettings(acceleration=False))
    (ours,) = interleave(bench.repeats(30, 5), timed(cold))
    seconds, iterations = TABLE_1[r]
    fast = reports["fast"]
    notes = (
        f"bind and solve; {fast.iterations} iterations, energy {fast.elastic_energy:.4g}; plain "
        f"steps {plain.iterations}, {plain.elastic_energy:.4g}; the paper's bar {iterations}"
    )
    printed = f"Rigidity table 1: {seconds} s (printed)"
    row = f"rigidity/bar1k_r{r}/bend"
    bench.add(row, ours, seconds, "s", printed, notes, is_printed=True)


# ------------------------------------------------------------------------------ against CGAL


def _to_energy(bench, name):
    path = peers.program(bench, "cgal_arap")
    if path is None:
        raise Missing("CGAL is not there")
    bar = Bar(*SIZES[name])
    targets = bar.targets(numpy.pi)
    energy_of = Energy(bar.positions, bar.triangles)
    with tempfile.TemporaryDirectory() as folder, bar.bind(1) as deformer:
        with Worker(path, _cgal_input(bar, targets, Path(folder) / "in.bin")) as cgal:
            solved = Path(folder) / "out.bin"
            command = f"solve {CGAL_ITERATIONS} {CGAL_TOLERANCE} {solved}"
            repeats = bench.repeats(3, 1)
            (peer,) = interleave(repeats, cgal.seconds(command))
            reached = energy_of(numpy.fromfile(solved).reshape(-1, 3))
            settings, energy = _enough(deformer, targets, reached)
            _check_energy(deformer, energy_of, energy)
            (ours,) = interleave(3 * repeats, timed(deformer.solve, targets, settings))
            notes = (
                f"{settings.iterations} iterations to {energy:.4g}; CGAL to {reached:.4g}, "
                f"{CGAL_TOLERANCE:g} an iteration or {CGAL_ITERATIONS} iterations"
            )
            bench.add(f"rigidity/{name}/to_energy", ours * 1e3, peer * 1e3, "ms", "CGAL", notes)
            _iteration(bench, name, deformer, targets, cgal)


def _iteration(bench, name, deformer, targets, cgal):
    one = native.RigiditySettings(
        start=native.Start.WARM, tolerance=0, iterations=20, thread_count=1
    )
    ours, peer = interleave(
        bench.repeats(9, 3), timed(deformer.solve, targets, one), cgal.seconds("iterate")
    )
    notes = "ours with acceleration, a twentieth of 20"
    row = f"rigidity/{name}/iteration"
    bench.add(row, ours / 20 * 1e3, peer * 1e3, "ms", "CGAL, one iteration", notes)


def _enough(deformer, targets, energy):
    """Settings of the fewest iterations that come down to an energy, and the energy then."""
    settings = native.RigiditySettings(tolerance=1e-9, iterations=2000, thread_count=1)
    history = deformer.solve(targets, settings, history_capacity=2000).history
    below = numpy.flatnonzero(history <= energy)
    if len(below) == 0:
        raise RuntimeError(f"the energy of {energy} is never reached, {history[-1]} is")
    count = int(below[0]) + 1
    settings = native.RigiditySettings(tolerance=0, iterations=count, thread_count=1)
    return settings, deformer.solve(targets, settings).elastic_energy


def _check_energy(deformer, energy_of, energy):
    by_hand = energy_of(deformer.positions_f64())
    if abs(by_hand - energy) > 1e-6 * energy:
        raise RuntimeError(f"the energy is said to be {energy}, and is {by_hand}")


def _cgal_input(bar, targets, path):
    vertices, places = bar.places(targets)
    peers.write_arrays(
        path,
        bar.positions.astype(float),
        bar.triangles.astype(numpy.uint32),
        numpy.arange(len(vertices), dtype=numpy.uint32),
        vertices.astype(numpy.uint32),
        places - bar.positions[vertices],
    )
    return path


class Energy:
    """Eq. 1 for r = 1 with best rotations, of positions [V][3]."""

    def __init__(self, positions, triangles):
        self.positions = positions.astype(float)
        edges, weights = [], []
        for corner in range(3):
            a, b, c = (triangles[:, (corner + k) % 3].astype(int) for k in range(3))
            u, v = self.positions[b] - self.positions[a], self.positions[c] - self.positions[a]
            cotangents = (u * v).sum(axis=1) / numpy.linalg.norm(numpy.cross(u, v), axis=1)
            edges += [numpy.stack([b, c]), numpy.stack([c, b])]
            weights += [numpy.maximum(0, cotangents) / 2] * 2
        self.i, self.j = numpy.concatenate(edges, axis=1)
        self.weights = numpy.concatenate(weights)

    def __call__(self, deformed):
        before = self.positions[self.i] - self.positions[self.j]
        after = deformed[self.i] - deformed[self.j]
        moments = numpy.zeros((len(deformed), 3, 3))
        products = self.weights[:, None, None] * after[:, :, None] * before[:, None, :]
        numpy.add.at(moments, self.i, products)
        u, s, vt = numpy.linalg.svd(moments)
        s[:, 2] *= numpy.sign(numpy.linalg.det(u @ vt))
        squares = (before**2).sum(axis=1) + (after**2).sum(axis=1)
        return (self.weights * squares).sum() - 2 * s.sum()


# ------------------------------------------------------------------------------- mixed radii


def mixed_radii(positions):
    """Thirds of 1, 6 and 3 along the bar."""
    third = numpy.floor(3 * positions[:, 0] / (1.001 * positions[:, 0].max())).astype(int)
    return numpy.array([1, 6, 3], numpy.int32)[third]


def _mixed(bench):
    bar = Bar(*SIZES["bar12k"])
    radii = mixed_radii(bar.positions)
    targets = bar.targets(numpy.pi)
    one = native.RigiditySettings(thread_count=1)
    reports = []

    def cold():
        with bar.bind(radii) as deformer:
            reports.append(deformer.solve(targets, one))

    (seconds,) = interleave(bench.repeats(9, 3), timed(cold))
    notes = f"bind, and {reports[0].iterations} iterations of a bend by 180 degrees"
    case = "rigidity/bar12k_mixed"
    bench.add(f"{case}/cold", seconds, 0.5, "s", "target: 0.5 s", notes, is_printed=True)
    printed = "Rigidity, 4: 10.2 s for 12.5 thousand vertices (printed)"
    bench.add(f"{case}/cold_paper", seconds, 10.2, "s", printed, notes, is_printed=True)
    frame, notes = _frame(bench, bar, radii)
    budget = "target: 50 ms, twenty frames a second"
    bench.add(f"{case}/frame", frame * 1e3, 50, "ms", budget, notes, is_printed=True)


def _frame(bench, bar, radii, most=200):
    """Seconds of a frame of a drag from straight to half a turn and back, solve and positions."""
    count = min(most, bench.repeats(200, 40))
    warm = native.RigiditySettings(start=native.Start.WARM, thread_count=1)
    angles = numpy.pi * numpy.sin(numpy.pi * (numpy.arange(count) + 1) / (count + 1))
    iterations, seconds = [], []
    with bar.bind(radii) as deformer:
        out = deformer.positions()
        for angle in angles:
            targets = bar.targets(angle)
            start = clock()
            report = deformer.solve(targets, warm)
            deformer.positions(out)
            seconds.append(clock() - start)
            iterations.append(report.iterations)
    notes = (
        f"{numpy.mean(iterations):.1f} iterations; 95 % of {count} frames within "
        f"{numpy.quantile(seconds, 0.95) * 1e3:.3g} ms"
    )
    return float(numpy.median(seconds)), notes


def _sweep(bench):
    first = {}
    sizes = list(SWEEP)[:2] if bench.quick else list(SWEEP)
    for size in sizes:
        bar = Bar(*SWEEP[size])
        radii = mixed_radii(bar.positions)
        start = clock()
        deformer = bar.bind(radii)
        found = {"bind": clock() - start}
        report = None

        def solve():
            nonlocal report
            targets = bar.targets(numpy.pi)
            report = deformer.solve(targets, native.RigiditySettings(thread_count=1))

        found["cold"] = timed(solve)()
        deformer.close()
        found["frame"], frame_notes = _frame(bench, bar, radii, 40)
        first = first or {"count": len(bar.positions), **found}
        growth = len(bar.positions) / first["count"]
        for row, seconds in found.items():
            notes = f"{len(bar.positions)} vertices"
            if row != "bind":
                notes += (
                    f", {report.iterations} iterations" if row == "cold" else f", {frame_notes}"
                )
            name = f"the row of {first['count']} vertices, grown in proportion"
            peer = first[row] * growth
            bench.add(f"rigidity/sweep/{size}_{row}", seconds * 1e3, peer * 1e3, "ms", name, notes)


# ---------------------------------------------------------------------------------- learning


def _learn(bench):
    path = inputs.DATA / "cow_sequence.npz"
    if not path.exists():
        raise Missing("cow_sequence.npz is not in the folder of real meshes (EXEMPLAR_DATA)")
    with numpy.load(path) as arrays:
        poses, triangles = arrays["poses"], arrays["faces"].astype(numpy.uint32)
    mesh = native.Mesh(poses[0], triangles)
    (ours,) = interleave(bench.repeats(5, 2), timed(native.learn_radii, mesh, poses[1:]))
    peer = LEARNING * poses[1:].shape[0] * poses.shape[1]
    printed = f"Rigidity, 4: 0.68 ms a vertex and model, {peer:.0f} s (printed)"
    notes = f"{len(poses) - 1} frames of {poses.shape[1]} vertices"
    bench.add("rigidity/cow/learn", ours, peer, "s", printed, notes, is_printed=True)
