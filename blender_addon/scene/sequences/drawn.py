# SPDX-License-Identifier: GPL-3.0-or-later
"""Animation from nothing: poses in a plane, and a curve through it [Cashman and Hormann, 4.4].

Also what else an artist adds to a pose space: loops, and shapes of their own.
"""

import bpy
import numpy

from ...native import ExemplarError, Mesh, Sequence, ShapeSpace
from .. import meshes, versions
from . import plane, retiming, setup, store, syncing

FEWEST = 3  # shape keys
# Of a new shape to another mark, as a share of the plane's extent.
NEAREST = 1e-3


def from_keys(obj, names, settings, frame_count, scene):
    """An object with a pose space of `obj`'s shape keys, and an animation through them in their
    order. Returns the object."""
    poses = _poses(obj, names)
    triangles = meshes.triangles(obj.data)
    if not len(triangles):
        raise ExemplarError(f"'{obj.name}' has no faces.")
    with Mesh(poses[0], triangles) as mesh:
        sequence = Sequence(mesh, ShapeSpace[settings.shape_space])
    try:
        for pose in poses:
            sequence.add_frame(pose)
        # Few poses, and every one of them was meant: all are kept exactly.
        report = sequence.fit(
            control_point_count=2**31 - 1,
            site_count=2**31 - 1,
            component_count=2**31 - 1,
            cyclic=settings.cyclic,
        )
        sequence.drop_frames()
        sequence.draw(sequence.control_points(), frame_count)
    except ExemplarError as error:
        sequence.close()
        raise ExemplarError(f"No sequence was made: {error}.") from error
    owner = _new_owner(obj, poses[0], scene)
    setup.make_sequence(owner, sequence, report, scene)
    data = owner.exemplar_sequence
    data.data[syncing.DRAWN] = 1
    data.source = obj
    data.summary = f"{len(poses)} poses of '{obj.name}', {frame_count} frames"
    _play(owner, scene.frame_start, frame_count)
    setup.hide(obj)
    setup.show(owner)
    return owner


def _poses(obj, names):
    blocks = obj.data.shape_keys.key_blocks if obj.data.shape_keys else {}
    missing = [name for name in names if name not in blocks]
    if missing:
        raise ExemplarError(f"'{obj.name}' has no shape key '{missing[0]}'.")
    if len(names) < FEWEST:
        raise ExemplarError(
            f"'{obj.name}' has {len(names)} shape keys to place; a pose space needs {FEWEST}."
        )
    return [versions.get_key_positions(blocks[name]) for name in names]


def _new_owner(obj, positions, scene):
    mesh = obj.data.copy()
    mesh.name = f"{obj.name} Sequence"
    owner = bpy.data.objects.new(mesh.name, mesh)
    owner.matrix_world = obj.matrix_world
    setup.collection_of(obj, scene).objects.link(owner)
    owner.shape_key_clear()
    versions.set_mesh_positions(mesh, numpy.ascontiguousarray(positions))
    for group in obj.vertex_groups:
        owner.vertex_groups.new(name=group.name)
    mesh.update()
    return owner


def _play(owner, start, frame_count):
    data = owner.exemplar_sequence
    data.first_frame, data.frame_step = start, 1.0
    retiming.play_as_captured(owner, start, start + frame_count - 1)


# ----------------------------------------------------------------------------------------- drawing


def draw(owner, curve, frame_count, control_point_count, context):
    """Make the control polygon, or the curve object `curve`, the way of the animation."""
    state = store.ensure(owner)
    cyclic = state.sequence.info.cyclic
    if curve is None:
        points = plane.read_curve(owner.exemplar_sequence.curve, cyclic).astype(float)
    else:
        points = _along(owner, curve, control_point_count, context.evaluated_depsgraph_get())
    try:
        state.sequence.draw(points, frame_count)
    except ExemplarError as error:
        raise ExemplarError(f"The curve cannot be animated along: {error}.") from error
    syncing.show_curve(owner, state)
    store.text_of(owner)[syncing.DRAWN] = 1
    _play(owner, owner.exemplar_sequence.first_frame, frame_count)
    store.keep(owner, state)


def _along(owner, curve, count, depsgraph):
    """Points at even distances along a curve object, in the plane: float64 [count][2]."""
    evaluated = curve.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        places = versions.get_mesh_positions(mesh).astype(float)
        edges = meshes.edges(mesh)
    finally:
        evaluated.to_mesh_clear()
    if len(places) < 2 or len(edges) != len(places) - 1:
        raise ExemplarError(
            f"'{curve.name}' is not one open line: draw one stroke, without depth or bevel."
        )
    plane.check(owner.exemplar_sequence.plane, "The plane")
    to_plane = (
        owner.exemplar_sequence.plane.evaluated_get(depsgraph).matrix_world.inverted()
        @ evaluated.matrix_world
    )
    matrix = numpy.array(to_plane)
    flat = (places @ matrix[:3, :3].T + matrix[:3, 3])[:, :2]
    along = numpy.concatenate(
        [[0.0], numpy.cumsum(numpy.linalg.norm(numpy.diff(flat, axis=0), axis=1))]
    )
    if along[-1] <= 0:
        raise ExemplarError(f"'{curve.name}' has no length in the plane.")
    at = numpy.linspace(0.0, along[-1], count)
    return numpy.column_stack([numpy.interp(at, along, flat[:, axis]) for axis in (0, 1)])


def loop(owner, start, end, count):
    """Play the stretch between two captured frames `count` times more. Returns how many frames
    came to it."""
    state = store.ensure(owner)
    data = owner.exemplar_sequence
    before = state.sequence.info.frame_count
    end_of_all = data.first_frame + data.frame_step * (before - 1)
    if not data.first_frame <= start < end <= end_of_all:
        raise ExemplarError(
            f"No loop from {start:g} to {end:g}: it has to begin before it ends, within frames "
            f"{data.first_frame:g} to {end_of_all:g}."
        )
    first, last = ((frame - data.first_frame) / data.frame_step for frame in (start, end))
    try:
        state.sequence.loop(first, last, count)
    except ExemplarError as error:
        raise ExemplarError(f"No loop from {start:g} to {end:g}: {error}.") from error
    added = state.sequence.info.frame_count - before
    syncing.show_curve(owner, state)
    store.keep(owner, state)
    retiming.make_room(owner, end, added * data.frame_step)
    return added


# ------------------------------------------------------------------------------------------- shapes


def _check_free(marks, point):
    """A place has one shape, and two places side by side would tear the shapes between them."""
    distances = numpy.linalg.norm(marks - numpy.asarray(point, numpy.float32), axis=1)
    nearest = int(distances.argmin())
    if distances[nearest] < NEAREST * plane.extent(marks):
        raise ExemplarError(
            f"The playhead is on mark {nearest}, which has a shape already. Move it away, to where "
            "the new shape is to be."
        )


def add_shape(owner, positions, point):
    """Put a shape into the pose space, at a place in the plane."""
    state = store.ensure(owner)
    if len(positions) != state.sequence.info.vertex_count:
        raise ExemplarError(
            f"The shape has {len(positions)} vertices, the sequence "
            f"{state.sequence.info.vertex_count}."
        )
    marks, pinned = plane.read_marks(
        owner.exemplar_sequence.marks, state.sequence.window().fitted_frame_count
    )
    _check_free(marks, point)
    try:
        state.sequence.add_pose(positions, point)
    except ExemplarError as error:
        raise ExemplarError(f"The shape cannot be put there: {error}.") from error
    syncing.show_marks(owner, state, numpy.append(pinned, True))
    store.keep(owner, state)
