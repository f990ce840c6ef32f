# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounded biharmonic weights.

No general solver for bounded problems finishes on meshes of this size in reasonable time. So there
are two kinds of peer: on the real meshes the same biharmonic problem without its bounds, which is
one factorisation and one solve and therefore less work than any method for the bounded one; and on
a mesh of a few hundred vertices a general solver for the very problem.
"""

import numpy

import inputs
from area_amrap import TABLE_1
from characters import handles_of, native
from inputs import Missing
from measure import interleave, timed

try:
    import scipy.sparse as sparse
    import scipy.sparse.linalg as solvers
except ImportError:
    sparse = None
try:
    import cvxopt
    import cvxopt.solvers
except ImportError:
    cvxopt = None

SMALL = "weights/bar250x3/bbw"


def run(bench):
    for name, (handle_count, *_) in TABLE_1.items():
        row = f"weights/{name}/bbw"
        bench.run([row], lambda bench, n=name, h=handle_count, r=row: _unbounded(bench, n, h, r))
    bench.run([SMALL], _bounded)


def _unbounded(bench, name, handle_count, row):
    if sparse is None:
        raise Missing("python3-scipy is not installed")
    character = inputs.real(name, handle_count, 1)
    mesh, handles = native.Mesh(character.positions, character.triangles), handles_of(character)
    energy = biharmonic(mesh, character)
    free, right = boundary_problem(energy, character)
    inner = energy[free][:, free].tocsc()

    def factor_and_solve():
        # What SuperLU has for symmetric matrices; its default ordering takes several times longer.
        options = dict(permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)
        factor = solvers.splu(inner, options=dict(SymmetricMode=True), **options)
        factor.solve(right)

    ours, peer = interleave(
        bench.repeats(5, 2),
        timed(native.bounded_biharmonic, mesh, handles),
        timed(factor_and_solve),
    )
    notes = f"{len(character.positions)} vertices, {handle_count} handles; the peer has no bounds"
    bench.add(row, ours, peer, "s", "SciPy splu, factor and solve without bounds", notes)


def biharmonic(mesh, character):
    """L M^-1 L, with areas shared out equally among the corners of triangles."""
    faces, count = character.triangles.astype(int), len(character.positions)
    cotangents = mesh.cotangents()
    ends = [faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]]
    i, j = numpy.concatenate(ends).T
    weights = cotangents.T.ravel()
    laplacian = sparse.csr_matrix((weights, (i, j)), (count, count))
    laplacian = laplacian + laplacian.T
    laplacian = sparse.diags(numpy.asarray(laplacian.sum(axis=1)).ravel()) - laplacian
    a, b, c = character.positions.astype(float)[faces.T]
    areas = numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1) / 2
    masses = numpy.bincount(faces.ravel(), numpy.repeat(areas / 3, 3), count)
    masses *= count / masses.sum()
    return (laplacian @ sparse.diags(1 / masses) @ laplacian).tocsr()


def held_weights(character):
    """[V][H]: 1 on the vertices of handles; and which vertices are free."""
    held = numpy.zeros((len(character.positions), len(character.handles)))
    for h, vertices in enumerate(character.handles):
        held[vertices, h] = 1
    return held, numpy.flatnonzero(held.sum(axis=1) == 0)


def boundary_problem(energy, character):
    held, free = held_weights(character)
    return free, -(energy @ held)[free]


# ------------------------------------------------------------------------ the bounded problem


def _bounded(bench):
    if sparse is None or cvxopt is None:
        raise Missing("python3-scipy or python3-cvxopt is not installed")
    character = inputs.bumpy_bar(250, 1, 3)
    mesh, handles = native.Mesh(character.positions, character.triangles), handles_of(character)
    energy = biharmonic(mesh, character)
    problem = quadratic_program(energy, character)
    ours, peer = interleave(
        bench.repeats(9, 3),
        timed(native.bounded_biharmonic, mesh, handles),
        timed(solve_quadratic_program, problem),
    )
    found = native.bounded_biharmonic(mesh, handles).T.astype(float)
    best = weights_of(solve_quadratic_program(problem), character)
    excess = energy_of(energy, found) / energy_of(energy, best) - 1
    apart = numpy.abs(found - best).max()
    notes = (
        f"{len(character.positions)} vertices, 3 handles; our energy is {excess:+.1%} of the "
        f"peer's, weights differ by {apart:.1g} at most"
    )
    bench.add(SMALL, ours * 1e3, peer * 1e3, "ms", "cvxopt coneqp, the same problem", notes)


def quadratic_program(energy, character):
    """All handles at once, for their weights have to sum to one."""
    free, right = boundary_problem(energy, character)
    handle_count = len(character.handles)
    inner = energy[free][:, free].toarray()
    scale = numpy.trace(inner) / len(inner)
    size = inner.shape[0] * handle_count
    return dict(
        P=cvxopt.matrix(numpy.kron(numpy.eye(handle_count), inner / scale)),
        q=cvxopt.matrix(-right.T.ravel() / scale),
        G=cvxopt.spmatrix(-1.0, range(size), range(size)),
        h=cvxopt.matrix(0.0, (size, 1)),
        A=cvxopt.sparse(cvxopt.matrix(numpy.tile(numpy.eye(len(free)), handle_count))),
        b=cvxopt.matrix(1.0, (len(free), 1)),
    )


def solve_quadratic_program(problem):
    options = {"show_progress": False, "abstol": 1e-10, "reltol": 1e-8, "feastol": 1e-8}
    return cvxopt.solvers.coneqp(**problem, options=options)["x"]


def weights_of(solution, character):
    held, free = held_weights(character)
    held[free] = numpy.array(solution).reshape(len(character.handles), -1).T
    return held


def energy_of(energy, weights):
    return 0.5 * float((weights * (energy @ weights)).sum())
