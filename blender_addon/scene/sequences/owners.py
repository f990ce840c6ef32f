# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects show a sequence, and what belongs to them: plane, curve, marks, playhead.

Remembered by name and looked up each time, as in scene/rigs.py and for the same reasons.
"""

import bpy

_names = []  # (name, library path or None)
_object_count = -1


def forget():
    """Search again next time."""
    global _object_count
    _object_count = -1


def every():
    """The objects that show a sequence."""
    global _object_count
    if len(bpy.data.objects) != _object_count:
        _search()
    found = [bpy.data.objects.get(name) for name in _names]
    if any(obj is None or not is_owner(obj) for obj in found):
        _search()  # renamed or removed
        found = [bpy.data.objects.get(name) for name in _names]
    return found


def owner_of(obj):
    """The object that shows the sequence which `obj` belongs to, or None."""
    if obj is None:
        return None
    if is_owner(obj):
        return obj
    for owner in every():
        if obj in parts(owner):
            return owner
    return None


def active(context):
    return owner_of(context.view_layer.objects.active)


def parts(owner):
    data = owner.exemplar_sequence
    found = (data.plane, data.curve, data.marks, data.playhead)
    return [part for part in found if part is not None]


def is_owner(obj):
    # Asking for obj.exemplar_sequence would write an empty group into every object of the file.
    if obj.type != "MESH" or not obj.is_property_set("exemplar_sequence"):
        return False
    return obj.exemplar_sequence.is_sequence


def _search():
    global _object_count
    _object_count = len(bpy.data.objects)
    _names[:] = [
        (obj.name, obj.library.filepath if obj.library else None)
        for obj in bpy.data.objects
        if is_owner(obj)
    ]
