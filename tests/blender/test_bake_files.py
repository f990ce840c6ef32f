# SPDX-License-Identifier: GPL-3.0-or-later
"""Cache files byte by byte, files that appear whole or not at all, bounded least squares."""

import os
import resource
import signal
import struct
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, os.path.dirname(__file__))
import bake_support  # noqa: E402
import support  # noqa: E402

addon = bake_support.load_addon()
errors = addon("scene.baking.errors")
least_squares = addon("scene.baking.least_squares")
mdd = addon("scene.baking.mdd")
mesh_cache = addon("scene.baking.mesh_cache")
pc2 = addon("scene.baking.pc2")
replacing = addon("scene.baking.replacing")
weights = addon("scene.baking.weights")


class FolderCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.random = np.random.default_rng(1)

    def samples(self, count=7, vertex_count=11):
        values = self.random.normal(size=(count, vertex_count, 3)).astype(np.float32)
        # What a comparison of numbers would not tell apart.
        values[0, 0] = (-0.0, 1e-42, np.finfo(np.float32).max)
        return values

    def assert_untouched(self, path, before):
        self.assertEqual(path.read_bytes(), before)
        self.assertEqual([found.name for found in path.parent.iterdir()], [path.name])


def write(writer, samples):
    with writer:
        for sample in samples:
            writer.append(sample)
        writer.finish()


class Pc2(FolderCase):
    def test_round_trip_keeps_every_bit(self):
        samples = self.samples()
        path = self.folder / "a.pc2"
        header = pc2.Header(11, 7, -3.0, 2.0)
        write(pc2.writer(path, header), samples)
        found, positions = pc2.read(path)
        self.assertEqual(found, header)
        self.assertEqual(positions.tobytes(), samples.tobytes())

    def test_bytes_are_those_of_the_format(self):
        path = self.folder / "a.pc2"
        sample = np.array([[[1, 2, 3]]], np.float32)
        write(pc2.writer(path, pc2.Header(1, 1, 5.0, 1.0)), sample)
        expected = b"POINTCACHE2\0" + struct.pack("<iiffi", 1, 1, 5.0, 1.0, 1)
        self.assertEqual(path.read_bytes(), expected + struct.pack("<fff", 1, 2, 3))

    def test_reader_refuses_what_is_no_pc2(self):
        path = self.folder / "a.pc2"
        write(pc2.writer(path, pc2.Header(11, 7, 0.0, 1.0)), self.samples())
        whole = path.read_bytes()
        negative = whole[:16] + struct.pack("<i", -1) + whole[20:]
        for broken in (b"", whole[:20], whole[:-1], whole + b"x", b"X" + whole[1:], negative):
            path.write_bytes(broken)
            with self.assertRaises(errors.ReadError):
                pc2.read(path)


class Mdd(FolderCase):
    def test_round_trip_keeps_every_bit(self):
        samples = self.samples()
        path = self.folder / "a.mdd"
        times = np.arange(7, dtype=np.float32) / 24
        write(mdd.writer(path, mdd.Header(11, times)), samples)
        found, positions = mdd.read(path)
        self.assertEqual(found.vertex_count, 11)
        self.assertEqual(found.times.tobytes(), times.tobytes())
        self.assertEqual(positions.tobytes(), samples.tobytes())

    def test_bytes_are_those_of_the_format(self):
        path = self.folder / "a.mdd"
        sample = np.array([[[1, 2, 3]]], np.float32)
        write(mdd.writer(path, mdd.Header(1, [0.5])), sample)
        self.assertEqual(path.read_bytes(), struct.pack(">iiffff", 1, 1, 0.5, 1, 2, 3))

    def test_reader_refuses_what_is_no_mdd(self):
        path = self.folder / "a.mdd"
        write(mdd.writer(path, mdd.Header(11, np.zeros(7))), self.samples())
        whole = path.read_bytes()
        for broken in (b"", whole[:9], whole[:-1], whole + b"x", struct.pack(">ii", -1, 11)):
            path.write_bytes(broken)
            with self.assertRaises(errors.ReadError):
                mdd.read(path)


