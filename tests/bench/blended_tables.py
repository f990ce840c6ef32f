# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blended paper's experiments on the real meshes (EXEMPLAR_DATA), as tables.

    EXEMPLAR_LIBRARY=... EXEMPLAR_DATA=... python3 tests/bench/blended_tables.py [WHICH] [MESH ...]

WHICH is one or more of
dictionary  table 2: how well the span of a dictionary holds poses that it was not made from
scale       figure 4: ten points of a left-out pose, of another size, noisy, some missing
parts       figure 8: what is lost without several exemplars, one reference, no scale

Distances are shares of the root of the reference's area. Not a test: nothing here passes or fails.
"""

import os
import sys
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy  # noqa: E402

import inputs  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "blender_addon"))
import native  # noqa: E402

MESHES = ("horse", "cat", "lion")
POINTS = 10
SEED = 1


def poses_of(name):
    with numpy.load(inputs.DATA / f"{name}.npz") as arrays:
        return arrays["poses"].astype(numpy.float32), arrays["faces"].astype(numpy.uint32)


def root_area(positions, faces):
    a, b, c = positions[faces.T].astype(float)
    return numpy.sqrt(numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1).sum() / 2)


# --------------------------------------------------------------------------------- dictionaries


def span_of(functions, exemplars):
    """Atoms w_j and w_j v for all exemplars, [V][atoms]."""
    centred = [pose.astype(float) - pose.mean(axis=0) for pose in exemplars]
    coordinates = numpy.concatenate([numpy.ones((functions.shape[1], 1)), *centred], axis=1)
    return (functions.T[:, :, None] * coordinates[:, None, :]).reshape(functions.shape[1], -1)


def distortion(atoms, pose):
    """Largest distance of a pose from the span of atoms, in least squares."""
    scaled = atoms / numpy.linalg.norm(atoms, axis=0)
    values, vectors = numpy.linalg.eigh(scaled.T @ scaled)
    kept = values > 1e-12 * values[-1]
    basis = scaled @ (vectors[:, kept] / numpy.sqrt(values[kept]))
    pose = pose.astype(float)
    return numpy.linalg.norm(basis @ (basis.T @ pose) - pose, axis=1).max()


def dictionary(name):
    poses, faces = poses_of(name)
    mesh, size = native.Mesh(poses[0], faces), root_area(poses[0], faces)
    counts = {q: 15 * (1 + 3 * q) for q in (1, 2, 4, 8)}
    values, functions = native.eigenfunctions(mesh, max(counts.values()) // 4)
    print(f"\n{name}: largest distance from the span, mean over left-out poses, %")
    print("(bones from all other poses, for they are too few to tell bones apart at small q)")
    print(f"{'q':>3} {'atoms':>6} {'eigenfunctions':>15} {'skeleton':>9} {'one example':>12}")
    found = {q: [] for q in counts}
    for left in range(1, len(poses)):
        others = numpy.delete(poses, left, axis=0)
        bones = native.decompose(mesh, others, bone_count=15).weights.astype(float)
        for q, atoms in counts.items():
            spans = (
                span_of(functions[:15], others[:q]),
                span_of(bones, others[:q]),
                span_of(functions[: atoms // 4], others[:1]),
            )
            found[q].append([distortion(span, poses[left]) for span in spans])
    for q, atoms in counts.items():
        lbo, skeleton, one = 100 * numpy.mean(found[q], axis=0) / size
        print(f"{q:>3} {atoms:>6} {lbo:>15.2f} {skeleton:>9.2f} {one:>12.2f}", flush=True)


# ---------------------------------------------------------------------------------- few points


def points_of(poses, faces):
    """Farthest points; as handles, each one vertex."""
    chosen = inputs.farthest_points(poses[0].astype(float), faces, POINTS)
    kinds = [native.Kind.PINNED] * len(chosen)
    return chosen, native.Handles(kinds, [numpy.array([v]) for v in chosen])


def targets_of(points):
    targets = numpy.zeros((len(points), 3, 4))
    targets[:, :, :3] = numpy.eye(3)
    targets[:, :, 3] = points
    return targets


class LeaveOneOut:
    """One deformer a left-out pose, and solves from its points."""

    def __init__(self, name, **binding):
        self.poses, self.faces = poses_of(name)
        self.size = root_area(self.poses[0], self.faces)
        mesh = native.Mesh(self.poses[0], self.faces)
        self.chosen, handles = points_of(self.poses, self.faces)
        self.deformers = {}
        for left in range(1, len(self.poses)):
            others = numpy.delete(self.poses, left, axis=0)
            settings = native.BlendedBinding(**binding)
            self.deformers[left] = native.Blended(mesh, others, handles, settings)

    def run(self, factor, noise=0.0, missing=0, **settings):
        """Rows of scale found over the true one, less 1, and mean and largest distance."""
        generator = numpy.random.default_rng(SEED)
        found = []
        for left, deformer in self.deformers.items():
            pose = self.poses[left].astype(float)
            points = factor * pose[self.chosen]
            points += generator.normal(size=points.shape) * noise * self.size * factor
            weights = numpy.ones(len(points))
            weights[generator.choice(len(points), missing, replace=False)] = 0
            deformer.weigh_handles(weights)
            deformer.solve(targets_of(points), native.BlendedSettings(**settings))
            away = numpy.linalg.norm(deformer.positions_f64() / factor - pose, axis=1) / self.size
            found.append((deformer.outcome().scale / factor - 1, away.mean(), away.max()))
        return numpy.array(found)


def line(label, found):
    off = numpy.abs(found[:, 0])
    print(
        f"{label:<34} {100 * numpy.median(off):>7.1f} {100 * off.max():>7.1f} "
        f"{100 * found[:, 1].mean():>7.2f} {100 * numpy.median(found[:, 2]):>7.1f}",
        flush=True,
    )


HEADER = f"{'':<34} {'scale':>7} {'worst':>7} {'mean':>7} {'max':>7}"


def scale(name):
    print(f"\n{name}: % off in scale (median, worst), distance from the left-out pose (mean, max)")
    print(HEADER)
    experiment = LeaveOneOut(name)
    for factor in (1.5, 0.7):
        line(f"scaled by {factor}", experiment.run(factor))
        line("  with 1 % noise", experiment.run(factor, noise=0.01))
        line("  with two of ten points missing", experiment.run(factor, missing=2))
    plain = dict(begin=native.Begin.PLAIN, scale=native.declarations.Scale.LEAST_SQUARES)
    line("plain start, eq. 16 as it is", experiment.run(1.5, **plain))


def parts(name):
    print(f"\n{name}: ten points of a left-out pose scaled by 1.5")
    print(HEADER)
    whole = LeaveOneOut(name)
    line("everything", whole.run(1.5))
    line("skeleton dictionary", LeaveOneOut(name, dictionary=native.Dictionary.SKELETON).run(1.5))
    line("A: a dictionary of one example", LeaveOneOut(name, dictionary_exemplar_count=1).run(1.5))
    line("B: compared to one reference", LeaveOneOut(name, compared_exemplar_count=1).run(1.5))
    line("C: scale held at 1", whole.run(1.5, scale=native.declarations.Scale.HELD))
    line("plain start instead of sparse", whole.run(1.5, begin=native.Begin.PLAIN))
    line("without the average stage", whole.run(1.5, average_iterations=0))


def main():
    experiments = {"dictionary": dictionary, "scale": scale, "parts": parts}
    words = sys.argv[1:]
    chosen = [word for word in words if word in experiments] or list(experiments)
    meshes = [word for word in words if word not in experiments] or MESHES
    for experiment in chosen:
        for name in meshes:
            experiments[experiment](name)


if __name__ == "__main__":
    main()
