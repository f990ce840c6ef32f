# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that knows how Blender 3.4 to 5.2 differ, and what is fast in each.

No address is ever kept: undo, edit mode and implicit sharing move arrays.
"""

import ctypes

import bpy
import numpy

POSITIONS_ARE_ATTRIBUTES = bpy.app.version >= (3, 5, 0)


def set_mesh_positions(mesh, positions):
    """positions float32 [V][3], contiguous. The caller tags the mesh."""
    if POSITIONS_ARE_ATTRIBUTES:
        mesh.attributes["position"].data.foreach_set("vector", positions.ravel())
    else:
        mesh.vertices.foreach_set("co", positions.ravel())


def get_mesh_positions(mesh):
    positions = numpy.empty((len(mesh.vertices), 3), numpy.float32)
    if POSITIONS_ARE_ATTRIBUTES:
        mesh.attributes["position"].data.foreach_get("vector", positions.ravel())
    else:
        mesh.vertices.foreach_get("co", positions.ravel())
    return positions


def key_size(key_block):
    return len(key_block.data)


def set_key_positions(key_block, positions):
    """positions float32 [V][3], contiguous. The caller tags the mesh."""
    address = _key_address(key_block)
    if address:
        ctypes.memmove(address, positions.ctypes.data, positions.nbytes)
    else:
        _key_points(key_block).foreach_set("co", positions.ravel())


def get_key_positions(key_block):
    positions = numpy.empty((key_size(key_block), 3), numpy.float32)
    address = _key_address(key_block)
    if address:
        ctypes.memmove(positions.ctypes.data, address, positions.nbytes)
    else:
        _key_points(key_block).foreach_get("co", positions.ravel())
    return positions


def _key_points(key_block):
    return key_block.points if hasattr(key_block, "points") else key_block.data


def _key_address(key_block):
    """Where the key's coordinates are, or None where there is no need to know.

    Before there was `points`, foreach_set called a function for each point: 2 to 3 ms at 50k
    vertices, more than the solve. And where the mesh is linked, as under a library override, later
    Blenders pass over foreach_set without a word. The points are plain float[3], and are so only if
    the first and the last are as far apart as that makes them.
    """
    if hasattr(key_block, "points") and key_block.id_data.library is None:
        return None
    points = _key_points(key_block)
    count = len(points)
    if not count:
        return None
    first, last = points[0].as_pointer(), points[count - 1].as_pointer()
    return first if last - first == 12 * (count - 1) else None
