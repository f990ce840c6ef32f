# SPDX-License-Identifier: GPL-3.0-or-later
"""Bodies that bend, and scans of them, for the tests of registration."""

import sys

import numpy

import support

sys.path.insert(0, str(support.ROOT / "blender_addon"))

import native  # noqa: E402


def tube(around=20, along=60, radius=0.5, length=8.0):
    """A closed tube along x with bumps, so that no turn about its axis looks like another."""
    angles = numpy.linspace(0, 2 * numpy.pi, around, endpoint=False)
    rows = [(0.0, 0.02)] + [(x, 1.0) for x in numpy.linspace(0, length, along)] + [(length, 0.02)]
    points = []
    for x, share in rows:
        bump = 1 + 0.3 * numpy.cos(angles) * numpy.exp(-((x - 0.3 * length) ** 2))
        bump = bump + 0.4 * numpy.sin(angles) * numpy.exp(-((x - 0.8 * length) ** 2))
        ring = radius * share * bump
        ys, zs = ring * numpy.cos(angles), ring * numpy.sin(angles)
        points.append(numpy.stack([numpy.full(around, x), ys, zs], 1))
    faces = []
    for r in range(len(rows) - 1):
        for a in range(around):
            b = (a + 1) % around
            i, j = r * around, (r + 1) * around
            faces += [(i + a, j + b, j + a), (i + a, i + b, j + b)]
    for first, turn in ((0, 1), ((len(rows) - 1) * around, -1)):
        for a in range(1, around - 1):
            faces.append((first, first + a + 1, first + a)[::turn])
    return numpy.concatenate(points).astype(numpy.float32), numpy.array(faces, numpy.uint32)


def bent(points, angle, twist=0.0):
    """Bent along an arc in the plane xy, isometrically along its axis; twisted about it."""
    x, y, z = points.astype(float).T
    length = x.max()
    turn = twist * x / length
    y, z = numpy.cos(turn) * y - numpy.sin(turn) * z, numpy.sin(turn) * y + numpy.cos(turn) * z
    if abs(angle) < 1e-9:
        return numpy.stack([x, y, z], 1).astype(numpy.float32)
    radius, at = length / angle, angle * x / length
    bent_x = (radius - y) * numpy.sin(at)
    bent_y = radius - (radius - y) * numpy.cos(at)
    return numpy.stack([bent_x, bent_y, z], 1).astype(numpy.float32)


def area(points, faces):
    corners = points.astype(float)[faces]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return numpy.linalg.norm(normals, axis=1).sum() / 2


def moved(points, angle=0.8, scale=1.0, shift=(3.0, -2.0, 5.0)):
    """Turned about a slanted axis, scaled and moved."""
    axis = numpy.array([1.0, 2.0, -0.5])
    axis /= numpy.linalg.norm(axis)
    cross = numpy.cross(numpy.eye(3), -axis)
    turn = numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross
    return (scale * points.astype(float) @ turn.T + shift).astype(numpy.float32)


def cut(points, faces, keep):
    """The part of a mesh whose vertices are in the mask `keep`: points, faces, old numbers."""
    faces = faces[keep[faces].all(1)]
    used = numpy.unique(faces)
    new = numpy.zeros(len(points), numpy.uint32)
    new[used] = numpy.arange(len(used))
    return points[used], new[faces], used


class Body:
    """A tube, its exemplars and their registration."""

    def __init__(self, **binding):
        self.rest, self.faces = tube()
        self.size = numpy.sqrt(area(self.rest, self.faces))
        self.exemplars = numpy.stack(
            [bent(self.rest, angle) for angle in (0, 1.2, -1.2)] + [bent(self.rest, 0.3, 1.0)]
        )
        self.landmarks = [5, 240, 490, 731, 982, 1225]
        self.mesh = native.Mesh(self.rest, self.faces)
        self.registration = native.Registration(
            self.mesh, self.exemplars, native.BlendedBinding(**binding)
        )

    def fit(self, pose, scan, **settings):
        """Fit to a scan of `pose` by its landmarks: the report and the distances by vertex, as
        shares of the pose's size."""
        report = self.registration.fit(
            scan,
            self.landmarks,
            pose[self.landmarks].astype(float),
            native.ScanFitSettings(**settings),
        )
        distances = numpy.linalg.norm(self.registration.positions() - pose, axis=1)
        return report, distances / numpy.sqrt(area(pose, self.faces))


def farthest(points, count):
    """Indices of points spread by taking the farthest from those taken, the first to begin with."""
    taken = [0]
    distances = numpy.linalg.norm(points - points[0], axis=1)
    while len(taken) < count:
        taken.append(int(distances.argmax()))
        distances = numpy.minimum(distances, numpy.linalg.norm(points - points[taken[-1]], axis=1))
    return numpy.array(taken)
