# SPDX-License-Identifier: GPL-3.0-or-later
"""Make and remove handles, in Edit Mode and out of it."""

import bmesh
import bpy
import numpy

from ..native import ExemplarError
from . import handles, meshes, rigs, versions


def add(obj, vertices, kind, name="Handle.001"):
    """A handle of `vertices`: an empty at their centre in the reference, and a vertex group."""
    if not len(vertices):
        raise ExemplarError("No vertices are selected. Select the vertices of the handle first.")
    _refuse_taken(obj, vertices)
    centre = _reference_positions(obj)[vertices].mean(axis=0)
    empty = handles.create_empty(obj, name, centre)
    group = obj.vertex_groups.new(name=empty.name)
    assign(obj, group, vertices)
    item = obj.exemplar.handles.add()
    item.empty = empty
    item.group, item.group_index = group.name, group.index
    item.kind = kind
    handles.record_rest(obj, item)
    obj.exemplar.handle_index = len(obj.exemplar.handles) - 1
    rigs.forget()
    return item


def remove(obj, item):
    """The handle, its empty and its vertex group."""
    group = obj.vertex_groups.get(item.group)
    if group is not None:
        obj.vertex_groups.remove(group)
    empty = item.empty
    items = obj.exemplar.handles
    items.remove(next(index for index, other in enumerate(items) if other == item))
    if empty is not None and empty.library is None and not _is_used(empty):
        bpy.data.objects.remove(empty)
    for other in items:
        if other.group in obj.vertex_groups:
            other.group_index = obj.vertex_groups[other.group].index
    obj.exemplar.handle_index = max(0, min(obj.exemplar.handle_index, len(items) - 1))
    rigs.forget()
    obj.update_tag(refresh={"OBJECT"})


def _is_used(empty):
    """Copies of a rig may share empties."""
    return any(h.empty == empty for rig in rigs.all_rigs() for h in rig.exemplar.handles)


def _refuse_taken(obj, vertices):
    items = list(obj.exemplar.handles)
    members = _members(obj, {item.group for item in items})
    for item in items:
        shared = numpy.intersect1d(vertices, members.get(item.group, ()))
        if len(shared):
            count = "One selected vertex is" if len(shared) == 1 else f"{len(shared)} of them are"
            raise ExemplarError(
                f"{count} already in handle '{handles.label(item)}'. "
                "A vertex can be in one handle only.",
                vertices=shared,
            )


# ------------------------------------------------------------------- the mesh, where it is edited


def selected_vertices(obj):
    """uint32 indices"""
    if obj.mode == "EDIT":
        edited = bmesh.from_edit_mesh(obj.data)
        edited.verts.index_update()
        return numpy.array([v.index for v in edited.verts if v.select], numpy.uint32)
    selected = numpy.empty(len(obj.data.vertices), bool)
    obj.data.vertices.foreach_get("select", selected)
    return numpy.flatnonzero(selected).astype(numpy.uint32)


def select_vertices(obj, vertices):
    """In Object Mode; Edit Mode shows it when it is entered."""
    for elements in (obj.data.polygons, obj.data.edges):
        elements.foreach_set("select", numpy.zeros(len(elements), bool))
    selected = numpy.zeros(len(obj.data.vertices), bool)
    selected[numpy.asarray(vertices, int)] = True
    obj.data.vertices.foreach_set("select", selected)
    obj.data.update()


def _reference_positions(obj):
    reference = meshes.reference_key(obj)
    if obj.mode != "EDIT":
        if reference is not None:
            return versions.get_key_positions(reference)
        return versions.get_mesh_positions(obj.data)
    edited = bmesh.from_edit_mesh(obj.data)
    layer = edited.verts.layers.shape.get(reference.name) if reference is not None else None
    if layer is None or obj.active_shape_key == reference:
        # The key that is being edited is in the vertices; its layer waits for the end.
        return numpy.array([v.co for v in edited.verts])
    return numpy.array([v[layer] for v in edited.verts])


def _members(obj, names):
    if obj.mode != "EDIT":
        return meshes.group_members(obj, names)
    edited = bmesh.from_edit_mesh(obj.data)
    edited.verts.index_update()
    layer = edited.verts.layers.deform.active
    wanted = {group.index: group.name for group in obj.vertex_groups if group.name in names}
    members = {name: [] for name in wanted.values()}
    for vertex in edited.verts if layer is not None else ():
        for index, weight in vertex[layer].items():
            if index in wanted and weight > 0:
                members[wanted[index]].append(vertex.index)
    return members


def assign(obj, group, vertices, weight=1.0):
    """Also while the mesh is edited."""
    if obj.mode != "EDIT":
        group.add(vertices.tolist(), weight, "REPLACE")
        return
    edited = bmesh.from_edit_mesh(obj.data)
    edited.verts.ensure_lookup_table()
    layer = edited.verts.layers.deform.verify()
    for vertex in vertices:
        edited.verts[vertex][layer][group.index] = weight
    bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
