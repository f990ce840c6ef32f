# SPDX-License-Identifier: GPL-3.0-or-later
"""What has to be switched on and off for a bake to be what is seen."""

from . import mesh_cache, shape_keys


def player(obj):
    """The object that shows the result: the mesh itself, or the copy made for it."""
    rig = obj.exemplar
    if rig.target == "OBJECT" and rig.result_object is not None:
        return rig.result_object
    return obj


def play_file(obj, filepath, file_format, frames):
    """The modifier replaces every position, so shape keys need not be touched."""
    return mesh_cache.set_up(player(obj), filepath, file_format, frames)


def play_keys(obj, shown, blocks):
    """Only `blocks` and the Basis count on `shown`: what else moves the mesh is switched off.

    Live would show its result on top; keys that are not part of the bake would be added to it; a
    Mesh Cache of an earlier bake would hide it.
    """
    obj.exemplar.live = False
    names = {block.name for block in blocks}
    key = shown.data.shape_keys
    for block in key.key_blocks:
        if block != key.reference_key:
            block.mute = block.name not in names
    shown.show_only_shape_key = False
    modifier = mesh_cache.find(shown)
    if modifier is not None:
        modifier.show_viewport = modifier.show_render = False
    if shown == obj:
        _leave_out_of_exemplars(obj)


def _leave_out_of_exemplars(obj):
    """Keys made by a bake are not exemplars, unless somebody says so."""
    items = {item.name: item for item in obj.exemplar.exemplars}
    for block in shape_keys.baked_keys(obj):
        item = items.get(block.name) or obj.exemplar.exemplars.add()
        item.name = block.name
        item.enabled = False
