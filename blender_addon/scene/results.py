# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the result is shown: a shape key of its own, or a copy of the object without shape keys."""

import json

import bpy
import numpy

from ..native import ExemplarError
from . import meshes, rigs, versions

KEY_NAME = "Exemplar Result"
# On the Key data-block: the mesh had no keys, and its Basis is there for our result alone.
OWN_BASIS = "exemplar_result_basis"
GONE = "was removed since Bind. Press Rebind."


def shown_object(obj):
    """The object that shows the result of `obj`."""
    return obj.exemplar.result_object if obj.exemplar.bound_target == "OBJECT" else obj


def check(obj):
    """Raise ExemplarError where the result has no place of its own any more."""
    rig = obj.exemplar
    for other in rigs.bound_rigs():
        if other == obj or _rank(other) > _rank(obj):
            continue
        if _shares_key(obj, other):
            raise ExemplarError(
                f"'{obj.name}' has the same mesh as '{other.name}', whose result it shows. "
                "Make the mesh a single user, or show the result in a separate object, "
                "and press Rebind."
            )
        if rig.bound_target == "OBJECT" and other.exemplar.result_object == rig.result_object:
            raise ExemplarError(
                f"'{obj.name}' is a copy of '{other.name}'. "
                "Press Rebind to give it a result of its own."
            )
    if rig.bound_target == "KEY":
        _result_key(obj)
    else:
        _result_object(obj)


def _rank(obj):
    """Of two that share a result the first by name keeps it: the original before its copies."""
    return (obj.library is not None, obj.name)


def _shares_key(obj, other):
    keys = obj.exemplar.bound_target == other.exemplar.bound_target == "KEY"
    return keys and obj.data == other.data


def _result_key(obj):
    keys = obj.data.shape_keys
    key = keys.key_blocks.get(obj.exemplar.result_key) if keys else None
    if key is None:
        raise ExemplarError(f"The shape key '{obj.exemplar.result_key}' {GONE}")
    if versions.key_size(key) != len(obj.data.vertices):
        raise ExemplarError(f"Shape key '{key.name}' does not fit the mesh. Press Rebind.")
    return key


def _result_object(obj):
    result = obj.exemplar.result_object
    if result is None or not rigs.is_in_scene(result):
        raise ExemplarError(f"The separate object {GONE}")
    if len(result.data.vertices) != len(obj.data.vertices):
        raise ExemplarError(
            f"The separate object '{result.name}' was edited and does not fit any more. "
            "Press Rebind."
        )
    return result


# ------------------------------------------------------------------------------------------ show


def influences(obj, depsgraph):
    """((name, value, vertex group), ...) of the artist's own keys that add to what is seen.

    Evaluated values, for they may be animated or driven.
    """
    if obj.exemplar.bound_target != "KEY":
        return ()
    keys = obj.data.shape_keys
    evaluated = keys.evaluated_get(depsgraph).key_blocks
    reference, result = keys.reference_key, obj.exemplar.result_key
    return tuple(
        (key.name, key.value, key.vertex_group)
        for key in evaluated
        if key.value and not key.mute and key.name not in (reference.name, result)
    )


def show(obj, positions, mix):
    """Write positions float32 [V][3] where they are seen; `mix` is what influences() returned."""
    check(obj)
    if obj.exemplar.bound_target == "OBJECT":
        mesh = _own_mesh(obj.exemplar.result_object)
        versions.set_mesh_positions(mesh, numpy.ascontiguousarray(positions))
        mesh.update()
        return
    written = positions - _mixed_in(obj, mix) if mix else positions
    key = _result_key(obj)
    versions.set_key_positions(key, numpy.ascontiguousarray(written, numpy.float32))
    obj.data.update_tag()


def _own_mesh(result):
    """Under a library override the mesh is still the library's, and other files' too."""
    if result.data.library is not None and result.library is None:
        result.data = result.data.copy()
    return result.data


def _mixed_in(obj, mix):
    """What the artist's own keys add to the result key. Their sliders stay theirs."""
    blocks = obj.data.shape_keys.key_blocks
    added = numpy.zeros((len(obj.data.vertices), 3), numpy.float32)
    for name, value, group in mix:
        key = blocks[name]
        delta = versions.get_key_positions(key) - versions.get_key_positions(key.relative_key)
        if group:
            delta *= meshes.group_weights(obj, group)[:, None]
        added += numpy.float32(value) * delta
    return added


# ------------------------------------------------------------------------------ create and remove


