# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration finds poses back from scans of them: partial, moved, scaled, clouds."""

import numpy
import support
from registration_support import Body, bent, cut, farthest, moved, native

BODY = Body()


def test_a_new_pose_is_found_from_a_part_of_it():
    pose = moved(bent(BODY.rest, 0.7, 0.4))
    keep = (BODY.rest[:, 0] < 3) | (BODY.rest[:, 0] > 5) | (numpy.arange(len(pose)) % 20 < 11)
    points, faces, used = cut(pose, BODY.faces, keep)
    report, distances = BODY.fit(pose, native.Scan(points, faces))
    assert not report.warning, report.warning
    assert numpy.median(distances) < 0.01, numpy.median(distances)
    assert distances.max() < 0.06, distances.max()
    assert abs(report.scale - 1) < 0.02, report.scale
    assert report.quality > 0.95
    matches = BODY.registration.scan_matches()
    seen = matches.vertices != native.UNSEEN
    assert seen.mean() > 0.9
    corners = pose.astype(float)[BODY.faces[matches.triangles[seen]]]
    place = (corners * matches.barycentric[seen][:, :, None]).sum(1)
    off = numpy.linalg.norm(place - points[seen], axis=1) / BODY.size
    assert numpy.median(off) < 0.015, numpy.median(off)


def test_the_scale_is_found():
    for scale in (0.5, 2.0):
        pose = moved(bent(BODY.rest, -0.6), scale=scale)
        report, distances = BODY.fit(pose, native.Scan(pose, BODY.faces))
        assert abs(report.scale / scale - 1) < 0.02, report.scale
        assert numpy.median(distances) < 0.01


def test_a_known_scale_is_kept():
    pose = moved(bent(BODY.rest, 0.5), scale=3.0)
    report, distances = BODY.fit(pose, native.Scan(pose, BODY.faces), scale=False, known_scale=3.0)
    assert abs(report.scale - 3) < 1e-9
    assert numpy.median(distances) < 0.01


def test_a_cloud_without_normals_is_fitted():
    pose = moved(bent(BODY.rest, 0.7))
    report, distances = BODY.fit(pose, native.Scan(pose))
    assert report.quality > 0.9
    assert numpy.median(distances) < 0.015, numpy.median(distances)


def test_what_is_not_seen_is_said():
    pose = bent(BODY.rest, 0.5)
    points, faces, used = cut(pose, BODY.faces, BODY.rest[:, 0] < 5)
    kept = [i for i, v in enumerate(BODY.landmarks) if BODY.rest[v, 0] < 4.9]
    vertices = [BODY.landmarks[i] for i in kept]
    BODY.registration.fit(native.Scan(points, faces), vertices, pose[vertices].astype(float))
    indices, distances = BODY.registration.vertex_matches()
    unseen = indices == native.UNSEEN
    assert unseen[BODY.rest[:, 0] > 5.3].mean() > 0.97
    assert unseen[BODY.rest[:, 0] < 4.5].mean() < 0.1
    assert numpy.isnan(distances[unseen]).all() and numpy.isfinite(distances[~unseen]).all()


def test_correspondences_of_an_ambiguous_set():
    pose = moved(bent(BODY.rest, 0.8))
    points = pose[BODY.landmarks].astype(float)
    shuffled = numpy.array([0, 4, 2, 1, 3, 5])
    groups = [-1, 0, 0, 0, 0, -1]
    found = BODY.registration.match(BODY.landmarks, points[shuffled], groups)
    assert (shuffled[found.order] == numpy.arange(6)).all(), found
    assert found.permissible == 24 and found.energy < found.second


def test_scans_of_something_else_are_doubtful():
    """However well a rich dictionary explains them: what tells is how far the mesh had to bend."""
    lion, cat = numpy.load(support.data("lion.npz")), numpy.load(support.data("cat.npz"))
    poses, faces = lion["poses"].astype(numpy.float32), lion["faces"]
    known = farthest(poses[0], 8)
    rng = numpy.random.default_rng(3)
    other = cat["poses"][3].astype(numpy.float32)
    scans = {
        "left out": (poses[8], faces, poses[8][known], True),
        "shuffled": (poses[8], faces, poses[8][known][rng.permutation(8)], False),
        "a cat": (other, cat["faces"], other[farthest(other, 8)], False),
    }
    with native.Mesh(poses[0], faces) as mesh, native.Registration(mesh, poses[:8]) as fitter:
        for name, (points, triangles, places, is_right) in scans.items():
            with native.Scan(points, triangles) as scan:
                report = fitter.fit(scan, known, places)
            assert (report.warning == "") == is_right, (name, report)


if __name__ == "__main__":
    support.run(globals())
