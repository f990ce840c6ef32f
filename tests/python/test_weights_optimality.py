# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounded biharmonic weights against a general solver of quadratic programs."""

import ctypes
import unittest

import numpy
import support

try:
    import cvxopt
    import cvxopt.solvers
except ImportError:
    cvxopt = None


class Handles(ctypes.Structure):
    _fields_ = [
        ("count", ctypes.c_size_t),
        ("kinds", ctypes.c_void_p),
        ("vertex_offsets", ctypes.c_void_p),
        ("vertices", ctypes.c_void_p),
    ]


def library():
    lib = ctypes.CDLL(str(support.LIBRARY))
    lib.exm_last_error.restype = ctypes.c_char_p
    return lib


def address(array):
    return ctypes.c_void_p(array.ctypes.data)


def check(lib, status):
    assert status >= 0, lib.exm_last_error().decode()


def solve(positions, triangles, handles):
    """The library's weights [H][V], and its cotangents [F][3]."""
    lib = library()
    positions = numpy.ascontiguousarray(positions, numpy.float32)
    triangles = numpy.ascontiguousarray(triangles, numpy.uint32)
    mesh = ctypes.c_void_p()
    size = ctypes.c_size_t
    check(
        lib,
        lib.exm_mesh_create(
            address(positions),
            size(len(positions)),
            address(triangles),
            size(len(triangles)),
            ctypes.byref(mesh),
        ),
    )
    offsets = numpy.cumsum([0] + [len(h) for h in handles]).astype(numpy.uintp)
    vertices = numpy.concatenate(handles).astype(numpy.uint32)
    view = Handles(len(handles), None, offsets.ctypes.data, vertices.ctypes.data)
    weights = numpy.zeros((len(handles), len(positions)), numpy.float32)
    cotangents = numpy.zeros(triangles.shape)
    check(lib, lib.exm_mesh_cotangents(mesh, address(cotangents)))
    status = lib.exm_weights_bounded_biharmonic(
        mesh, ctypes.byref(view), None, None, address(weights)
    )
    check(lib, status)
    assert status == 0, lib.exm_last_error().decode()
    lib.exm_mesh_destroy(mesh)
    return weights.astype(float), cotangents


def energy_matrix(positions, triangles, cotangents):
    """L M^-1 L, dense, in units of the mean mass."""
    count = len(positions)
    laplacian = numpy.zeros((count, count))
    masses = numpy.zeros(count)
    corners = positions.astype(float)[triangles]
    areas = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = numpy.linalg.norm(areas, axis=1) / 2
    for i in range(3):
        a, b = triangles[:, (i + 1) % 3], triangles[:, (i + 2) % 3]
        for j, k, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            numpy.add.at(laplacian, (j, k), sign * cotangents[:, i])
        numpy.add.at(masses, triangles[:, i], areas / 3)
    return laplacian @ (laplacian / (masses / masses.mean())[:, None])


def energy(matrix, weights):
    return 0.5 * numpy.sum((weights @ matrix) * weights)


def optimum(matrix, handles):
    """The weights of the same program by an interior-point method."""
    count, width = len(matrix), len(handles)
    held = numpy.zeros((width, count))
    for h, vertices in enumerate(handles):
        held[h, vertices] = 1
    free = numpy.flatnonzero(held.sum(0) == 0)
    eye, unit = numpy.eye(len(free)), numpy.eye(width)
    scale = numpy.abs(numpy.diag(matrix)).mean()
    quadratic = numpy.kron(unit, matrix[numpy.ix_(free, free)]) / scale
    linear = (held @ matrix[:, free]).ravel() / scale
    sums = numpy.kron(numpy.ones((1, width)), eye)
    options = {"show_progress": False, "abstol": 1e-12, "reltol": 1e-9, "feastol": 1e-10}
    found = cvxopt.solvers.qp(
        cvxopt.matrix(quadratic),
        cvxopt.matrix(linear),
        cvxopt.spmatrix(-1.0, range(width * len(free)), range(width * len(free))),
        cvxopt.matrix(0.0, (width * len(free), 1)),
        cvxopt.sparse(cvxopt.matrix(sums)),
        cvxopt.matrix(1.0, (len(free), 1)),
        options=options,
    )
    weights = held.copy()
    weights[:, free] = numpy.array(found["x"]).reshape(width, len(free))
    return weights


def grid(columns, rows, lift):
    x, y = numpy.meshgrid(numpy.arange(columns + 1.0), numpy.arange(rows + 1.0))
    positions = numpy.stack([x.ravel(), y.ravel(), lift(x, y).ravel()], axis=1)
    corner = numpy.arange((columns + 1) * rows).reshape(rows, columns + 1)[:, :-1].ravel()
    above = corner + columns + 1
    triangles = [[corner, corner + 1, above + 1], [corner, above + 1, above]]
    return positions, numpy.concatenate([numpy.stack(t, axis=1) for t in triangles])


def compare(positions, triangles, handles, tolerance=0.01):
    if cvxopt is None:
        raise unittest.SkipTest("python3-cvxopt is not installed")
    weights, cotangents = solve(positions, triangles, handles)
    matrix = energy_matrix(positions, triangles, cotangents)
    best = optimum(matrix, handles)
    found, least = energy(matrix, weights), energy(matrix, best)
    assert found < (1 + tolerance) * least, f"energy {found:.8g}, at best {least:.8g}"
    assert found > (1 - 1e-5) * least, f"energy {found:.8g} below the optimum {least:.8g}"
    error = abs(weights - best).max()
    assert error < 0.04, f"a weight is {error:.3f} from the optimum's"
    return found / least - 1, error


def test_plane():
    positions, triangles = grid(10, 8, lambda x, y: 0 * x)
    compare(positions, triangles, [[0], [10], [40], [60], [93]])


def test_hills():
    positions, triangles = grid(12, 9, lambda x, y: numpy.sin(x) * numpy.cos(0.7 * y))
    compare(positions, triangles, [[0], [12, 25], [60, 61, 73], [129]])


def test_two_handles_on_a_strip():
    positions, triangles = grid(30, 2, lambda x, y: 0 * x)
    compare(positions, triangles, [[0, 31, 62], [30, 61, 92]])


def test_face():
    z = numpy.load(support.data("arkit_face.npz"))
    positions, triangles = z["poses"][0], z["faces"].astype(int)
    # The part around the nose: a real, uneven mesh that a general solver can still take.
    nose = numpy.argmax(positions[:, 2])
    distance = numpy.linalg.norm(positions - positions[nose], axis=1)
    kept = numpy.zeros(len(positions), bool)
    kept[numpy.argsort(distance)[:220]] = True
    triangles = triangles[kept[triangles].all(axis=1)]
    used = numpy.unique(triangles)
    number = numpy.full(len(positions), -1)
    number[used] = numpy.arange(len(used))
    positions, triangles = positions[used], number[triangles]
    nearest = numpy.argsort(distance[used])
    handles = [[nearest[0]], [nearest[-1]], [nearest[len(used) // 2]], [nearest[-40]]]
    compare(positions, triangles, handles)


if __name__ == "__main__":
    support.run(globals())
