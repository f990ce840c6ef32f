# SPDX-License-Identifier: GPL-3.0-or-later
"""A body with five limbs, and scans of it whose faces are others: for the tests of Fit to Scan."""

import addon_support
import bmesh
import bpy
import numpy
from mathutils import Matrix

# Limbs: where they point, how long they are, what they turn about. No two are alike.
LIMBS = (
    ((1, 0.1, 0.2), 1.5, (0, 0, 1)),
    ((-0.9, 0.4, 0.1), 1.1, (0, 1, 0)),
    ((0.1, 1, 0.3), 0.9, (1, 0, 0)),
    ((0, -0.9, 0.5), 1.3, (1, 0, 0)),
    ((0.2, 0.1, -1), 1.0, (0, 1, 0)),
)
LIMB_COUNT = len(LIMBS)
PLACE = Matrix.Translation((4, 1, -2)) @ Matrix.Rotation(0.7, 4, (1, 2, 3))


def unit(vector):
    return numpy.asarray(vector) / numpy.linalg.norm(vector)


def body(directions, angles):
    """Positions of the surface in unit directions [n][3], limb k turned by angles[k]."""
    radius = numpy.full(len(directions), 0.6)
    rest = None
    for way, length, _ in LIMBS:
        radius += length * numpy.exp(8 * (directions @ unit(way) - 1))
    rest = directions * radius[:, None]
    posed = rest.copy()
    for (way, length, axis), angle in zip(LIMBS, angles):
        share = numpy.exp(3 * (directions @ unit(way) - 1)) * angle
        axis = unit(axis)
        cos, sin = numpy.cos(share)[:, None], numpy.sin(share)[:, None]
        along = (posed @ axis)[:, None] * axis
        posed = along + cos * (posed - along) + sin * numpy.cross(axis, posed)
    return posed


def sphere(subdivisions, turn=0.0):
    """Unit directions and faces of an icosphere."""
    made = bmesh.new()
    bmesh.ops.create_icosphere(
        made, subdivisions=subdivisions, radius=1.0, matrix=Matrix.Rotation(turn, 4, (1, 2, 0.5))
    )
    directions = numpy.array([vertex.co.normalized() for vertex in made.verts])
    faces = [[vertex.index for vertex in face.verts] for face in made.faces]
    made.free()
    return directions, faces


def pose_angles(seed):
    return numpy.random.default_rng(seed).uniform(-0.6, 0.6, LIMB_COUNT)


TRUTH = 0.5 * (pose_angles(1) + pose_angles(2))


def make_body():
    """The mesh object, with four poses."""
    directions, faces = sphere(5)
    rest = body(directions, numpy.zeros(LIMB_COUNT))
    poses = {
        f"Pose {seed}": lambda _, seed=seed: body(directions, pose_angles(seed))
        for seed in (1, 2, 3, 4)
    }
    return addon_support.make_mesh("Body", rest, faces, poses)


def make_scan(name, angles, scale=1.0):
    """Of other faces, elsewhere, with a hole."""
    directions, faces = sphere(5, turn=0.37)
    faces = [face for face in faces if directions[face[0]] @ unit((-1, -1, -0.2)) < 0.6]
    scan = addon_support.make_mesh(name, scale * body(directions, angles), faces, {})
    scan.matrix_world = PLACE
    bpy.context.view_layer.update()
    return scan
