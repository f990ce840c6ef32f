# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences: the paper's table 1 on its own data, beside NumPy, scikit-learn and SciPy.

The peers do one part of a fit each. Ours cannot be called part by part, so it is measured with more
than the part: the whole fit against a singular value decomposition, and layout, pose and time
signals together against each of the other two.
"""

import numpy

import inputs
from characters import native
from inputs import Missing
from measure import interleave, timed

try:
    from sklearn.manifold import MDS
except ImportError:
    MDS = None
try:
    from scipy.interpolate import RBFInterpolator
except ImportError:
    RBFInterpolator = None

# name: file, frames, k, l, m, target of error, target of milliseconds
TABLE_1 = {
    "gallop": ("horse_gallop", slice(1, 25), 16, 12, 7, 0.0083, 2),
    "cow": ("cow_sequence", slice(1, 205), 155, 144, 42, 0.0102, 80),
}
LARGE = "sequence/2000x10k"


def run(bench):
    for name in TABLE_1:
        rows = [f"sequence/{name}/{part}" for part in PARTS]
        bench.run(rows, lambda bench, n=name: _table_1(bench, n))
    bench.run([f"{LARGE}/fit"], _large)
    rows = ["sequence/10k/evaluate", "sequence/10k/evaluate_gradients"]
    bench.run(rows, _evaluate)


PARTS = ("fit", "error", "svd", "mds", "rbf")


def sequence_of(rest, faces, frames, space=0):
    sequence = native.Sequence(native.Mesh(rest, faces), space)
    for frame in frames:
        sequence.add_frame(frame)
    return sequence


def _table_1(bench, name):
    file, which, k, l, m, error, milliseconds = TABLE_1[name]
    path = inputs.DATA / f"{file}.npz"
    if not path.exists():
        raise Missing(f"{file}.npz is not in the folder of real meshes (EXEMPLAR_DATA)")
    data = numpy.load(path)
    frames = data["poses"][which]
    sequence = sequence_of(data["poses"][0], data["faces"], frames)
    row, n = f"sequence/{name}", len(frames)
    report = sequence.fit(k, l, m)
    notes = f"{n} frames, k {k}, l {l}, m {m}; largest error {sequence.measure()[1].max():.3g}"
    bench.add(
        f"{row}/error", report.error, error, "", "NumPy, the whole fit (printed)", notes, True
    )
    flat = frames.reshape(n, -1).astype(float)
    centred = flat - flat.mean(axis=0)
    repeats = bench.repeats(15, 5)

    def fit():
        sequence.fit(k, l, m)

    ours, svd = interleave(
        repeats, timed(fit), timed(numpy.linalg.svd, centred, full_matrices=False)
    )
    target = f"target: {milliseconds} ms"
    bench.add(f"{row}/fit", ours * 1e3, milliseconds, "ms", target, notes, True)
    bench.add(f"{row}/svd", ours * 1e3, svd * 1e3, "ms", "numpy.linalg.svd", "ours: whole fit")
    _layout(bench, row, sequence, centred, (k, l, m))
    _plate(bench, row, sequence, centred, (k, l, m))


def _layout(bench, row, sequence, centred, counts):
    if MDS is None:
        return
    left, values, _ = numpy.linalg.svd(centred, full_matrices=False)
    components = left[:, : counts[2]] * values[: counts[2]]
    scaling = MDS(2, n_init=1, random_state=1, n_jobs=1, normalized_stress="auto")

    def place():
        sequence.fit(*counts)

    ours, peer = interleave(
        bench.repeats(5, 2), timed(place), timed(scaling.fit_transform, components)
    )
    bench.add(f"{row}/mds", ours * 1e3, peer * 1e3, "ms", "scikit-learn MDS", "ours: whole fit")


def _plate(bench, row, sequence, centred, counts):
    if RBFInterpolator is None:
        return
    left, values, _ = numpy.linalg.svd(centred, full_matrices=False)
    components = left[:, : counts[2]] * values[: counts[2]]
    sequence.fit(*counts)
    positions, _ = sequence.marks()

    def place():
        sequence.place({}, 1)

    ours, peer = interleave(
        bench.repeats(15, 5), timed(place), timed(RBFInterpolator, positions, components)
    )
    notes = "one interpolation of all sites; ours: greedy sites, the curve, one step of the layout"
    bench.add(f"{row}/rbf", ours * 1e3, peer * 1e3, "ms", "SciPy RBFInterpolator", notes)


def wave(frames, columns=100, rows=100):
    """A waving grid of columns x rows vertices, frame by frame."""
    y, x = numpy.mgrid[0:rows, 0:columns].astype(numpy.float32) / numpy.float32(columns)
    index = numpy.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = numpy.concatenate(
        [numpy.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    )

    def positions():
        for i in range(frames):
            t = i / 40
            z = 0.1 * numpy.sin(7 * x + t) * numpy.cos(5 * y - 1.7 * t)
            z += 0.03 * numpy.sin(23 * x * y + 3.1 * t) + 0.02 * numpy.cos(31 * y + 5.3 * t)
            yield numpy.stack([x + 0.05 * numpy.sin(t + 3 * y), y, z], -1).reshape(-1, 3)

    flat = numpy.stack([x, y, 0 * x], -1).reshape(-1, 3)
    return flat, faces, positions()


def _large(bench):
    if bench.quick:
        raise Missing("it takes a while: not with --quick")
    flat, faces, frames = wave(2000)
    sequence = sequence_of(flat, faces, frames)
    seconds = timed(sequence.fit, tolerance=1e-3)()
    info = sequence.info
    notes = f"2000 frames of {info.vertex_count} vertices, tolerance 1e-3, m {info.component_count}"
    bench.add(f"{LARGE}/fit", seconds, 10, "s", "target: 10 s", notes, True)


def _evaluate(bench):
    for name, space, target in (("evaluate", 0, 1), ("evaluate_gradients", 1, 10)):
        flat, faces, frames = wave(100)
        sequence = sequence_of(flat, faces, frames, space)
        sequence.fit(60, 60, 42)
        out = numpy.empty((len(flat), 3), numpy.float32)
        (ours,) = interleave(bench.repeats(31, 9), timed(sequence.evaluate, 33.3, out))
        notes = "10000 vertices, 42 components, 60 sites"
        bench.add(
            f"sequence/10k/{name}", ours * 1e3, target, "ms", f"target: {target} ms", notes, True
        )
