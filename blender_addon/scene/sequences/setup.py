# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects of a sequence: made from a capture, fitted anew, taken away."""

import bpy
import numpy

from ...native import ExemplarError
from .. import follow, setup as rig_setup, versions
from . import live, owners, packing, plane, retiming, store, syncing

DRIVEN = "exemplar_sequence.follow_driver"


def commit(source, captured, report, scene, hide_source=True):
    """A fitted capture becomes an object that shows it, with its pose space. Returns the object."""
    captured.sequence.drop_frames()
    owner = _new_owner(source, captured, scene)
    collection_of(source, scene).objects.link(owner)
    make_sequence(owner, captured.sequence, report, scene)
    data = owner.exemplar_sequence
    numbers = captured.numbers
    data.source = source
    data.first_frame, data.frame_step = numbers.start, numbers.step
    retiming.play_as_captured(owner, numbers.start, numbers[-1])
    if hide_source:
        hide(source)
    show(owner)
    return owner


def make_sequence(owner, sequence, report, scene):
    """Pack a fitted sequence, and make its pose space, for an object whose mesh can show it."""
    data = owner.exemplar_sequence
    about = words(report, sequence.info) if report else f"{sequence.info.frame_count} frames"
    data.data = packing.create(f"{owner.name} Sequence", packing.dump(sequence), about)
    syncing.keep_fitted(data.data, sequence.control_points())
    data.summary = about
    data.fps = retiming.scene_frame_rate(scene)
    data.is_sequence = True
    owners.forget()
    state = store.adopt(data.data, sequence)
    marks, pinned = sequence.marks()
    plane.create(owner, sequence.control_points(), marks, pinned, sequence.info.cyclic)
    state.curve = numpy.float32(sequence.control_points())
    state.marks = numpy.float32(marks)
    follow.follow(owner, [data.plane, data.playhead], DRIVEN)
    rig_setup.lock_interface(owner)
    return state


def refit(owner, captured, report):
    """Another fit of the same frames in the place of the old one. Time's curve stays."""
    data = owner.exemplar_sequence
    sequence = captured.sequence
    if sequence.info.vertex_count != len(owner.data.vertices):
        raise ExemplarError(
            f"'{data.source.name}' has {sequence.info.vertex_count} vertices now and "
            f"'{owner.name}' {len(owner.data.vertices)}: capture it as a new sequence."
        )
    sequence.drop_frames()
    about = words(report, sequence.info)
    packing.replace(data.data, packing.dump(sequence), about)
    syncing.keep_fitted(data.data, sequence.control_points())
    data.summary = about
    data.first_frame, data.frame_step = captured.numbers.start, captured.numbers.step
    state = store.adopt(data.data, sequence)
    if syncing.plane_is_whole(owner):
        _leave_edit_mode(owner)
        syncing.redraw(owner, state)
    else:
        make_plane(owner, state)
    show(owner)


def make_plane(owner, state):
    """The pose space anew, where parts of it were deleted."""
    data = owner.exemplar_sequence
    _remove_plane(owner)
    sequence = state.sequence
    marks, pinned = sequence.marks()
    plane.create(owner, sequence.control_points(), marks, pinned, sequence.info.cyclic)
    state.curve = numpy.float32(sequence.control_points())
    state.marks = numpy.float32(marks)
    follow.follow(owner, [data.plane, data.playhead], DRIVEN)
    owners.forget()


def show(owner):
    bpy.context.view_layer.update()
    live.update(owner)


def hide(source):
    """The sequence takes the place of what was captured."""
    source.hide_render = True
    for view_layer in bpy.context.scene.view_layers:
        if source.name in view_layer.objects:
            source.hide_set(True, view_layer=view_layer)


def words(report, info):
    poses = f"{info.frame_count} frames: {report.control_point_count} control points"
    return (
        f"{poses}, {report.site_count} poses, {report.component_count} shapes; "
        f"off by {report.error:.3%} of the mesh's size on average"
    )


def _leave_edit_mode(owner):
    data = owner.exemplar_sequence
    if any(part.mode == "EDIT" for part in (data.curve, data.marks)):
        raise ExemplarError("The pose space is in Edit Mode. Leave it to fit again.")


def _new_owner(source, captured, scene):
    """A copy of the evaluated mesh at the first frame, with its materials and all its layers, and
    nothing that would move it."""
    current, subframe = scene.frame_current, scene.frame_subframe
    scene.frame_set(captured.numbers.start)
    try:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        evaluated = source.evaluated_get(depsgraph)
        mesh = bpy.data.meshes.new_from_object(
            evaluated, preserve_all_data_layers=True, depsgraph=depsgraph
        )
        matrix = evaluated.matrix_world.copy()
    finally:
        scene.frame_set(current, subframe=subframe)
    if mesh is None or len(mesh.vertices) != captured.sequence.info.vertex_count:
        if mesh is not None:
            bpy.data.meshes.remove(mesh)
        raise ExemplarError(f"'{source.name}' has changed while it was captured. Capture it again.")
    mesh.name = f"{source.name} Sequence"
    owner = bpy.data.objects.new(mesh.name, mesh)
    if not captured.use_world_space:
        owner.matrix_world = matrix
    return owner


def collection_of(source, scene):
    found = [c for c in source.users_collection if c.library is None]
    return found[0] if found else scene.collection


def positions_of(owner):
    """The mesh as it is, float32 [V][3], also while it is sculpted or edited."""
    if owner.mode == "EDIT":
        owner.update_from_editmode()
    return versions.get_mesh_positions(owner.data)


def remove(owner):
    """Take the sequence away, and leave an ordinary mesh."""
    data = owner.exemplar_sequence
    follow.unfollow(owner, DRIVEN)
    curve = retiming.curve_of(owner)
    if curve is not None:
        versions.find_curves(owner).remove(curve)
    source, text = data.source, data.data
    if not _is_shared(owner):
        _remove_plane(owner)
        if text is not None and text.library is None:
            bpy.data.texts.remove(text)
    owner.property_unset("exemplar_sequence")
    owners.forget()
    store.prune()
    if source is not None and source.library is None:
        source.hide_render = False
        for view_layer in bpy.context.scene.view_layers:
            if source.name in view_layer.objects:
                source.hide_set(False, view_layer=view_layer)


def _is_shared(owner):
    """Copies of an object show one sequence."""
    text = owner.exemplar_sequence.data
    return any(other != owner and other.exemplar_sequence.data == text for other in owners.every())


def _remove_plane(owner):
    collections = set()
    for part in owners.parts(owner):
        collections.update(part.users_collection)
        old = part.data
        bpy.data.objects.remove(part)
        if old is not None and not old.users:
            bpy.data.meshes.remove(old)
    for collection in collections:
        if not collection.all_objects and not collection.children:
            bpy.data.collections.remove(collection)


def evaluated_positions(obj, depsgraph):
    """The mesh of another object as its deformers have it, float32 [V][3]."""
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        return versions.get_mesh_positions(mesh)
    finally:
        evaluated.to_mesh_clear()