def refuse(obj, target):
    """Raise ExemplarError where the result cannot be shown in the way that was chosen."""
    if target == "OBJECT":
        return
    keys = obj.data.shape_keys
    if keys and not keys.use_relative:
        raise ExemplarError(
            "The shape keys are absolute. Tick Relative in Shape Keys, "
            "or choose to show the result in a separate object."
        )
    users = [other.name for other in bpy.data.objects if other.data == obj.data and other != obj]
    if users:
        raise ExemplarError(
            f"'{users[0]}' has the same mesh and would show the result too. "
            "Make the mesh a single user, or choose to show the result in a separate object."
        )


def create(obj, target):
    """Make the place for the result, or use the one that is there."""
    rig = obj.exemplar
    if rig.bound_target != target:
        remove(obj)
    if target == "KEY":
        _create_key(obj)
    elif not _owns_result_object(obj):
        rig.result_object = _create_object(obj)
    else:
        _fit_object(obj)
    rig.bound_target = target


def _create_key(obj):
    rig = obj.exemplar
    if not obj.data.shape_keys:
        obj.shape_key_add(name="Basis", from_mix=False)
        obj.data.shape_keys[OWN_BASIS] = True
    keys = obj.data.shape_keys
    if keys.key_blocks.get(rig.result_key) is None:
        active = obj.active_shape_key_index
        key = obj.shape_key_add(name=KEY_NAME, from_mix=False)
        key.relative_key = keys.reference_key
        key.value = 1.0
        rig.result_key = key.name
        obj.active_shape_key_index = active


def _owns_result_object(obj):
    result = obj.exemplar.result_object
    if result is None or not rigs.is_in_scene(result):
        return False
    shared = [rig for rig in rigs.bound_rigs() if rig.exemplar.result_object == result]
    return all(rig == obj or _rank(rig) > _rank(obj) for rig in shared)


def _create_object(obj):
    result = obj.copy()
    result.property_unset("exemplar")
    result.name = f"{obj.name} Result"
    result.animation_data_clear()
    result.constraints.clear()
    result.data = obj.data.copy()
    result.data.name = result.name
    result.shape_key_clear()
    result.parent = obj
    result.parent_type = "OBJECT"
    result.matrix_parent_inverse.identity()
    result.matrix_basis.identity()
    for collection in obj.users_collection:
        collection.objects.link(result)
    rig = obj.exemplar
    rig.display_before = json.dumps([obj.display_type, obj.hide_render])
    obj.display_type = "WIRE"
    obj.hide_render = True
    return result


def _fit_object(obj):
    """After an edit of the mesh the copy has other faces."""
    result = obj.exemplar.result_object
    if meshes.topology_digest(result.data) != meshes.topology_digest(obj.data):
        old = result.data
        name = old.name
        result.data = obj.data.copy()
        bpy.data.meshes.remove(old)
        result.shape_key_clear()
        result.data.name = name


def remove(obj):
    """Take the result away and leave the artist's data as it was."""
    rig = obj.exemplar
    if rig.bound_target == "KEY":
        keys = obj.data.shape_keys
        key = keys.key_blocks.get(rig.result_key) if keys else None
        shared = any(other != obj and _shares_key(obj, other) for other in rigs.bound_rigs())
        if key is not None and not shared:
            _remove_key(obj, key)
        rig.result_key = ""
    elif rig.bound_target == "OBJECT":
        if rig.result_object is not None and _owns_result_object(obj):
            mesh = rig.result_object.data
            bpy.data.objects.remove(rig.result_object)
            if not mesh.users:
                bpy.data.meshes.remove(mesh)
        rig.result_object = None
        if rig.display_before:
            obj.display_type, obj.hide_render = json.loads(rig.display_before)
            rig.display_before = ""
    rig.bound_target = ""


def _remove_key(obj, key):
    active = obj.active_shape_key.name if obj.active_shape_key else ""
    obj.shape_key_remove(key)
    keys = obj.data.shape_keys
    if keys and OWN_BASIS in keys and len(keys.key_blocks) == 1:
        # The artist may have edited it, so it goes back into the mesh that it was made from.
        rest = versions.get_key_positions(keys.reference_key)
        obj.shape_key_clear()
        versions.set_mesh_positions(obj.data, rest)
        obj.data.update()
        return
    names = obj.data.shape_keys.key_blocks.keys() if obj.data.shape_keys else []
    obj.active_shape_key_index = names.index(active) if active in names else 0
