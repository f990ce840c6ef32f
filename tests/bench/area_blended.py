# SPDX-License-Identifier: GPL-3.0-or-later
"""Blended on the real meshes: an iteration, a whole solve up to coefficients, positions, bind; and
the eigenfunctions it is made of."""

import ctypes

import numpy

import inputs
import peers
from characters import handles_of, native
from inputs import Missing
from measure import clock, interleave, timed

try:
    import scipy.sparse as sparse
    import scipy.sparse.linalg as solvers
except ImportError:
    sparse = None

# [Blended, table 1], milliseconds: of its cat and horse; the largest for those it does not have.
TABLE_1 = {"tosca_cat": (1.2, 15.3), "horse": (1.1, 14.7), "cat": (1.2, 15.3), "lion": (1.2, 15.3)}
POINTS, SHAPES = 10, 6
EIGEN_COUNT, EIGEN_SIZES = 15, {"8k": 8000, "50k": 50000, "200k": 200000}
MORE = 100  # iterations


def run(bench):
    for name in TABLE_1:
        rows = [f"blended/{name}/{row}" for row in ("iteration", "solve", "positions")]
        bench.run(rows, lambda bench, name=name: _character(bench, name))
    for label, size in EIGEN_SIZES.items():
        row = f"weights/bar{label}/eigenfunctions"
        bench.run([row], lambda bench, row=row, size=size: _eigenfunctions(bench, row, size))


class Solve:
    """The C function, called as directly as can be."""

    def __init__(self, deformer, targets, **settings):
        self.deformer, self.targets = deformer, numpy.ascontiguousarray(targets)
        self.settings = native.declarations.initialised(
            native.library(),
            native.declarations.CBlendedSolveSettings,
            "exm_blended_solve_settings_init",
            **settings,
        )
        self.call = native.library().exm_blended_solve

    def __call__(self):
        settings, handle = ctypes.byref(self.settings), self.deformer._handle
        start = clock()
        status = self.call(handle, self.targets.ctypes.data, settings, None)
        seconds = clock() - start
        if status < 0:
            raise RuntimeError(native.library().exm_last_error().decode())
        return seconds


def _character(bench, name):
    iteration, whole = TABLE_1[name]
    character = inputs.real(name, POINTS, SHAPES + 1, rings=0)
    exemplars, left_out = character.exemplars[:SHAPES], character.exemplars[SHAPES]
    mesh, handles = native.Mesh(character.positions, character.triangles), handles_of(character)
    start = clock()
    deformer = native.Blended(mesh, exemplars, handles)
    bind = clock() - start
    targets = numpy.zeros((POINTS, 3, 4))
    targets[:, :, :3] = numpy.eye(3)
    targets[:, :, 3] = [1.5 * left_out[v].mean(axis=0) for v in character.handles]
    plain, more = Solve(deformer, targets), Solve(deformer, targets, average_iterations=8 + MORE)
    few, many = interleave(bench.repeats(60, 15), plain, more, burst=5)
    info = deformer.blended_info()
    notes = (
        f"{len(character.positions)} vertices, q = {SHAPES}, r = {deformer.info.edge_group_count}, "
        f"b = {info.start_atom_count} and {info.atom_count}; bound in {bind:.2g} s"
    )
    case, printed = f"blended/{name}", "Blended table 1 (printed)"
    one = (many - few) / MORE * 1e3
    average = f"of average ARAP, the dearest; {notes}"
    bench.add(f"{case}/iteration", one, iteration, "ms", printed, average, is_printed=True)
    bench.add(f"{case}/solve", few * 1e3, whole, "ms", printed, notes, is_printed=True)
    _positions(bench, f"{case}/positions", deformer)


def _positions(bench, row, deformer):
    """V = D T as one dense product, by NumPy."""
    if not bench.wants(row):
        return
    functions, positions = deformer.functions(), deformer.positions()
    atoms = deformer.blended_info().whole_atom_count
    generator = numpy.random.default_rng(1)
    dense = generator.normal(size=(functions.shape[1], atoms)).astype(numpy.float32)
    coefficients = generator.normal(size=(atoms, 3)).astype(numpy.float32)
    ours, peer = interleave(
        bench.repeats(60, 15),
        timed(deformer.positions, positions, 1),
        timed(numpy.matmul, dense, coefficients),
        burst=5,
    )
    bench.add(row, ours * 1e3, peer * 1e3, "ms", "NumPy, dense D @ T of as many atoms")


def _eigenfunctions(bench, row, size):
    if sparse is None:
        raise Missing("python3-scipy is not installed")
    character = inputs.bumpy_bar(size, 1, 3)
    mesh = native.Mesh(character.positions, character.triangles)
    stiffness, masses = peers.laplacian(mesh, character)
    weights = sparse.diags(masses).tocsc()

    def eigsh():
        shift = -1e-3 * 4 * numpy.pi / masses.sum()
        return solvers.eigsh(stiffness, EIGEN_COUNT, weights, sigma=shift)

    ours, peer = interleave(
        bench.repeats(5, 1), timed(native.eigenfunctions, mesh, EIGEN_COUNT), timed(eigsh)
    )
    values, functions = native.eigenfunctions(mesh, EIGEN_COUNT)
    apart = numpy.abs(values - numpy.sort(eigsh()[0])).max() / values[-1]
    residual = stiffness @ functions.T - masses[:, None] * functions.T * values
    residual = numpy.linalg.norm(residual / numpy.sqrt(masses)[:, None], axis=0).max() / values[-1]
    notes = (
        f"{len(character.positions)} vertices, {EIGEN_COUNT} functions; eigenvalues differ by "
        f"{apart:.1g}, residual {residual:.1g}"
    )
    bench.add(row, ours, peer, "s", "SciPy eigsh, shift-invert", notes)
