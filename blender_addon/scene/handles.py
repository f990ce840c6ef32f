# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles: their vertices, their empties, and the targets between the two."""

import heapq

import bpy
import numpy
from mathutils import Matrix, Vector

from ..native import Element, ExemplarError, Kind
from . import meshes, rigs


def bound_items(obj):
    """The handles of the bind, in its order."""
    items = [item for item in obj.exemplar.handles if item.bound_index >= 0]
    return sorted(items, key=lambda item: item.bound_index)


def label(item):
    return item.empty.name if item.empty is not None else item.group


def is_missing(item):
    """Its empty was deleted."""
    return item.empty is None or not rigs.is_in_scene(item.empty)


def first_missing(obj):
    """The first bound handle whose empty was deleted; a free one is not missed."""
    for item in bound_items(obj):
        if item.bound_kind != Kind.FREE and is_missing(item):
            return item
    return None


def missing_sentence(item):
    return (
        f"The empty of handle '{label(item)}' was deleted. "
        "Undo that, or remove the handle and press Rebind."
    )


# -------------------------------------------------------------------------------------- vertices


def adopt_renamed_groups(obj):
    """Follow vertex groups that were renamed: the index stays when the name goes."""
    groups = obj.vertex_groups
    taken = {item.group for item in obj.exemplar.handles if item.group in groups}
    for item in obj.exemplar.handles:
        if item.group in groups:
            item.group_index = groups[item.group].index
        elif 0 <= item.group_index < len(groups):
            name = groups[item.group_index].name
            if name not in taken:
                item.group = name
                taken.add(name)


def vertex_sets(obj, items, radii, positions):
    """For each handle its vertices, grown by its radius. An error names the handle at fault."""
    names = {item.group for item in items}
    members = meshes.group_members(obj, names)
    sets = []
    for index, item in enumerate(items):
        if item.group not in members:
            raise ExemplarError(
                f"The vertex group of handle '{label(item)}' is gone. "
                "Remove the handle and add it again.",
                element=Element.HANDLE,
                index=index,
            )
        if not len(members[item.group]):
            raise ExemplarError(
                f"Handle '{label(item)}' has no vertices: its vertex group "
                f"'{item.group}' is empty. Assign vertices to the group, or remove the handle.",
                element=Element.HANDLE,
                index=index,
            )
        sets.append(members[item.group])
    _refuse_shared(items, sets, len(positions))
    if any(radius > 0 for radius in radii):
        sets = grow(sets, radii, positions, meshes.edges(obj.data))
    return sets


def _refuse_shared(items, sets, vertex_count):
    owner = numpy.full(vertex_count, -1)
    for index, vertices in enumerate(sets):
        shared = vertices[owner[vertices] >= 0]
        if len(shared):
            first = items[owner[shared[0]]]
            raise ExemplarError(
                f"Handles '{label(first)}' and '{label(items[index])}' share "
                f"{len(shared)} {'vertex' if len(shared) == 1 else 'vertices'}. "
                "A vertex can be in one handle only: take it out of one vertex group.",
                element=Element.HANDLE,
                index=index,
                vertices=shared,
            )
        owner[vertices] = index


def grow(sets, radii, positions, edges):
    """Every vertex within a handle's radius along the edges goes to the nearest such handle.

    All handles grow at once, so that none takes what is nearer to another.
    """
    neighbours = _neighbours(edges)
    owner = {int(vertex): h for h, vertices in enumerate(sets) for vertex in vertices}
    heap = [
        (0.0, h, int(vertex)) for h, vertices in enumerate(sets) if radii[h] for vertex in vertices
    ]
    heapq.heapify(heap)
    done = set()
    while heap:
        distance, h, vertex = heapq.heappop(heap)
        if vertex in done or owner.setdefault(vertex, h) != h:
            continue
        done.add(vertex)
        for other in neighbours(vertex):
            further = distance + float(numpy.linalg.norm(positions[other] - positions[vertex]))
            if further <= radii[h] and other not in owner:
                heapq.heappush(heap, (further, h, int(other)))
    grown = [[] for _ in sets]
    for vertex, h in owner.items():
        grown[h].append(vertex)
    return [numpy.array(sorted(vertices), numpy.uint32) for vertices in grown]


def _neighbours(edges):
    both = numpy.concatenate([edges, edges[:, ::-1]])
    both = both[numpy.argsort(both[:, 0], kind="stable")]
    bounds = numpy.searchsorted(both[:, 0], numpy.arange(edges.max(initial=-1) + 2))

    def neighbours(vertex):
        if vertex + 1 >= len(bounds):
            return ()
        start, end = bounds[vertex], bounds[vertex + 1]
        return both[start:end, 1]

    return neighbours


