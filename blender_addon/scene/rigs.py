# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects are ours: meshes with handles or a bind, their empties, their result objects.

Objects are remembered by name and looked up each time, for undo and deletion free what Python
still holds. A scene may have tens of thousands of objects, so they are searched only when their
number has changed or something has told us to (load, undo, a new handle).
"""

import bpy

_names = []  # (name, library path or None)
_object_count = -1
_users_in_scene = {}  # (name, library path or None): how many users it had when it was in a scene


def forget():
    """Search again next time."""
    global _object_count
    _object_count = -1
    _users_in_scene.clear()


def all_rigs():
    """Mesh objects that have handles or are bound."""
    global _object_count
    if len(bpy.data.objects) != _object_count:
        _search()
    found = [bpy.data.objects.get(name) for name in _names]
    if any(obj is None or not _is_rig(obj) for obj in found):
        _search()  # renamed or removed
        found = [bpy.data.objects.get(name) for name in _names]
    return found


def bound_rigs():
    return [obj for obj in all_rigs() if obj.exemplar.bound]


def rig_of(obj):
    """The mesh object that `obj` belongs to as mesh, empty or result; None if to none."""
    if obj is None:
        return None
    if obj.type == "EMPTY":
        rigs = [r for r in all_rigs() if any(h.empty == obj for h in r.exemplar.handles)]
        return rigs[0] if rigs else None
    if obj.type != "MESH":
        return None
    for rig in all_rigs():
        if rig.exemplar.result_object == obj:
            return rig
    return obj


def active_rig(context):
    """The mesh object that the panel and the operators are about."""
    return rig_of(context.view_layer.objects.active)


def is_in_scene(obj):
    """Deleting an object takes it out of the scenes; our pointer alone keeps it in the file.

    Object.users_scene goes through all objects of the file, 12 ms at 20 000. What leaves a
    collection loses a user, so it is asked again only when their number has changed.
    """
    key = (obj.name, obj.library.filepath if obj.library else None)
    if _users_in_scene.get(key) == obj.users:
        return True
    if not obj.users_scene:
        return False
    _users_in_scene[key] = obj.users
    return True


def _search():
    global _object_count
    _object_count = len(bpy.data.objects)
    _names[:] = [
        (obj.name, obj.library.filepath if obj.library else None)
        for obj in bpy.data.objects
        if _is_rig(obj)
    ]


def _is_rig(obj):
    # Asking for obj.exemplar would write an empty group into every object of the file.
    if obj.type != "MESH" or not obj.is_property_set("exemplar"):
        return False
    return obj.exemplar.bound or len(obj.exemplar.handles) > 0
