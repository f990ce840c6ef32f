# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake as shape keys: one a frame, whose value is 1 on its frame and 0 on its neighbours'.

Straight lines between the keyframes: on a baked frame one key alone counts, and between two frames
the mesh goes straight from one to the other, as in a point cache.
"""

import json

from .. import versions
from . import curves

# On the Key data-block: names of the keys that a bake made, so that the next one replaces them.
RECORD = "exemplar_baked"
# There as well: the object had no keys, and its Basis is the bake's too.
OWN_BASIS = "exemplar_own_basis"


def key_name(frame):
    return f"Exemplar {frame:04d}"


def baked_keys(obj):
    """The shape keys that an earlier bake made."""
    key = obj.data.shape_keys
    if key is None:
        return []
    names = set(json.loads(key.get(RECORD, "[]")))
    return [block for block in key.key_blocks if block.name in names]


def write(obj, frames, positions, basis):
    """Replace the keys of an earlier bake by new ones. Returns the new keys.

    positions  float32 [V][3] for each of the frames
    basis      float32 [V][3] for an object that has no keys yet
    """
    remove(obj)
    active = obj.active_shape_key_index
    if obj.data.shape_keys is None:
        block = obj.shape_key_add(name="Basis", from_mix=False)
        versions.set_key_positions(block, basis)
        obj.data.shape_keys[OWN_BASIS] = True
    key = obj.data.shape_keys
    blocks = []
    for frame, sample in zip(frames, positions):
        block = obj.shape_key_add(name=key_name(frame), from_mix=False)
        block.relative_key = key.reference_key
        versions.set_key_positions(block, sample)
        blocks.append(block)
    for number, block in enumerate(blocks):
        near = range(max(0, number - 1), min(len(frames), number + 2))
        values = [1.0 if other == number else 0.0 for other in near]
        curves.set_linear(key, block, [frames[other] for other in near], values)
        block.value = values[0] if number == 0 else 0.0
    key[RECORD] = json.dumps([block.name for block in blocks])
    obj.active_shape_key_index = active
    return blocks


def remove(obj):
    """Remove the keys of an earlier bake, and what animates them."""
    key = obj.data.shape_keys
    if key is None:
        return
    active = obj.active_shape_key.name if obj.active_shape_key else ""
    # By name: removing a key moves those behind it.
    for name in [block.name for block in baked_keys(obj)]:
        block = key.key_blocks[name]
        curves.remove(key, block)
        obj.shape_key_remove(block)
    if RECORD in key:
        del key[RECORD]
    if OWN_BASIS in key and len(key.key_blocks) == 1:
        obj.shape_key_clear()
    else:
        obj.active_shape_key_index = max(0, key.key_blocks.find(active))
