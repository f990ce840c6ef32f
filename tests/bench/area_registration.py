# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of scans, and the index of nearest points that they live on."""

import inputs
import numpy
import registration_protocol as protocol
from measure import interleave, timed
from registration_protocol import native
from scipy.spatial import cKDTree

FIT, SEARCH = "registration/tosca_cat/fit", "registration/8points/match"
QUERY = "nearest/30k/query"
FIT_TARGET, SEARCH_TARGET = 2.0, 1.0  # seconds


def run(bench):
    bench.run([FIT, SEARCH], _measure_fit)
    bench.run([QUERY], _measure_nearest)


def _measure_fit(bench):
    poses, faces = protocol.load("tosca_cat")
    case = protocol.make(poses, faces, 0, share=1.0)
    rng = numpy.random.default_rng(0)
    # Other connectivity and 30 thousand points: places on the surface, as a scanner has them.
    weights = numpy.linalg.norm(protocol.face_normals(case.target, faces), axis=1)
    chosen = rng.choice(len(faces), 30000, p=weights / weights.sum())
    corners = rng.dirichlet((1, 1, 1), 30000)
    points = (case.target[faces[chosen]] * corners[:, :, None]).sum(1)
    normals = protocol.face_normals(case.target, faces)[chosen]
    mesh = native.Mesh(case.exemplars[0], faces)
    with native.Registration(mesh, case.exemplars) as registration:
        settings = native.ScanFitSettings(thread_count=1)

        def fit():
            scan = native.Scan(points, normals=normals)
            return registration.fit(scan, case.landmarks, case.landmark_points, settings)

        report = fit()
        (seconds,) = interleave(bench.repeats(7, 3), timed(fit))
        bench.add(
            FIT,
            seconds,
            FIT_TARGET,
            "s",
            "the target of 2 s on two cores",
            f"{len(points)} points, 8 exemplars, 8 landmarks, scan and finish included; "
            f"quality {report.quality:.2f}",
            is_printed=True,
        )
        groups, order = [0] * 8, rng.permutation(8)
        found = registration.match(case.landmarks, case.landmark_points[order], groups)
        (seconds,) = interleave(
            bench.repeats(5, 3),
            timed(registration.match, case.landmarks, case.landmark_points[order], groups),
        )
        right = (order[found.order] == numpy.arange(8)).sum()
        bench.add(
            SEARCH,
            seconds,
            SEARCH_TARGET,
            "s",
            "the target of 1 s",
            f"{found.permissible} assignments, {found.solved} solved; {right} of 8 right",
            is_printed=True,
        )


def _measure_nearest(bench):
    rng = numpy.random.default_rng(1)
    character = inputs.bumpy_bar(30000, 1, 4)
    points = character.positions.astype(float)
    queries = points[rng.integers(len(points), size=10000)]
    queries = queries + 0.01 * character.diagonal * rng.normal(size=queries.shape)
    scan = native.Scan(points)
    tree = cKDTree(points)
    ours, theirs = scan.nearest(queries)[1], tree.query(queries)[0]
    assert abs(ours - theirs).max() < 1e-6 * character.diagonal
    mine, peer = interleave(
        bench.repeats(20, 5), timed(scan.nearest, queries), timed(tree.query, queries), burst=2
    )
    bench.add(QUERY, mine * 1e3, peer * 1e3, "ms", "SciPy cKDTree", "10 thousand queries")
