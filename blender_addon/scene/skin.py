# SPDX-License-Identifier: GPL-3.0-or-later
"""Skinning weights as vertex groups, for armatures and for other programs."""

import json

import numpy

from ..native import ExemplarError
from . import bindings, deformers, rigs

NAME = "Bone"
# Weights below it are not worth a place in a group.
NOTHING = 1e-4


def why_not(obj):
    """Why a bound object has no skinning weights, or ""."""
    if deformers.bound(obj).identifier != "BLENDED" or not _has_skeleton(obj):
        return "Choose the deformer Blended with the dictionary Skeleton, and press Rebind"
    return ""


def _has_skeleton(obj):
    return deformers.fingerprint.read(obj)["settings"]["dictionary"] == "SKELETON"


def write(obj):
    """One vertex group a bone, in the place of those of the last time. Returns their names."""
    reason = why_not(obj)
    if reason:
        raise ExemplarError(f"{reason}.")
    # The constant comes first; the rest are the bones'.
    weights = bindings.ensure(obj).deformer.functions()[1:]
    if not len(weights):
        raise ExemplarError("The exemplars do not move against each other: there are no bones.")
    remove(obj)
    names = [_fill(obj, values) for values in weights]
    obj.exemplar.blended.skin_groups = json.dumps(names)
    rigs.forget()
    return names


def _fill(obj, values):
    group = obj.vertex_groups.new(name=f"{NAME}.001")
    rounded = numpy.round(values, 4)
    for weight in numpy.unique(rounded[rounded > NOTHING]):
        group.add(numpy.flatnonzero(rounded == weight).tolist(), float(weight), "REPLACE")
    return group.name


def remove(obj):
    """The groups of the last time, where they still have the names that we gave them."""
    made = json.loads(obj.exemplar.blended.skin_groups or "[]")
    for name in made:
        group = obj.vertex_groups.get(name)
        if group is not None:
            obj.vertex_groups.remove(group)
    obj.exemplar.blended.skin_groups = ""
    _note_places(obj)


def _note_places(obj):
    """Groups are known by their place when their name is gone, and removing one moves others."""
    for item in obj.exemplar.handles:
        if item.group in obj.vertex_groups:
            item.group_index = obj.vertex_groups[item.group].index
    own = obj.exemplar.rigidity
    if own.group in obj.vertex_groups:
        own.group_index = obj.vertex_groups[own.group].index