class WholeOrNotAtAll(FolderCase):
    def setUp(self):
        super().setUp()
        self.path = self.folder / "a.pc2"
        self.path.write_bytes(b"before")

    def writer(self, sample_count=7):
        return pc2.writer(self.path, pc2.Header(11, sample_count, 0.0, 1.0))

    def test_left_early(self):
        with self.writer() as writer:
            writer.append(self.samples()[0])
        self.assert_untouched(self.path, b"before")

    def test_left_by_an_error(self):
        with self.assertRaises(KeyError), self.writer() as writer:
            writer.append(self.samples()[0])
            raise KeyError
        self.assert_untouched(self.path, b"before")

    def test_too_few_or_too_many_samples_or_of_another_size(self):
        samples = self.samples()
        with self.assertRaises(ValueError), self.writer() as writer:
            writer.append(samples[0])
            writer.finish()
        with self.assertRaises(ValueError), self.writer(1) as writer:
            writer.append(samples[0])
            writer.append(samples[1])
        with self.assertRaises(ValueError), self.writer() as writer:
            writer.append(samples[0][:-1])
        self.assert_untouched(self.path, b"before")

    def test_a_link_stays_a_link_and_permissions_stay(self):
        link = self.folder / "link.pc2"
        link.symlink_to(self.path.name)
        self.path.chmod(0o640)
        write(pc2.writer(link, pc2.Header(11, 7, 0.0, 1.0)), self.samples())
        self.assertTrue(link.is_symlink())
        self.assertEqual(self.path.stat().st_mode & 0o777, 0o640)
        self.assertEqual(len(pc2.read(self.path)[1]), 7)

    def test_no_folder_or_a_folder_in_the_way(self):
        for path in (self.folder / "missing" / "a.pc2", self.folder, self.path / "a.pc2"):
            with self.assertRaises(errors.WriteError) as caught:
                write(pc2.writer(path, pc2.Header(11, 7, 0.0, 1.0)), self.samples())
            self.assertIn(str(path), str(caught.exception))
        self.assert_untouched(self.path, b"before")

    def test_folder_that_must_not_be_written_to(self):
        self.folder.chmod(0o555)
        self.addCleanup(self.folder.chmod, 0o755)
        with bake_support.without_root(), self.assertRaises(errors.WriteError) as caught:
            with self.writer():
                pass
        self.assertIn(str(self.path), str(caught.exception))
        self.assertIn("ermission", str(caught.exception))
        self.assert_untouched(self.path, b"before")

    def test_file_that_must_not_be_written_to(self):
        self.folder.chmod(0o777)
        self.path.chmod(0o444)
        with bake_support.without_root(), self.assertRaises(errors.WriteError):
            with self.writer():
                pass
        self.assert_untouched(self.path, b"before")

    def test_more_than_the_disk_has_is_refused_before_the_first_sample(self):
        with self.assertRaises(errors.WriteError) as caught:
            with pc2.writer(self.path, pc2.Header(2**30, 2**30, 0.0, 1.0)):
                self.fail("it was let in")
        self.assertIn("The disk is full", str(caught.exception))
        self.assertIn(str(self.path), str(caught.exception))
        self.assertIn("TB", str(caught.exception))
        self.assert_untouched(self.path, b"before")

    def test_more_than_the_process_may_write(self):
        """A limit that no look at free space foresees."""
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, limits[1]))
        try:
            with self.assertRaises(errors.WriteError) as caught:
                write(self.writer(), self.samples())
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        self.assertIn("956 bytes", str(caught.exception))
        self.assert_untouched(self.path, b"before")

    def test_full_while_writing(self):
        """Where the file system cannot claim space ahead, the write itself fails."""
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        with self.assertRaises(errors.WriteError), self.writer() as writer:
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
            try:
                writer.append(self.samples()[0])
            finally:
                resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        self.assert_untouched(self.path, b"before")

    def test_sizes_are_told_in_words(self):
        texts = [replacing.size_text(size) for size in (0, 999, 1500, 2.5e6, 7e9, 4e12, 5e15)]
        self.assertEqual(
            texts, ["0 bytes", "999 bytes", "1.5 kB", "2.5 MB", "7.0 GB", "4.0 TB", "5000.0 TB"]
        )


