# SPDX-License-Identifier: GPL-3.0-or-later
"""The fits of many frames as a PC2 cache, played by an object of their own."""

import bpy

from ...native import ExemplarError
from ..baking import mesh_cache, pc2
from ..baking.bakers import absolute_path
from . import outputs


def path(obj):
    """Where the cache goes, absolute. Raises where that is not known yet."""
    return absolute_path(_stored(obj))


def write(obj, absolute, numbers, positions):
    """positions float32 [n][V][3] of frames `numbers`, a range. The file appears when it is
    whole, and before the scene is changed."""
    header = pc2.Header(positions.shape[1], len(positions), numbers.start, numbers.step)
    with pc2.writer(absolute, header) as file:
        for sample in positions:
            file.append(sample)
        file.finish()
    shown = outputs.write_object(obj, positions[0], f"{obj.name} Fits")
    mesh_cache.set_up(shown, _stored(obj), "PC2", numbers)
    return shown


def _stored(obj):
    given = obj.exemplar_fit.filepath
    if not given:
        return f"//{bpy.path.clean_name(obj.name)}_fits.pc2"
    if given.endswith(("/", "\\")):
        raise ExemplarError(f"{given} is a folder. Give the file a name.")
    return given if given.lower().endswith(".pc2") else f"{given}.pc2"
