# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit needs of Blender, as arrays in the mesh's own space."""

from dataclasses import dataclass, replace
from typing import Any

import numpy

from ...native import ExemplarError, ScanFitSettings
from .. import exemplars, meshes, versions
from .. import inputs as bind_inputs
from . import landmarks

FEWEST_LANDMARKS = 3


@dataclass(frozen=True)
class Shape:
    """The mesh and its exemplars."""

    reference: numpy.ndarray  # float32 [V][3]
    triangles: numpy.ndarray  # uint32 [F][3]
    exemplars: numpy.ndarray  # float32 [S][V][3]

    def digest(self):
        return meshes.digest(self.reference, self.triangles, self.exemplars)


@dataclass(frozen=True)
class ScanFrame:
    """The scan and its landmarks on one frame."""

    points: numpy.ndarray  # float32 [P][3]
    triangles: numpy.ndarray  # uint32 [F][3]
    vertices: numpy.ndarray  # uint32 [n] of the mesh
    landmarks: numpy.ndarray  # float64 [n][3]


@dataclass(frozen=True)
class Gathered:
    shape: Shape
    scan: ScanFrame
    settings: ScanFitSettings
    world: Any  # numpy [4][4]: from the mesh's space, for what is drawn meanwhile


def gather(obj, depsgraph):
    scan_object(obj)
    frame = scan_frame(obj, depsgraph)
    refuse_few(frame)
    world = numpy.array(obj.evaluated_get(depsgraph).matrix_world)
    return Gathered(shape(obj), frame, settings(obj), world)


def refuse_few(frame):
    count = len(frame.vertices)
    if count < FEWEST_LANDMARKS:
        there = "There is one" if count == 1 else f"There are {count or 'none'}"
        raise ExemplarError(
            f"A fit needs {FEWEST_LANDMARKS} landmarks or more. {there}: pick points that you know "
            "on the mesh and on the scan."
        )


def scan_object(obj):
    """The scan, or ExemplarError."""
    scan = obj.exemplar_fit.scan
    if scan is None:
        raise ExemplarError("Choose the scan to fit to.")
    if scan == obj:
        raise ExemplarError(f"'{obj.name}' cannot be its own scan. Choose another object.")
    if scan.type != "MESH":
        raise ExemplarError(f"'{scan.name}' is not a mesh.")
    for each in (obj, scan):
        if each.mode == "EDIT":
            raise ExemplarError(f"'{each.name}' is in Edit Mode. Leave it first.")
    return scan


def exemplar_names(obj):
    """The exemplars that are switched on, without what a fit has made of them."""
    return [name for name in exemplars.enabled_names(obj) if name != obj.exemplar_fit.last_key]


def shape(obj):
    reference = meshes.reference_positions(obj)
    bind_inputs.check_finite(meshes.reference_name(obj), reference)
    triangles = meshes.triangles(obj.data)
    if not len(triangles):
        raise ExemplarError(f"'{obj.name}' has no faces.")
    poses = []
    for index, name in enumerate(exemplar_names(obj)):
        key = obj.data.shape_keys.key_blocks[name]
        bind_inputs.check_size(obj, key, index)
        poses.append(versions.get_key_positions(key))
        bind_inputs.check_finite(f"Shape key '{name}'", poses[-1], index)
    return Shape(reference, triangles, numpy.array(poses or [reference], numpy.float32))


def scan_frame(obj, depsgraph):
    """The scan as the depsgraph has it, with its modifiers."""
    scan = obj.exemplar_fit.scan
    evaluated = scan.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or not len(mesh.vertices):
            raise ExemplarError(f"The scan '{scan.name}' is empty.")
        points = versions.get_mesh_positions(mesh)
        triangles = meshes.triangles(mesh)
    finally:
        evaluated.to_mesh_clear()
    bind_inputs.check_finite(f"The scan '{scan.name}'", points)
    matrix = numpy.linalg.inv(numpy.array(obj.evaluated_get(depsgraph).matrix_world))
    matrix = matrix @ numpy.array(evaluated.matrix_world)
    points = points.astype(numpy.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    if numpy.linalg.det(matrix[:3, :3]) < 0:
        triangles = triangles[:, ::-1]  # a mirrored object shows its faces the other way round
    vertices, places = landmarks.arrays(obj, depsgraph)
    return ScanFrame(
        numpy.ascontiguousarray(points, numpy.float32),
        numpy.ascontiguousarray(triangles),
        vertices,
        places,
    )


def with_landmarks(frame, kept):
    """The same scan with some of its landmarks, bool [n]; fewer than a fit can use are none."""
    if numpy.count_nonzero(kept) < FEWEST_LANDMARKS:
        kept = numpy.zeros_like(kept)
    return replace(frame, vertices=frame.vertices[kept], landmarks=frame.landmarks[kept])


def settings(obj):
    own = obj.exemplar_fit
    return ScanFitSettings(
        scale=own.find_scale,
        finish=own.finish,
        detail=own.detail,
        reach=own.reach / 100,
        disc_radius=own.disc_radius / 100,
    )
