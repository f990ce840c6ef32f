# SPDX-License-Identifier: GPL-3.0-or-later
"""What has to be switched on and off for a bake to be what is seen, and back again."""

import json

from .. import bindings, exemplars, results, versions
from . import curves, mesh_cache, sampling, shape_keys

# On the Key data-block: names of the keys that a bake muted.
MUTED = "exemplar_muted"


def play_file(obj, filepath, file_format, frames):
    """The modifier replaces every position, so that shape keys need not be touched."""
    return mesh_cache.set_up(results.shown_object(obj), filepath, file_format, frames)


def play_keys(obj, shown, blocks):
    """Only `blocks` move the mesh of `shown`: what else would be seen is switched off.

    Live would show its result on top; other keys that count would be added; a Mesh Cache of an
    earlier bake would hide it all.
    """
    sampling.set_live(obj, False)
    _restore_muted(shown)
    _mute_others(obj, shown, {block.name for block in blocks})
    _clear_result_key(obj)
    obj.show_only_shape_key = False
    modifier = mesh_cache.find(results.shown_object(obj))
    if modifier is not None:
        modifier.show_viewport = modifier.show_render = False
    if shown == obj:
        _leave_out_of_exemplars(obj)
        _show_instead_of_result(obj)


def is_baked(obj):
    """Whether something of a bake hides what Live would show."""
    shown = results.shown_object(obj)
    if shown is None:
        return False
    modifier = mesh_cache.find(shown)
    if modifier is not None and (modifier.show_viewport or modifier.show_render):
        return True
    keys = [*shape_keys.baked_keys(shown), *shape_keys.baked_keys(obj)]
    return any(not block.mute for block in keys)


def remove(obj):
    """Take away what a bake put there (not its files, nor keyframes on the artist's own keys), and
    let Live show the result again."""
    for shown in {obj, results.shown_object(obj)} - {None}:
        modifier = mesh_cache.find(shown)
        if modifier is not None:
            shown.modifiers.remove(modifier)
        _restore_muted(shown)
        shape_keys.remove(shown)
    exemplars.sync(obj)
    _show_result_again(obj)
    sampling.set_live(obj, True)


# -------------------------------------------------------------------------------------------- keys


def _mute_others(obj, shown, names):
    key = shown.data.shape_keys
    muted = []
    for block in key.key_blocks:
        if block.name in names:
            block.mute = False
        elif _counts(key, block) and block.name != obj.exemplar.result_key and not block.mute:
            block.mute = True
            muted.append(block.name)
    key[MUTED] = json.dumps(muted)


def _counts(key, block):
    if block == key.reference_key:
        return False
    return block.value != 0.0 or curves.is_driven(key, block) or curves.is_animated(key, block)


def _restore_muted(shown):
    key = shown.data.shape_keys
    if key is None or MUTED not in key:
        return
    for name in json.loads(key[MUTED]):
        block = key.key_blocks.get(name)
        if block is not None:
            block.mute = False
    del key[MUTED]


def _clear_result_key(obj):
    """Equal to the Basis it adds nothing; and Live, switched on again, has it as it left it."""
    key = obj.data.shape_keys
    block = key.key_blocks.get(obj.exemplar.result_key) if key else None
    if block is not None:
        versions.set_key_positions(block, versions.get_key_positions(block.relative_key))
        obj.data.update_tag()
    state = bindings.peek(obj)
    if state is not None:
        state.forget_shown()


def _leave_out_of_exemplars(obj):
    """Keys made by a bake are not exemplars, unless somebody says so."""
    exemplars.sync(obj)
    for block in shape_keys.baked_keys(obj):
        obj.exemplar.exemplars[block.name].enabled = False


# -------------------------------------------------------------------------------- separate objects


def _show_instead_of_result(obj):
    """Where a separate object shows the result, the mesh itself plays weights in its place."""
    result = results.shown_object(obj)
    if result is None or result == obj or not obj.exemplar.display_before:
        return
    obj.display_type, obj.hide_render = json.loads(obj.exemplar.display_before)
    result.hide_viewport = result.hide_render = True


def _show_result_again(obj):
    result = results.shown_object(obj)
    if result is None or result == obj:
        return
    obj.display_type, obj.hide_render = "WIRE", True
    result.hide_viewport = result.hide_render = False
