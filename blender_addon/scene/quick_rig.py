# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles by themselves: proposed from the exemplars, or mirrored from those that are there."""

import bpy
import numpy
from mathutils.kdtree import KDTree

from ..native import ExemplarError
from . import exemplars, handle_editing, meshes, proposals, versions

NAMES = {"ROOT": "Root", "TIP": "Tip", "JOINT": "Joint"}
# Shares of the mesh's size: what counts as the middle, and how well a mirror image has to fit.
MIDDLE = 0.01
MISFIT = 0.02


def propose(obj, count, kind):
    """Add handles where the exemplars ask for them, or without any where the shape does. Returns
    their empties."""
    reference = meshes.reference_positions(obj)
    blocks = [obj.data.shape_keys.key_blocks[name] for name in exemplars.enabled_names(obj)]
    poses = numpy.array([versions.get_key_positions(block) for block in blocks] or [reference])
    if not (numpy.isfinite(reference).all() and numpy.isfinite(poses).all()):
        raise ExemplarError("A shape key has coordinates that are not numbers.")
    corners = meshes.triangles(obj.data)
    if not len(corners):
        raise ExemplarError(f"'{obj.name}' has no faces.")
    found = proposals.propose(reference, corners, poses, _taken(obj), count)
    if not found:
        raise ExemplarError("There is no room for more handles.")
    size = meshes.size(obj)
    middle = 0.5 * (reference[:, 0].min() + reference[:, 0].max())
    added = []
    for proposal in found:
        beside = reference[proposal.vertices, 0].mean() - middle
        name = NAMES[proposal.role] + _side(beside, MIDDLE * size)
        added.append(handle_editing.add(obj, proposal.vertices, kind, name).empty)
    return added


def mirror(obj, chosen):
    """Add the mirror images, across the mesh's own YZ plane, of the handles in `chosen` that have
    none. Returns (the new empties, how many have one, how many find no vertices there)."""
    reference = meshes.reference_positions(obj)
    size = meshes.size(obj)
    tree = KDTree(len(reference))
    for index, position in enumerate(reference):
        tree.insert(position, index)
    tree.balance()
    added, present, unmatched = [], 0, 0
    for group, empty, kind, radius in [(h.group, h.empty, h.kind, h.radius) for h in chosen]:
        vertices = meshes.group_members(obj, {group}).get(group, ())
        if not len(vertices) or abs(reference[vertices, 0].mean()) <= MIDDLE * size:
            continue
        images = _images(tree, reference[vertices], MISFIT * size)
        if len(images) < 0.5 * len(vertices):
            unmatched += 1
            continue
        if numpy.isin(images, _taken(obj)).any():
            present += 1
            continue
        item = handle_editing.add(obj, images, kind, _mirrored_name(empty, reference[images]))
        item.radius = radius
        item.empty.empty_display_size = empty.empty_display_size
        added.append(item.empty)
    return added, present, unmatched


def _images(tree, positions, misfit):
    found = set()
    for x, y, z in positions:
        _, index, distance = tree.find((-x, y, z))
        if distance <= misfit:
            found.add(index)
    return numpy.array(sorted(found), numpy.uint32)


def _mirrored_name(empty, positions):
    flipped = bpy.utils.flip_name(empty.name)
    return flipped if flipped != empty.name else empty.name + _side(positions[:, 0].mean(), 0.0)


def _side(x, tolerance):
    """Blender's names of sides, for a character that looks along -Y."""
    if abs(x) <= tolerance:
        return ""
    return ".L" if x > 0 else ".R"


def _taken(obj):
    """uint32: the vertices of the handles that are there."""
    names = {item.group for item in obj.exemplar.handles}
    members = meshes.group_members(obj, names).values()
    return numpy.concatenate([numpy.zeros(0, numpy.uint32), *members])
