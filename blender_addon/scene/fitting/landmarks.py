# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks: points that are known on the mesh and on the scan."""

import re

import numpy
from mathutils import Vector

from ...native import ExemplarError
from .. import handles, meshes, rigs, versions

SUFFIX = re.compile(r"\.\d{3,}$")


def point(item, scan, depsgraph=None):
    """Where the scan has a landmark, in world space; None where its empty is gone."""
    if item.empty is not None:
        if not rigs.is_in_scene(item.empty):
            return None
        empty = item.empty if depsgraph is None else item.empty.evaluated_get(depsgraph)
        return empty.matrix_world.translation.copy()
    scan = scan if depsgraph is None else scan.evaluated_get(depsgraph)
    return scan.matrix_world @ Vector(item.point)


def arrays(obj, depsgraph):
    """(vertices uint32 [n], points float64 [n][3] in the mesh's own space). An error names the
    landmark."""
    own = obj.exemplar_fit
    to_mesh = numpy.linalg.inv(numpy.array(obj.evaluated_get(depsgraph).matrix_world))
    count = len(obj.data.vertices)
    vertices, points, owners = [], [], {}
    for item in own.landmarks:
        if item.vertex >= count:
            raise ExemplarError(
                f"Landmark '{item.name}' is vertex {item.vertex}, and the mesh has {count} "
                "vertices. Remove the landmark and pick it again."
            )
        if item.vertex in owners:
            raise ExemplarError(
                f"Landmarks '{owners[item.vertex]}' and '{item.name}' are the same vertex, "
                f"{item.vertex}. Remove one of them.",
                vertices=numpy.array([item.vertex]),
            )
        owners[item.vertex] = item.name
        at = point(item, own.scan, depsgraph)
        if at is None:
            raise ExemplarError(f"The empty of landmark '{item.name}' was deleted. Pick it again.")
        vertices.append(item.vertex)
        points.append(to_mesh[:3, :3] @ at + to_mesh[:3, 3])
    return numpy.array(vertices, numpy.uint32), numpy.array(points).reshape(-1, 3)


def add(obj, name, vertex, at=None, empty=None):
    """A landmark at world position `at` on the scan, or at an empty. One vertex has one."""
    own = obj.exemplar_fit
    item = next((other for other in own.landmarks if other.vertex == vertex), None)
    item = item or own.landmarks.add()
    item.name, item.vertex, item.empty, item.residual = name, vertex, empty, -1.0
    if at is not None:
        item.point = own.scan.matrix_world.inverted_safe() @ Vector(at)
    own.landmark_index = len(own.landmarks) - 1
    return item


def next_name(obj):
    names = {item.name for item in obj.exemplar_fit.landmarks}
    number = 1
    while f"Landmark {number}" in names:
        number += 1
    return f"Landmark {number}"


# ----------------------------------------------------------------------------------------- by name


def from_names(obj):
    """Landmarks of vertex groups and of child empties that mesh and scan call alike. Returns how
    many."""
    scan = obj.exemplar_fit.scan
    on_mesh, on_scan = _named_points(obj), _named_points(scan)
    # Handles' groups are named after their empties, which are children of nothing.
    shared = sorted(on_mesh.keys() & on_scan.keys())
    if not shared:
        raise ExemplarError(
            f"'{obj.name}' and '{scan.name}' have no names in common. Give vertex groups of one or "
            "more vertices, or empties parented to each of them, the same names on both."
        )
    positions = meshes.reference_positions(obj)
    for name in shared:
        vertex = nearest(positions, on_mesh[name][0])
        at, empty = on_scan[name]
        add(obj, name, vertex, scan.matrix_world @ Vector(at), empty)
    return len(shared)


def _named_points(obj):
    """{name: (place in the object's own space, empty or None)}"""
    positions = meshes.reference_positions(obj)
    members = meshes.group_members(obj, {group.name for group in obj.vertex_groups})
    found = {
        _stem(name): (positions[vertices].mean(axis=0), None)
        for name, vertices in members.items()
        if len(vertices)
    }
    inverse = obj.matrix_world.inverted_safe()
    for child in obj.children:
        if child.type == "EMPTY":
            found[_stem(child.name)] = (inverse @ child.matrix_world.translation, child)
    return found


def _stem(name):
    """Blender numbers objects of one name: Nose, Nose.001."""
    return SUFFIX.sub("", name)


def from_handles(obj):
    """Landmarks of the handles: their empties, moved to where the scan has them. Returns how
    many."""
    items = list(obj.exemplar.handles)
    if not items:
        raise ExemplarError(f"'{obj.name}' has no handles. Add some, or pick landmarks.")
    positions = meshes.reference_positions(obj)
    sets = handles.vertex_sets(obj, items, [0.0] * len(items), positions)
    for item, vertices in zip(items, sets):
        if item.empty is not None:
            centre = positions[vertices].mean(axis=0)
            vertex = int(vertices[nearest(positions[vertices], centre)])
            add(obj, handles.label(item), vertex, empty=item.empty)
    return len(items)


def nearest(positions, place):
    """Index of the position that is nearest to a place."""
    return int(((positions - numpy.asarray(place)) ** 2).sum(axis=1).argmin())


# ---------------------------------------------------------------------------------------- by click


def hit_vertex(obj, depsgraph, origin, direction):
    """The vertex of the surface that a ray in world space meets, or None."""
    evaluated = obj.evaluated_get(depsgraph)
    inverse = evaluated.matrix_world.inverted_safe()
    start = inverse @ origin
    along = (inverse.to_3x3() @ direction).normalized()
    is_hit, place, _, face = evaluated.ray_cast(start, along)
    if not is_hit or len(evaluated.data.vertices) != len(obj.data.vertices):
        return None
    corners = evaluated.data.polygons[face].vertices
    return min(corners, key=lambda v: (evaluated.data.vertices[v].co - place).length_squared)


def hit_point(scan, depsgraph, origin, direction):
    """The point of the scan that a ray meets, in world space, or None. In a cloud it is the one
    nearest to the ray, if that is near."""
    evaluated = scan.evaluated_get(depsgraph)
    matrix = evaluated.matrix_world
    inverse = matrix.inverted_safe()
    start = inverse @ origin
    along = (inverse.to_3x3() @ direction).normalized()
    if len(evaluated.data.polygons):
        is_hit, place, _, _ = evaluated.ray_cast(start, along)
        return matrix @ place if is_hit else None
    positions = versions.get_mesh_positions(evaluated.data).astype(numpy.float64)
    offsets = positions - numpy.array(start)
    depth = offsets @ numpy.array(along)
    distances = numpy.linalg.norm(offsets - depth[:, None] * numpy.array(along), axis=1)
    # A finger's width of the cloud; of those within it the one in front.
    near = numpy.flatnonzero(distances < 0.02 * numpy.linalg.norm(numpy.ptp(positions, axis=0)))
    if not len(near):
        return None
    return matrix @ Vector(positions[near[depth[near].argmin()]])
