# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of an animated object, whatever moves it: what is captured is the evaluated mesh."""

from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy

from ...native import ExemplarError, Mesh, Sequence, ShapeSpace
from .. import meshes, versions
from ..baking.errors import SettingsError
from ..baking.frames import frame_numbers, walk

TYPES = ("MESH", "CURVE", "SURFACE", "META", "FONT")
FEWEST = 3  # frames


@dataclass(frozen=True)
class FitSettings:
    shape_space: str = "POSITIONS"
    control_points: int = 0  # 0: by the tolerance
    poses: int = 0
    shapes: int = 0
    tolerance: float = 1e-3  # a share of the mesh's diagonal
    cyclic: bool = False


@dataclass(frozen=True)
class Range:
    start: int
    end: int
    step: int = 1
    use_world_space: bool = False


@dataclass
class Captured:
    """A native sequence with its frames, not fitted yet. Whoever has it closes it."""

    sequence: Sequence
    numbers: Any  # range of frames
    use_world_space: bool = False


def fit_settings(options):
    """FitSettings from the properties of FitOptions."""
    settings = {"shape_space": options.shape_space, "cyclic": options.cyclic}
    if options.fidelity == "COUNTS":
        settings["control_points"] = options.control_points
        settings["poses"] = options.poses
        settings["shapes"] = options.shapes
    elif options.fidelity == "EXACT":
        # Counts above their upper limits mean these.
        everything = 2**31 - 1
        settings.update(control_points=everything, poses=everything, shapes=everything)
    else:
        settings["tolerance"] = options.tolerance / 100.0
    return FitSettings(**settings)


def frames(obj, scene, view_layer, settings, shape_space):
    """A generator of (fraction, stage) that returns Captured. The scene goes back to its frame."""
    numbers = _numbers(settings)
    refuse(obj)
    sequence, first = None, None
    try:
        with closing(walk(scene, numbers)) as walked:
            for done, number in enumerate(walked, start=1):
                frame = _read(obj, view_layer.depsgraph, number, settings.use_world_space)
                if sequence is None:
                    first = frame
                    sequence = _start(obj, frame, shape_space)
                _check_connectivity(first, frame)
                sequence.add_frame(frame.positions)
                yield done / len(numbers), f"frame {number}"
    except BaseException:
        if sequence is not None:
            sequence.close()
        raise
    return Captured(sequence, numbers, settings.use_world_space)


def refuse(obj):
    if obj.type not in TYPES:
        raise SettingsError(f"'{obj.name}' has no surface to capture.")
    if obj.mode != "OBJECT":
        raise SettingsError(f"'{obj.name}' is being edited. Go to Object Mode to capture it.")


def _numbers(settings):
    numbers = frame_numbers(settings.start, settings.end, settings.step)
    if len(numbers) < FEWEST:
        there = "is one" if len(numbers) == 1 else f"are {len(numbers)}"
        raise SettingsError(
            f"A sequence needs {FEWEST} frames or more. From {settings.start} to {settings.end}"
            f"{f' in steps of {settings.step}' if settings.step > 1 else ''} there {there}."
        )
    return numbers


# ----------------------------------------------------------------------------------------- a frame


@dataclass
class _Frame:
    number: int
    positions: Any  # float32 [V][3]
    face_count: int
    topology: str
    triangles: Any = None  # of the first frame alone would do; cheap to ask for


def _read(obj, depsgraph, number, use_world_space):
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    if mesh is None or not len(mesh.polygons):
        count = 0 if mesh is None else len(mesh.vertices)
        evaluated.to_mesh_clear()
        raise ExemplarError(
            f"'{obj.name}' has no faces on frame {number} ({count} vertices): "
            "there is no surface to capture."
        )
    try:
        positions = versions.get_mesh_positions(mesh)
        if use_world_space:
            positions = to_world(evaluated.matrix_world, positions)
        _check_finite(obj, positions, number)
        return _Frame(
            number,
            positions,
            len(mesh.polygons),
            meshes.topology_digest(mesh),
            meshes.triangles(mesh),
        )
    finally:
        evaluated.to_mesh_clear()


def to_world(matrix, positions):
    """float32 [V][3]"""
    matrix = numpy.array(matrix)
    moved = positions.astype(numpy.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return numpy.ascontiguousarray(moved, numpy.float32)


def _check_finite(obj, positions, number):
    wrong = numpy.flatnonzero(~numpy.isfinite(positions).all(axis=1))
    if len(wrong):
        raise ExemplarError(
            f"Vertex {wrong[0]} of '{obj.name}' is nowhere on frame {number}: its coordinates are "
            "not numbers. Look at the modifiers, or at the cache that is played.",
            vertices=wrong,
        )


def _check_connectivity(first, frame):
    if frame.topology == first.topology:
        return
    now = (len(frame.positions), frame.face_count)
    before = (len(first.positions), first.face_count)
    if now == before:
        change = "the faces have other corners"
    else:
        change = f"{_size(*before)} became {_size(*now)}"
    raise ExemplarError(
        f"The mesh changes on frame {frame.number}: {change} since frame {first.number}. "
        f"A sequence keeps its faces: capture up to frame {frame.number - 1}, or switch off the "
        "modifier that makes new ones."
    )


def _size(vertices, faces):
    return f"{vertices} vertices and {faces} faces"


def _start(obj, frame, shape_space):
    with Mesh(frame.positions, frame.triangles) as mesh:
        return Sequence(mesh, ShapeSpace[shape_space])


# ------------------------------------------------------------------------------------------ the fit


def fit(sequence, settings, progress=None, pins=None):
    """Fit a captured sequence; sees no Blender data, and may run in a thread."""
    try:
        return sequence.fit(
            control_point_count=settings.control_points,
            site_count=settings.poses,
            component_count=settings.shapes,
            tolerance=settings.tolerance,
            cyclic=settings.cyclic,
            pins=pins,
            progress=progress,
        )
    except ExemplarError as error:
        if error.cancelled:
            raise
        raise ExemplarError(
            f"No sequence was made: {error}.", error.status, error.element, error.index
        ) from error
