# SPDX-License-Identifier: GPL-3.0-or-later
"""What our rows are measured against, where more than one area uses it."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy

from measure import Worker, timed

try:
    import scipy.sparse as sparse
except ImportError:
    sparse = None


def program(bench, name):
    """A program of the peers' build, or None."""
    path = bench.build / "peers" / name
    return path if path.exists() else None


def write_arrays(path, *arrays):
    with open(path, "wb") as file:
        for array in arrays:
            file.write(numpy.int64(array.size).tobytes())
            file.write(numpy.ascontiguousarray(array).tobytes())


def displacements(character, targets):
    """How far every handle is from where the reference has it: [frames][H][3]."""
    centres = numpy.array([character.positions[v].mean(axis=0) for v in character.handles])
    return targets[:, :, :, 3] - centres


@contextmanager
def cgal_arap(bench, character, targets):
    """A worker, or None where CGAL is not there."""
    path = program(bench, "cgal_arap")
    if path is None:
        yield None
        return
    handles = [numpy.full(len(v), h, numpy.uint32) for h, v in enumerate(character.handles)]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "arap.bin"
        write_arrays(
            file,
            character.positions.astype(float),
            character.triangles.astype(numpy.uint32),
            numpy.concatenate(handles),
            numpy.concatenate(character.handles).astype(numpy.uint32),
            displacements(character, targets),
        )
        with Worker(path, file) as worker:
            yield worker


def products(character, deformer):
    """V = D T in NumPy and SciPy, in single precision, with the coefficients of the deformer's
    last solve: measurements by name, and how far they are from ours as a share of the diagonal.
    """
    weights = deformer.weights()
    dictionary = dictionary_of(weights, character.exemplars)
    exact = deformer.positions_f64()
    coefficients = numpy.linalg.lstsq(dictionary, exact, rcond=1e-12)[0].astype(numpy.float32)
    dense = dictionary.astype(numpy.float32)
    worst = numpy.abs(dense @ coefficients - deformer.positions()).max() / character.diagonal
    if worst > 1e-3:
        raise RuntimeError(f"the positions differ by {worst:.2g} of the diagonal")
    found = {"NumPy, dense D @ T": timed(numpy.matmul, dense, coefficients)}
    if sparse is not None:
        rows = sparse.csr_matrix(dense)
        found["SciPy, sparse D @ T"] = timed(rows.dot, coefficients)
    by_blend = _einsum(weights, character.exemplars, coefficients)
    found["NumPy, einsum of weights and exemplars"] = by_blend
    return found, worst


def dictionary_of(weights, exemplars):
    """D = [w_h | w_h p_s], [V][H (1 + 3 S)]."""
    handle_count, vertex_count = weights.shape
    homogeneous = numpy.concatenate(
        [numpy.ones((vertex_count, 1)), *(shape.astype(float) for shape in exemplars)], axis=1
    )
    product = weights.astype(float).T[:, :, None] * homogeneous[:, None, :]
    return product.reshape(vertex_count, -1)


def _einsum(weights, exemplars, coefficients):
    """Transformations blended first, then applied: the usual way to skin in NumPy."""
    vertex_count = weights.shape[1]
    by_vertex = numpy.ascontiguousarray(weights.T)
    ones = numpy.ones((vertex_count, 1), numpy.float32)
    homogeneous = numpy.concatenate([ones, *exemplars], axis=1).astype(numpy.float32)
    table = coefficients.reshape(len(weights), -1)

    def apply():
        blended = (by_vertex @ table).reshape(vertex_count, -1, 3)
        numpy.einsum("vk,vkj->vj", homogeneous, blended)

    return timed(apply)


def laplacian(mesh, character):
    """The cotangent Laplacian that the library uses, sparse, and the vertices' masses."""
    faces, count = character.triangles.astype(int), len(character.positions)
    ends = [faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]]
    i, j = numpy.concatenate(ends).T
    weights = sparse.csr_matrix((mesh.cotangents().T.ravel(), (i, j)), (count, count))
    weights = weights + weights.T
    stiffness = sparse.diags(numpy.asarray(weights.sum(axis=1)).ravel()) - weights
    a, b, c = character.positions.astype(float)[faces.T]
    areas = numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1) / 2
    masses = numpy.bincount(faces.ravel(), numpy.repeat(areas / 3, 3), count)
    return stiffness.tocsc(), masses
