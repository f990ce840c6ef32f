# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape for the time or for the playhead, and where it is shown."""

import math
from dataclasses import dataclass

import bpy
import numpy

from ...native import ExemplarError
from .. import versions
from . import owners, plane, store

PAUSING_MODES = {"EDIT": "Edit Mode", "SCULPT": "Sculpt Mode"}


@dataclass(frozen=True)
class Inputs:
    """All that the shown shape depends on."""

    edits: int  # of the sequence
    time: float = None  # in frames of the sequence, or
    point: tuple = None  # a place in the plane


def solve(owner, depsgraph=None):
    """float32 [V][3]: what renders and bakes show. Writes nothing."""
    if depsgraph is None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
    state = store.ensure(owner)
    return evaluate(state, read_inputs(owner, state, depsgraph))


def read_inputs(owner, state, depsgraph):
    # Time and playhead can be animated, so the evaluated ones count.
    data = owner.evaluated_get(depsgraph).exemplar_sequence
    if data.follow == "PLAYHEAD":
        return Inputs(state.edits, point=plane.point_of(owner, depsgraph))
    return Inputs(state.edits, time=sequence_time(owner, data.time))


def sequence_time(owner, time):
    """Captured frames are counted as the scene has them, the library's from 0."""
    data = owner.exemplar_sequence
    if not math.isfinite(time):
        raise ExemplarError(f"The time of '{owner.name}' is not a number.")
    return (time - data.first_frame) / data.frame_step


def evaluate(state, inputs):
    if inputs.point is not None:
        return state.sequence.pose(inputs.point)
    return state.sequence.evaluate(inputs.time)


def paused_by(owner):
    return PAUSING_MODES.get(owner.mode, "")


def check(owner, vertex_count):
    """Raise ExemplarError where the mesh cannot show the sequence."""
    mesh = owner.data
    if owner.library is not None:
        raise ExemplarError(
            f"'{owner.name}' is linked and keeps the shape that its file was saved with. Make a "
            "library override of it, and it follows."
        )
    if len(mesh.vertices) != vertex_count:
        raise ExemplarError(
            f"The mesh of '{owner.name}' has {len(mesh.vertices)} vertices and its sequence "
            f"{vertex_count}: undo what was done to the mesh, or capture again."
        )
    if mesh.shape_keys is not None and not _is_baked(mesh):
        raise ExemplarError(
            f"'{owner.name}' has shape keys, which hide what the sequence shows. Remove them; a "
            "shape is added to the animation by New Shape Here."
        )
    for other in owners.every():
        if other != owner and other.data == mesh and other.name < owner.name:
            raise ExemplarError(
                f"'{owner.name}' has the same mesh as '{other.name}'. Make the mesh a single user."
            )


def _is_baked(mesh):
    return "exemplar_baked" in mesh.shape_keys


def show(owner, positions):
    check(owner, len(positions))
    mesh = _own_mesh(owner)
    versions.set_mesh_positions(mesh, numpy.ascontiguousarray(positions))
    mesh.update()


def _own_mesh(owner):
    """Under a library override the mesh is still the library's, and other files' too."""
    if owner.data.library is not None and owner.library is None:
        owner.data = owner.data.copy()
    return owner.data
