# SPDX-License-Identifier: GPL-3.0-or-later
"""The animation on another character, by poses that both have as shape keys of one name."""

import bpy
import numpy

from ...native import ExemplarError, Mesh, ShapeSpace
from .. import meshes, versions
from . import retiming, setup, store, syncing

FEWEST = 2  # pairs, the reference among them


def pairs(examples, target):
    """Names of the shape keys that both objects have; the reference first."""
    if examples.data.shape_keys is None or target.data.shape_keys is None:
        return []
    ours, theirs = examples.data.shape_keys, target.data.shape_keys
    names = [
        key.name
        for key in ours.key_blocks
        if key != ours.reference_key
        and key.name in theirs.key_blocks
        and theirs.key_blocks[key.name] != theirs.reference_key
        and key.name != examples.exemplar.result_key
    ]
    return [ours.reference_key.name, *names]


def refuse(owner, examples, target):
    """Raise what stands in the way."""
    if examples is None or target is None:
        raise ExemplarError("Choose the mesh with the matching poses, and the other character.")
    count = store.ensure(owner).sequence.info.vertex_count
    if len(examples.data.vertices) != count:
        raise ExemplarError(
            f"'{examples.name}' has {len(examples.data.vertices)} vertices and the captured mesh "
            f"{count}: the poses have to be those of the captured mesh."
        )
    if target == owner:
        raise ExemplarError("The other character is the sequence itself.")
    if not len(target.data.polygons):
        raise ExemplarError(f"'{target.name}' has no faces.")
    matched = pairs(examples, target)
    if len(matched) < FEWEST:
        raise ExemplarError(
            f"'{examples.name}' and '{target.name}' have no shape keys of one name. Give the same "
            "pose the same name on both."
        )


def build(owner, examples, target, shape_space):
    """The native part, as a function that a thread can run; returns (sequence, names)."""
    refuse(owner, examples, target)
    names = pairs(examples, target)
    source = store.ensure(owner).sequence
    ours = _shapes(examples, names[1:])
    theirs = _shapes(target, names[1:])
    triangles = meshes.triangles(target.data)

    def work(_report):
        with Mesh(theirs[0], triangles) as mesh:
            try:
                made = source.transfer(ours, mesh, theirs, ShapeSpace[shape_space])
            except ExemplarError as error:
                raise ExemplarError(f"The animation cannot be transferred: {error}.") from error
        return made, names

    return work


def _shapes(obj, names):
    """float32 [n][V][3], the reference first."""
    keys = obj.data.shape_keys
    blocks = [keys.reference_key, *(keys.key_blocks[name] for name in names)]
    return numpy.stack([versions.get_key_positions(block) for block in blocks])


def commit(owner, target, sequence, names, scene):
    """An object of the other character that shows the animation, with its time. Returns it."""
    mesh = target.data.copy()
    mesh.name = f"{target.name} Sequence"
    made = bpy.data.objects.new(mesh.name, mesh)
    made.matrix_world = target.matrix_world
    setup.collection_of(target, scene).objects.link(made)
    made.shape_key_clear()
    for group in target.vertex_groups:
        made.vertex_groups.new(name=group.name)
    ours, data = owner.exemplar_sequence, made.exemplar_sequence
    setup.make_sequence(made, sequence, None, scene)
    data.summary = f"the animation of '{owner.name}' by {len(names)} matched poses"
    data.source = None
    data.first_frame, data.frame_step, data.fps = ours.first_frame, ours.frame_step, ours.fps
    retiming.copy(owner, made)
    state = store.ensure(made)
    syncing.keep_fitted(store.text_of(made), sequence.control_points())
    store.keep(made, state)
    setup.hide(target)
    setup.show(made)
    return made
