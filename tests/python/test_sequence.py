# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences through the native door: against NumPy, and on real meshes."""

import sys
import tempfile
from pathlib import Path

import numpy
import support

sys.path.insert(0, str(support.ROOT / "blender_addon"))
import native  # noqa: E402

TRIANGLES = [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]
REST = numpy.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], numpy.float32)


def wobble(count):
    phases = numpy.linspace(0, 7, count)
    waves = numpy.stack([numpy.sin(phases), numpy.cos(1.7 * phases), numpy.sin(3.1 * phases)])
    return (REST + 0.2 * waves.T[:, None, :] * REST[:, None, :].sum(-1)[None] * 2).astype("f4")


def sequence_of(frames, rest=REST, triangles=TRIANGLES, **options):
    sequence = native.Sequence(native.Mesh(rest, triangles), **options)
    for frame in frames:
        sequence.add_frame(frame)
    return sequence


def gallop():
    data = numpy.load(support.data("horse_gallop.npz"))
    return data["poses"][0], data["faces"], data["poses"][1:25]


def test_every_call_of_the_door():
    frames = wobble(15)
    with sequence_of(frames) as sequence:
        stages = []
        report = sequence.fit(tolerance=1e-6, progress=lambda *now: stages.append(now) and None)
        assert report.error <= 1e-6 and stages
        assert numpy.allclose(sequence.evaluate(4), frames[4], atol=1e-5)
        assert numpy.allclose(sequence.evaluate_f64(4), frames[4], atol=1e-5)
        assert sequence.derivative(4.5).shape == (4, 3)
        assert sequence.info.frame_count == 15 and sequence.window().fitted_frame_count == 15
        positions, pinned = sequence.marks()
        assert positions.shape == (15, 2) and not pinned.any()
        assert numpy.allclose(sequence.pose(sequence.curve_point(3)), sequence.evaluate(3))
        assert len(sequence.parameters()) == 15 and len(sequence.sites()) == report.site_count
        knots, points = sequence.knots(), sequence.control_points()
        assert len(knots) == len(points) + 2 and knots[2] == 0
        sequence.move_control_points(0, points)
        sequence.insert_control_point(3)
        sequence.insert_control_point(3, (0.1, 0.2))
        sequence.delete_control_point(3)
        assert len(sequence.control_points()) == len(points) + 1
        sequence.place({2: (1, 1)})
        assert sequence.marks()[1].nonzero()[0].tolist() == [2]
        rms, largest = sequence.measure()
        assert (rms <= largest).all()
        sequence.loop(2, 9)
        sequence.convert_rate(0.5)
        sequence.resample([0, 0.5, 1])
        assert sequence.info.frame_count == 3
        sequence.add_pose(REST * 2, (3, 3))
        assert numpy.allclose(sequence.pose((3, 3)), REST * 2, atol=1e-3)
        carried = sequence.transfer(frames[:4], native.Mesh(REST, TRIANGLES), frames[:4])
        assert numpy.allclose(carried.evaluate(1), sequence.evaluate(1), atol=1e-4)
        sequence.draw([(0, 0), (1, 0), (1, 1), (0, 1)], 10)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.exmseq"
            saved = sequence.save(path)
            loaded = native.Sequence.load(path)
            assert loaded.file_report.file_size == saved.file_size == path.stat().st_size
            assert (loaded.evaluate(2.5) == sequence.evaluate(2.5)).all()
        sequence.fit(examples=frames[:5])
        sequence.drop_frames()
        assert sequence.info.held_frame_count == 0


def test_errors_of_the_door():
    sequence = sequence_of(wobble(5))
    for wrong, words in (
        (lambda: sequence.add_frame(REST[:3]), "3 vertices"),
        (lambda: sequence.add_frame(REST, TRIANGLES[::-1]), "corners"),
        (lambda: sequence.evaluate(0), "fitted"),
        (lambda: sequence.fit(pins={0: (0, 0), 1: (0, 0)}), "one point"),
        (lambda: native.Sequence.load("/nowhere"), "/nowhere"),
    ):
        try:
            wrong()
        except native.ExemplarError as error:
            assert words in str(error), error
        else:
            raise AssertionError(words)
    sequence.close()


def test_components_are_those_of_a_singular_value_decomposition():
    frames = wobble(20)
    sequence = sequence_of(frames)
    rows = frames.reshape(20, -1).astype(float)
    values = numpy.linalg.svd(rows - rows.mean(0), compute_uv=False)
    for count in (1, 2):
        report = sequence.fit(22, 20, count)
        rest = numpy.sqrt((values[count:] ** 2).sum() / (20 * 4)) / report.diagonal
        assert abs(report.shape_error - rest) < 1e-7, (report.shape_error, rest)


def test_thin_plate_is_that_of_scipy():
    """All sites: the interpolant is unique, so any implementation has the same one."""
    try:
        from scipy.interpolate import RBFInterpolator
    except ImportError:
        raise support.unittest.SkipTest("SciPy is not here")
    frames = wobble(18)
    sequence = sequence_of(frames)
    sequence.fit(20, 18, 17)
    positions, _ = sequence.marks()
    theirs = RBFInterpolator(positions, frames.reshape(18, -1).astype(float))
    for point in numpy.random.default_rng(3).uniform(-0.5, 0.5, (20, 2)):
        assert numpy.allclose(theirs(point[None]).reshape(4, 3), sequence.pose(point), atol=1e-4)


def test_paper_constants_on_real_sequences():
    """Table 1's constants; the bounds are what a plain NumPy version of the whole fit reaches."""
    rest, faces, frames = gallop()
    sequence = sequence_of(frames, rest, faces)
    report = sequence.fit(16, 12, 7)
    rms, largest = sequence.measure()
    assert abs(numpy.sqrt((rms**2).mean()) / report.error - 1) < 1e-3
    assert largest.max() < 0.1
    exact = sequence.fit(26, 24, 23)
    assert exact.error < 1e-6 and sequence.measure()[1].max() < 1e-6


if __name__ == "__main__":
    support.run(globals())