# --------------------------------------------------------------------------------------- targets


def rest_matrix(item, centre):
    """The empty at rest, in the mesh's space."""
    rest = item.rest
    matrix = Matrix((rest[0:3], rest[3:6], rest[6:9])).to_4x4()
    matrix.translation = centre
    return matrix


def inverse_of_world(obj):
    try:
        return obj.matrix_world.inverted()
    except ValueError:
        raise ExemplarError(
            f"'{obj.name}' is scaled to nothing. Give it a scale that is not zero."
        ) from None


def targets(obj, depsgraph, centres):
    """Where the empties want the bound handles: float64 [H][3][4], in the mesh's space.

    Evaluated matrices, so that parents, constraints, drivers and animation count. The linear part
    is relative to the handle at rest.
    """
    items = bound_items(obj)
    if len(items) != len(centres):
        raise ExemplarError("A handle was removed since Bind. Press Rebind.")
    to_local = inverse_of_world(obj.evaluated_get(depsgraph))
    out = numpy.zeros((len(items), 3, 4))
    out[:, :, :3] = numpy.identity(3)
    out[:, :, 3] = centres
    for index, item in enumerate(items):
        if item.bound_kind == Kind.FREE:
            continue
        if is_missing(item):
            raise ExemplarError(missing_sentence(item), element=Element.HANDLE, index=index)
        local = to_local @ item.empty.evaluated_get(depsgraph).matrix_world
        out[index, :, 3] = local.translation
        if item.bound_kind == Kind.ORIENTED:
            out[index, :, :3] = numpy.array(local.to_3x3()) @ _rest_inverse(item, index)
    if not numpy.isfinite(out).all():
        raise ExemplarError("An empty is at a place that is not a number.")
    return out


def _rest_inverse(item, index):
    try:
        return numpy.linalg.inv(numpy.reshape(item.rest, (3, 3)))
    except numpy.linalg.LinAlgError:
        raise ExemplarError(
            f"The empty of handle '{label(item)}' was scaled to nothing at Bind. "
            "Give it a scale that is not zero and press Rebind.",
            element=Element.HANDLE,
            index=index,
        ) from None


# --------------------------------------------------------------------------------------- empties


def create_empty(obj, name, centre):
    """An empty at `centre` (in the mesh's space), beside the mesh in its collections."""
    empty = bpy.data.objects.new(name, None)
    empty.empty_display_type = "SPHERE"
    empty.empty_display_size = _display_size(obj)
    empty.show_in_front = True
    for collection in obj.users_collection:
        collection.objects.link(empty)
    if obj.parent is not None:
        empty.parent = obj.parent
        empty.parent_type = obj.parent_type
        empty.parent_bone = obj.parent_bone
        empty.matrix_parent_inverse = obj.matrix_parent_inverse
    empty.matrix_world = Matrix.Translation(obj.matrix_world @ vector(centre))
    return empty


def _display_size(obj):
    """Small enough to tell neighbours apart, large enough to be found."""
    corners = numpy.array([obj.matrix_world @ vector(corner) for corner in obj.bound_box])
    diagonal = float(numpy.linalg.norm(corners.max(axis=0) - corners.min(axis=0)))
    return 0.03 * diagonal or 1.0


def vector(values):
    return Vector([float(value) for value in values])


def is_animated(empty):
    """Whether something other than the artist's hand says where the empty is."""
    animation = empty.animation_data
    return bool(empty.constraints) or (
        animation is not None
        and bool(animation.action or animation.drivers or animation.nla_tracks)
    )


def move_empty(obj, item, target, with_linear):
    """Put an empty where `target` [3][4] has its handle, with or without the turn."""
    world = obj.matrix_world @ _as_matrix(target, item)
    if with_linear:
        item.empty.matrix_world = world
    else:
        matrix = item.empty.matrix_world.copy()
        matrix.translation = world.translation
        item.empty.matrix_world = matrix


def _as_matrix(target, item):
    linear = numpy.asarray(target)[:, :3] @ numpy.reshape(item.rest, (3, 3))
    matrix = Matrix(linear.tolist()).to_4x4()
    matrix.translation = target[:, 3].tolist()
    return matrix


def record_rest(obj, item):
    """The empty as it stands is the handle at rest."""
    linear = (inverse_of_world(obj) @ item.empty.matrix_world).to_3x3()
    item.rest = [value for row in linear for value in row]
