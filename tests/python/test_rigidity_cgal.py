# SPDX-License-Identifier: GPL-3.0-or-later
"""r = 1 is CGAL's ORIGINAL_ARAP: the same positions, the same energy, obtuse triangles included.

CGAL's program is that of the benchmarks, which build it: tests/bench/run.sh.
"""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy

import support
from rigidity_support import Handles, Kind, Mesh, Rigidity, RigiditySettings, bar, turn

sys.path.insert(0, str(support.ROOT / "tests" / "bench"))

from area_rigidity import Energy  # noqa: E402
from peers import write_arrays  # noqa: E402

PROGRAM = support.ROOT / "build" / "bench" / "peers" / "cgal_arap"


def cgal(positions, triangles, vertices, places, iterations):
    """Positions after so many iterations with the vertices held."""
    if not PROGRAM.exists():
        raise unittest.SkipTest("CGAL's program is not built; tests/bench/run.sh does")
    with tempfile.TemporaryDirectory() as folder:
        source, result = Path(folder) / "in.bin", Path(folder) / "out.bin"
        write_arrays(
            source,
            positions.astype(float),
            triangles.astype(numpy.uint32),
            numpy.arange(len(vertices), dtype=numpy.uint32),
            vertices.astype(numpy.uint32),
            places - positions[vertices],
        )
        commands = f"solve {iterations} 0 {result}\n"
        subprocess.run(
            [PROGRAM, source], input=commands, text=True, check=True, capture_output=True
        )
        return numpy.fromfile(result).reshape(-1, 3)


def compare(name, positions, triangles, axis, angle, iterations, tolerance):
    """Both ends along an axis held, the far one turned."""
    along = positions[:, axis]
    low, size = along.min(), numpy.ptp(along)
    ends = [
        numpy.flatnonzero(along < low + 0.1 * size).astype(numpy.uint32),
        numpy.flatnonzero(along > low + 0.9 * size).astype(numpy.uint32),
    ]
    handles = Handles([Kind.ORIENTED] * 2, ends)
    with Rigidity(Mesh(positions, triangles), handles, 1, handle_size=0) as deformer:
        targets = deformer.handle_pose(0)
        targets[1, :, :3] = turn(numpy.roll([0, 1, 0.3], axis), angle)
        targets[1, :, 3] += 0.1 * size * numpy.roll([-0.3, 0.5, 1], axis)
        places = [
            (positions[end].astype(float) - rest) @ target[:, :3].T + target[:, 3]
            for end, rest, target in zip(ends, deformer.handle_pose(0)[:, :, 3], targets)
        ]
        theirs = cgal(
            positions, triangles, numpy.concatenate(ends), numpy.concatenate(places), iterations
        )
        settings = RigiditySettings(tolerance=1e-14, iterations=20000, coarse_start=0)
        report = deformer.solve(targets, settings)
        ours = deformer.positions_f64()
    energy = Energy(positions, triangles)(theirs)
    apart = numpy.abs(ours - theirs).max() / size
    print(
        f"  {name}: energies {report.elastic_energy:.9g} and {energy:.9g}, positions "
        f"{apart:.1g} of the length apart"
    )
    assert abs(report.elastic_energy / energy - 1) < tolerance
    assert apart < 20 * tolerance


def obtuse_share(positions, triangles):
    corners = positions[triangles].astype(float)
    edges = numpy.roll(corners, -1, axis=1) - corners
    dots = -(edges * numpy.roll(edges, 1, axis=1)).sum(axis=2)
    return (dots < 0).any(axis=1).mean()


def test_on_a_bar():
    positions, triangles = bar(along=16)
    compare("bar", positions, triangles, 0, 0.7, 3000, 1e-6)


def test_on_a_bar_of_obtuse_triangles():
    positions, triangles = bar(along=16)
    positions = positions.copy()
    positions[:, 0] += 2.5 * positions[:, 1]
    share = obtuse_share(positions, triangles)
    assert share > 0.3, share
    compare("sheared bar", positions, triangles, 0, 0.4, 3000, 1e-6)


def read_off(path):
    words = path.read_text().split()
    vertex_count, face_count = int(words[1]), int(words[2])
    numbers = numpy.array(words[4 : 4 + 3 * vertex_count], float).reshape(-1, 3)
    faces = numpy.array(words[4 + 3 * vertex_count :][: 4 * face_count], int).reshape(-1, 4)
    assert (faces[:, 0] == 3).all()
    return numbers.astype(numpy.float32), faces[:, 1:].astype(numpy.uint32)


def test_on_real_meshes():
    for name, axis in (("cactus_small", 2), ("armadillo_1k", 1), ("bar1", 0)):
        positions, triangles = read_off(support.data(f"{name}.off"))
        axis = int(numpy.argmax(numpy.ptp(positions, axis=0)))
        share = 100 * obtuse_share(positions, triangles)
        compare(f"{name}, {share:.0f} % obtuse", positions, triangles, axis, 0.4, 6000, 1e-4)


if __name__ == "__main__":
    support.run(globals())