class BoundedLeastSquares(unittest.TestCase):
    def test_conditions_of_optimality(self):
        """x in its bounds; the gradient zero inside, outward at a bound. Whatever the rank."""
        random = np.random.default_rng(2)
        for trial in range(500):
            matrix, right, lower, upper, start = bake_support.random_bounded_problem(random, trial)
            gram, projected = matrix.T @ matrix, matrix.T @ right
            x = least_squares.solve(gram, projected, lower, upper, start)
            self.assertTrue(np.all((lower <= x) & (x <= upper)))
            gradient = gram @ x - projected
            allowed = np.where(x <= lower, np.minimum(gradient, 0.0), gradient)
            allowed = np.where(x >= upper, np.maximum(allowed, 0.0), allowed)
            allowed[lower >= upper] = 0.0
            scale = np.abs(projected).max() + 1e-30
            self.assertLess(np.abs(allowed).max(), 1e-11 * scale)

    def test_agrees_with_scipy(self):
        try:
            from scipy.optimize import lsq_linear
        except ImportError:
            self.skipTest("SciPy is not installed for this Python")
        random = np.random.default_rng(3)
        for trial in range(200):
            matrix, right, lower, upper, start = bake_support.random_bounded_problem(random, trial)
            upper = np.maximum(upper, lower + 1e-9)
            x = least_squares.solve(matrix.T @ matrix, matrix.T @ right, lower, upper, start)
            other = lsq_linear(matrix, right, (lower, upper), method="bvls", tol=1e-14)
            ours, theirs = (np.sum((matrix @ v - right) ** 2) for v in (x, other.x))
            self.assertLess(ours - theirs, 1e-11 * (1.0 + theirs))

    def test_known_values_come_back(self):
        random = np.random.default_rng(4)
        basis = random.normal(size=(500, 3))
        deltas = random.normal(size=(6, 500, 3)).astype(np.float32)
        lower, upper = np.array([0, -1, 0, 0, 0, 0.2]), np.array([1, 1, 1, 2, 1, 0.8])
        fit = weights.KeyFit(basis, deltas, lower, upper)
        for _ in range(20):
            # Rounded as a slider rounds; at the bounds as well as between them.
            values = random.uniform(lower, upper).astype(np.float32)
            values[0], values[3] = random.choice([0, 1]), random.choice([0, 2])
            values = np.clip(values, lower.astype(np.float32), upper.astype(np.float32))
            positions = basis + np.einsum("s,svc->vc", values.astype(float), deltas)
            found, distances = fit.fit(positions)
            np.testing.assert_allclose(found, values, atol=1e-6)
            self.assertLess(distances.max(), 1e-5)

    def test_two_equal_shapes_share(self):
        deltas = np.ones((2, 4, 3))
        fit = weights.KeyFit(np.zeros((4, 3)), deltas, [0, 0], [1, 1])
        found, distances = fit.fit(np.full((4, 3), 1.5))
        self.assertAlmostEqual(float(found.sum()), 1.5, places=6)
        self.assertLess(distances.max(), 1e-6)

    def test_misfit_sums_up(self):
        total = weights.ErrorSum()
        total.add(10, np.array([3.0, 0.0]))
        total.add(12, np.array([4.0, 5.0]))
        misfit = total.misfit(10.0)
        self.assertAlmostEqual(misfit.rms, (50 / 4) ** 0.5 / 10)
        self.assertEqual((misfit.largest, misfit.worst_frame), (0.5, 12))


class TimeMapping(unittest.TestCase):
    def test_every_frame_meets_its_sample(self):
        """As the modifier computes: float32, and exact where at most 1e-4 past a sample."""
        for start, step, count in (
            (1, 1, 300), (-17, 1, 50), (0, 3, 900), (5, 3, 400), (1001, 7, 300), (10, 4, 30),
            (-50, 6, 40), (100, 5, 1), (-3, 9, 200), (86400, 2, 500),
        ):  # fmt: skip
            scale, offset = map(np.float32, mesh_cache.time_mapping(start, step, count))
            for sample in range(count):
                time = scale * np.float32(start + sample * step) - offset
                self.assertEqual(np.floor(time), sample)
                self.assertLessEqual(time - np.floor(time), np.float32(1e-4))


if __name__ == "__main__":
    support.run(globals())
