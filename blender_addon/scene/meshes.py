# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bind needs of a mesh object, as arrays."""

import hashlib

import numpy

from . import versions


def triangles(mesh):
    """uint32 [F][3]"""
    mesh.calc_loop_triangles()
    corners = numpy.empty((len(mesh.loop_triangles), 3), numpy.int32)
    mesh.loop_triangles.foreach_get("vertices", corners.ravel())
    return corners.astype(numpy.uint32)


def edges(mesh):
    """int32 [E][2]"""
    pairs = numpy.empty((len(mesh.edges), 2), numpy.int32)
    mesh.edges.foreach_get("vertices", pairs.ravel())
    return pairs


def topology_digest(mesh):
    """Changes with the faces' corners, and with nothing else."""
    corners = numpy.empty(len(mesh.loops), numpy.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    sizes = numpy.empty(len(mesh.polygons), numpy.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    return digest(corners, sizes)


def digest(*arrays):
    """Short and the same on every machine; it tells edits apart, not enemies."""
    state = hashlib.blake2b(digest_size=12)
    for array in arrays:
        state.update(numpy.ascontiguousarray(array))
    return state.hexdigest()


def reference_key(obj):
    keys = obj.data.shape_keys
    return keys.reference_key if keys else None


def reference_positions(obj):
    """The mesh at rest, float32 [V][3]: its Basis, or itself where it has no shape keys."""
    key = reference_key(obj)
    return versions.get_mesh_positions(obj.data) if key is None else versions.get_key_positions(key)


def reference_name(obj):
    key = reference_key(obj)
    return "The mesh" if key is None else f"Shape key '{key.name}'"


def size(obj):
    """The diagonal of the box about the mesh at rest, in its own space."""
    return float(numpy.linalg.norm(numpy.ptp(reference_positions(obj), axis=0))) or 1.0


def exemplar_keys(obj):
    """The shape keys that can be exemplars: all but the one that shows our result."""
    keys = obj.data.shape_keys if obj.type == "MESH" else None
    if not keys:
        return []
    return [key for key in keys.key_blocks if key.name != obj.exemplar.result_key]


def group_members(obj, names):
    """{name: uint32 vertices} of the vertex groups that exist among `names`, in one pass."""
    wanted = {group.index: group.name for group in obj.vertex_groups if group.name in names}
    members = {name: [] for name in wanted.values()}
    if wanted:
        for vertex in obj.data.vertices:
            for element in vertex.groups:
                if element.weight > 0 and element.group in wanted:
                    members[wanted[element.group]].append(vertex.index)
    return {name: numpy.array(found, numpy.uint32) for name, found in members.items()}


def group_weights(obj, name):
    """float32 [V]; zero outside the group."""
    weights = numpy.zeros(len(obj.data.vertices), numpy.float32)
    group = obj.vertex_groups.get(name)
    if group is not None:
        for vertex in obj.data.vertices:
            for element in vertex.groups:
                if element.group == group.index:
                    weights[vertex.index] = element.weight
    return weights
