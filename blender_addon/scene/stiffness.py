# SPDX-License-Identifier: GPL-3.0-or-later
"""The stiffness of a mesh: r, the width in rings of the neighbourhood that turns as one, for each
vertex [Rigidity, 3.1]. Painted as a vertex group, 0 to 1 for the smallest to the largest r.
"""

import numpy

from ..native import ExemplarError
from . import handle_editing, meshes

GROUP = "Rigidity"


def key(obj):
    """All that radii() depends on but for the weights themselves."""
    own = obj.exemplar.rigidity
    if own.source == "UNIFORM":
        return (own.source, own.radius)
    return (own.source, own.group, own.radius_min, own.radius_max)


def radii(obj):
    """int32 [V]. Raises ExemplarError."""
    own = obj.exemplar.rigidity
    if own.source == "UNIFORM":
        return numpy.full(len(obj.data.vertices), own.radius, numpy.int32)
    check_range(obj)
    group = find_group(obj)
    if group is None:
        raise ExemplarError(
            f"The vertex group '{own.group}', which says how stiff the mesh is, is gone. Paint, "
            "fill or learn it anew, or set Stiffness to Uniform."
        )
    weights = meshes.group_weights(obj, group.name)
    return radii_of_weights(weights, own.radius_min, own.radius_max)


def shares(obj):
    """float32 [V] from 0, softest, to 1, stiffest, of the range that can be painted."""
    own = obj.exemplar.rigidity
    try:
        found = radii(obj)
    except ExemplarError:
        return numpy.zeros(len(obj.data.vertices), numpy.float32)
    return weights_of_radii(found, own.radius_min, own.radius_max).astype(numpy.float32)


def check_range(obj):
    own = obj.exemplar.rigidity
    if own.radius_min > own.radius_max:
        raise ExemplarError(
            f"Softest is {own.radius_min} rings, which is more than the {own.radius_max} of "
            "Stiffest."
        )


def radii_of_weights(weights, low, high):
    return numpy.rint(low + numpy.clip(weights, 0, 1) * (high - low)).astype(numpy.int32)


def weights_of_radii(radii, low, high):
    span = max(1, high - low)
    return numpy.clip((numpy.asarray(radii) - low) / span, 0, 1)


# ------------------------------------------------------------------------------------------ group


def find_group(obj):
    """The painted vertex group, found by its place if it was renamed; None where there is none."""
    own = obj.exemplar.rigidity
    groups = obj.vertex_groups
    group = groups.get(own.group)
    if group is None and 0 <= own.group_index < len(groups):
        group = groups[own.group_index]
        if any(item.group == group.name for item in obj.exemplar.handles):
            return None  # what moved up into the place of one that was removed
    return group


def ensure_group(obj):
    """The painted vertex group; a new one is as stiff as the mesh has been until now."""
    own = obj.exemplar.rigidity
    group = find_group(obj)
    if group is None:
        group = obj.vertex_groups.new(name=GROUP)
        value = weights_of_radii(own.radius, own.radius_min, own.radius_max)
        every = numpy.arange(len(obj.data.vertices))
        handle_editing.assign(obj, group, every, float(value))
    own.group, own.group_index = group.name, group.index
    own.source = "PAINTED"
    return group


def fill(obj, vertices, value):
    """The paint bucket: one stiffness for all of `vertices`."""
    if not len(vertices):
        raise ExemplarError("No vertices are selected. Select those to fill first.")
    handle_editing.assign(obj, ensure_group(obj), vertices, value)


def write(obj, radii):
    """Radii [V] become the painted weights."""
    own = obj.exemplar.rigidity
    group = ensure_group(obj)
    values = weights_of_radii(radii, own.radius_min, own.radius_max)
    for value in numpy.unique(values):
        handle_editing.assign(obj, group, numpy.flatnonzero(values == value), float(value))
