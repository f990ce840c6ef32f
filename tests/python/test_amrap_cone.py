# SPDX-License-Identifier: GPL-3.0-or-later
"""Blend weights and coefficients with rotations held, as one conic program over the dictionary
[AMRAP, eq. 20], solved by CVXOPT: nothing in it is eliminated that our solver eliminates."""

import unittest

import numpy
import scipy.linalg
from cvxopt import matrix, solvers

import amrap_support
import support
from amrap_support import Amrap, AmrapSettings, Mesh
from native.declarations import Blend

TOLERANCES = {"show_progress": False, "abstol": 1e-9, "reltol": 1e-8, "feastol": 1e-8}


def dictionary(weights, poses):
    """[V][H (1 + 3 S)]: eq. 6 with one translation a handle."""
    ones = numpy.ones((poses.shape[1], 1))
    values = numpy.concatenate([ones, *poses], axis=1)
    return (weights.T[:, :, None] * values[:, None, :]).reshape(poses.shape[1], -1)


def triangle_roots(mesh):
    """[F][3][3] whose squares are the triangles' Dirichlet energies, from their Laplacians."""
    cotangents = mesh.cotangents()
    laplacians = numpy.zeros((len(cotangents), 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        laplacians[:, [j, k], [j, k]] += cotangents[:, i, None]
        laplacians[:, [j, k], [k, j]] -= cotangents[:, i, None]
    values, vectors = numpy.linalg.eigh(laplacians)
    return numpy.sqrt(values.clip(0))[:, :, None] * vectors.transpose(0, 2, 1)


class Program:
    """minimise |residual(T, B)| / sqrt(2) + costs'B, residual = fields T - shapes B."""

    def __init__(self, mesh, deformer, poses, faces, handles):
        self.poses = poses.astype(float)
        self.faces = faces.astype(int)
        self.deformer = deformer
        self.groups = deformer.edge_groups().astype(int)
        self.size = amrap_support.diagonal(poses[0])
        weights = deformer.weights().astype(float)
        self.atoms = dictionary(weights / weights.sum(axis=0), self.poses / self.size)
        self.roots = triangle_roots(mesh) / numpy.sqrt(3)  # a third for each corner
        self.held = [
            self.atoms[handles.vertices[handles.offsets[h] : handles.offsets[h + 1]]].mean(axis=0)
            for h in range(len(handles))
        ]

    def rows(self, values):
        """[3 corners][F][3]...: fields on the vertices as residual rows, one a corner's share."""
        each = numpy.einsum("fij,fj...->fi...", self.roots, values[self.faces])
        return numpy.stack([each] * 3)

    def shapes(self, rotations, is_global):
        """[rows][3][unknowns]: every exemplar in every group, turned."""
        count, shapes = rotations.shape[:2]
        columns = numpy.zeros((3, len(self.faces), 3, 3, count, shapes))
        for s in range(shapes):
            rows = self.rows(self.poses[s] / self.size)
            for corner in range(3):
                groups = self.groups[self.faces[:, corner]]
                turned = numpy.einsum("fkj,fij->fik", rotations[groups, s], rows[corner])
                columns[corner, numpy.arange(len(groups)), :, :, groups, s] = turned
        columns = columns.reshape(-1, 3, count, shapes)
        return columns.sum(axis=2) if is_global else columns.reshape(len(columns), 3, -1)

    def free_and_fixed(self, targets):
        """Residual rows of the free coefficients, orthonormal, and of what the handles fix."""
        fields = self.rows(self.atoms).reshape(-1, self.atoms.shape[1])
        held = numpy.array(self.held)
        wanted = targets[:, :, 3] / self.size
        fixed = fields @ numpy.linalg.lstsq(held, wanted, rcond=None)[0]
        free = fields @ scipy.linalg.null_space(held)
        left, values, _ = numpy.linalg.svd(free, full_matrices=False)
        return left[:, values > 1e-7 * values[0]], fixed

    def solve(self, targets, rotations, energies, strength, is_global):
        """The optimum, in the units of the mesh."""
        count, shapes = rotations.shape[:2]
        columns = self.shapes(rotations, is_global)
        free, fixed = self.free_and_fixed(targets)
        costs = strength * numpy.sqrt(energies) / self.size
        blocks = 1 if is_global else count
        costs = costs.sum(axis=0) if is_global else costs.ravel()
        rank, unknowns = free.shape[1], len(costs)
        # Unknowns: the free coefficients of x, y and z, then B, then the bound on the root.
        system = numpy.zeros((3 * len(free), 3 * rank + unknowns + 1))
        for k in range(3):
            system[k * len(free) : (k + 1) * len(free), k * rank : (k + 1) * rank] = free
            system[k * len(free) : (k + 1) * len(free), 3 * rank : -1] = -columns[:, k]
        # Only the length of the residual counts: a triangle has the same.
        both = numpy.column_stack([system[:, :-1], fixed.T.ravel()])
        triangle = scipy.linalg.qr(both, mode="r")[0][: both.shape[1]]
        second = numpy.zeros((len(triangle) + 1, 3 * rank + unknowns + 1))
        second[0, -1] = -1
        second[1:, :-1] = -triangle[:, :-1] / numpy.sqrt(2)
        bound = numpy.concatenate([[0], triangle[:, -1] / numpy.sqrt(2)])
        positive = numpy.zeros((unknowns, second.shape[1]))
        positive[:, 3 * rank : -1] = -numpy.eye(unknowns)
        sums = numpy.zeros((blocks, second.shape[1]))
        sums[:, 3 * rank : -1] = numpy.kron(numpy.eye(blocks), numpy.ones(unknowns // blocks))
        found = solvers.conelp(
            matrix(numpy.concatenate([numpy.zeros(3 * rank), costs, [1]])),
            matrix(numpy.concatenate([positive, second])),
            matrix(numpy.concatenate([numpy.zeros(unknowns), bound])),
            {"l": unknowns, "q": [len(second)], "s": []},
            matrix(sums),
            matrix(numpy.ones(blocks)),
            options=TOLERANCES,
        )
        return found["primal objective"] * self.size


class Cone(unittest.TestCase):
    def check(self, poses, faces, handle_count, rounds):
        """A first iteration's objective is the optimum for the rotations it was made with."""
        handles = amrap_support.spread_handles(poses, faces, handle_count)
        mesh = Mesh(poses[0], faces)
        deformer = Amrap(mesh, poses, handles)
        program = Program(mesh, deformer, poses, faces, handles)
        for strength, rotations, blend, s, share, noise in rounds:
            with self.subTest(strength=strength, rotations=rotations, blend=blend, share=share):
                generator = numpy.random.default_rng(s)
                targets = amrap_support.between(deformer, s, (s + 1) % len(poses), share)
                off = generator.uniform(-1, 1, (handle_count, 3))
                targets[:, :, 3] += noise * program.size * off
                settings = AmrapSettings(
                    lambda_=strength, rotations=rotations, blend=blend, iterations=1
                )
                report = deformer.solve(targets, settings)
                optimum = program.solve(
                    targets,
                    deformer.rotations(),
                    deformer.exemplar_energies(),
                    strength,
                    blend == Blend.GLOBAL,
                )
                # Roots are smoothed by 1e-7 of the mesh's size.
                tolerance = 1e-6 * max(optimum, 0.1 * program.size)
                self.assertLess(report.objective, optimum + tolerance)
                self.assertGreater(report.objective, optimum - tolerance)
                self.assertLess(report.objective - optimum, report.optimality_gap + tolerance)

    ROUNDS = [
        (0.5, True, Blend.LOCAL, 0, 0.45, 0.0),
        (0.5, True, Blend.LOCAL, 1, 0.3, 0.05),
        (0.5, True, Blend.GLOBAL, 1, 0.3, 0.05),
        (0.5, False, Blend.LOCAL, 0, 0.45, 0.0),  # E_d vanishes at the optimum
        (0.5, False, Blend.LOCAL, 1, 0.6, 0.05),
        (0.5, False, Blend.GLOBAL, 0, 0.6, 0.02),
        (0.05, False, Blend.LOCAL, 1, 0.6, 0.0),
        (5.0, True, Blend.LOCAL, 0, 0.3, 0.1),
    ]

    def test_tube(self):
        poses, faces = amrap_support.tube_poses()
        self.check(poses[:3], faces, 4, self.ROUNDS)

    def test_tube_of_many_exemplars(self):
        """More than the solver takes at once; uneven ones, so that no atom nearly repeats others:
        which of those count is a matter of tolerances."""
        positions, faces = amrap_support.tube()
        generator = numpy.random.default_rng(1)
        poses = [positions]
        for angle, puff, twist in generator.uniform(-1, 1, (9, 3)) * [1.5, 0.4, 1.5]:
            uneven = generator.uniform(-0.03, 0.03, positions.shape)
            poses.append(amrap_support.bent(positions, angle, puff, twist) + uneven)
        self.check(numpy.array(poses, numpy.float32), faces, 3, self.ROUNDS)

    def check_data(self, name, pose_count, handle_count):
        poses, faces = amrap_support.data(name, pose_count)
        used, faces = numpy.unique(faces[:900], return_inverse=True)  # a part will do
        faces = faces.reshape(-1, 3)
        label = numpy.arange(len(used))
        for _ in range(len(used)):
            lowest = label[faces].min(axis=1)
            before = label.copy()
            numpy.minimum.at(label, faces, lowest[:, None])
            if (label == before).all():
                break
        largest = numpy.bincount(label).argmax()
        faces = faces[label[faces[:, 0]] == largest]
        used, faces = used[numpy.unique(faces)], numpy.unique(faces, return_inverse=True)[1]
        self.check(poses[:, used], faces.reshape(-1, 3), handle_count, self.ROUNDS[:5])

    def test_part_of_the_horse(self):
        self.check_data("horse", 3, 4)

    def test_part_of_the_lion(self):
        self.check_data("lion", 5, 4)


if __name__ == "__main__":
    support.run(globals())
