# SPDX-License-Identifier: GPL-3.0-or-later
"""Where Quick Rig wants handles: on the real creatures, and on shapes whose answer is known."""

import sys

import numpy

import support

sys.path.insert(0, str(support.ROOT))
from blender_addon import native  # noqa: E402
from blender_addon.scene import proposals  # noqa: E402

EXEMPLARS = 6  # exemplars; the other poses are held out


def strip(length, width=4):
    """A flat strip along X, from 0 to `length`."""
    places = [(x, y, 0.0) for x in range(length + 1) for y in range(width + 1)]
    faces = []
    for x in range(length):
        for y in range(width):
            a, b = x * (width + 1) + y, (x + 1) * (width + 1) + y
            faces += [(a, b, b + 1), (a, b + 1, a + 1)]
    return numpy.array(places, float), numpy.array(faces)


def folded(places, at, angle):
    """Turned by `angle` about Y beyond x = at."""
    out = places.copy()
    beyond = places[:, 0] > at
    out[beyond, 0] = at + (places[beyond, 0] - at) * numpy.cos(angle)
    out[beyond, 2] = (places[beyond, 0] - at) * numpy.sin(angle)
    return out


def centres(found, places):
    return numpy.array([places[p.vertices].mean(axis=0) for p in found])


def test_tips_and_the_joint_of_a_strip():
    places, faces = strip(60)
    poses = [places, folded(places, 40, 1.2)]
    found = proposals.propose(places, faces, poses, count=4)
    assert [p.role for p in found[:3]] == ["ROOT", "TIP", "TIP"]
    where = centres(found, places)[:, 0]
    assert where.min() < 2 and where.max() > 58, where
    assert found[3].role == "JOINT"
    assert abs(where[3] - 40) < 4, where


def test_handles_share_no_vertex():
    places, faces = strip(60)
    taken = numpy.arange(10)
    found = proposals.propose(places, faces, [places, folded(places, 30, 1.0)], taken, count=9)
    every = numpy.concatenate([taken, *(p.vertices for p in found)])
    assert len(numpy.unique(every)) == len(every)
    assert all(len(p.vertices) for p in found)


def test_no_more_than_fit():
    places, faces = strip(3, 1)
    found = proposals.propose(places, faces, [places], count=64)
    assert 0 < len(found) <= len(places)


def test_a_rigid_motion_and_a_scale_change_nothing():
    places, faces = strip(60)
    poses = [places, folded(places, 40, 1.2), folded(places, 20, -0.8)]
    expected = proposals.propose(places, faces, poses)
    turn = numpy.linalg.qr(numpy.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= numpy.sign(numpy.linalg.det(turn))
    # The exemplars anywhere, the reference at its place: what is compared is their bending.
    moved = [7.0 * pose @ turn + (5, -2, 9) for pose in poses]
    found = proposals.propose(7.0 * places, faces, moved)
    assert len(found) == len(expected)
    for a, b in zip(expected, found):
        assert a.role == b.role and numpy.array_equal(a.vertices, b.vertices)


def test_a_fine_mesh_is_looked_at_in_patches_that_keep_apart_what_is_apart():
    """Two strips a thousandth of their length apart: one cell of the grid holds both."""
    places, faces = strip(900, 3)
    other = places + (0, 3.5, 0)
    both = numpy.concatenate([places, other])
    corners = numpy.concatenate([faces, faces + len(places)])
    assert len(both) > proposals.FINEST
    found = proposals.propose(both, corners, [both, both + (0, 0, 1)])
    first = [p for p in found if p.vertices.max() < len(places)]
    second = [p for p in found if p.vertices.min() >= len(places)]
    assert len(first) + len(second) == len(found), "a handle on both strips"
    assert first and second


def held_out_error(poses, faces, sets):
    """Root mean square over the poses that are no exemplars, as a share of the size."""
    mesh = native.Mesh(poses[0], faces)
    handles = native.Handles([native.Kind.PINNED] * len(sets), sets)
    size = numpy.linalg.norm(numpy.ptp(poses[0], axis=0))
    targets = numpy.zeros((len(sets), 3, 4))
    targets[:, :, :3] = numpy.identity(3)
    errors = []
    with native.Amrap(mesh, poses[:EXEMPLARS], handles) as deformer:
        for pose in poses[EXEMPLARS:]:
            targets[:, :, 3] = [pose[vertices].mean(axis=0) for vertices in sets]
            deformer.solve(targets)
            errors.append(((deformer.positions() - pose) ** 2).sum(axis=1).mean())
    return numpy.sqrt(numpy.mean(errors)) / size


def check_creature(name):
    pack = numpy.load(support.data(f"{name}.npz"))
    poses, faces = pack["poses"], pack["faces"].astype(numpy.uint32)
    found = proposals.propose(poses[0], faces, poses[:EXEMPLARS])
    tips = [p for p in found if p.role == "TIP"]
    assert 8 <= len(found) <= proposals.MOST_BY_ITSELF, len(found)
    assert len(tips) >= 6, "four feet, muzzle, tail"
    ours = held_out_error(poses, faces, [p.vertices for p in found])
    random = numpy.random.default_rng(1)
    chance = []
    for _ in range(5):
        picked = random.choice(len(poses[0]), len(found), replace=False)
        chance.append(held_out_error(poses, faces, [[vertex] for vertex in picked]))
    usual = numpy.mean(chance)
    print(f"{name}: {len(found)} handles, held-out error {ours:.4f}; at random {usual:.4f}")
    assert ours < 0.035
    assert ours < usual


def test_horse():
    check_creature("horse")


def test_lion():
    check_creature("lion")


def test_cat():
    check_creature("cat")


if __name__ == "__main__":
    support.run(globals())
