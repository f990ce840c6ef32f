# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking: positions of a range of frames, written where they play without the add-on.

The file formats (pc2, mdd, replacing) and the least squares know nothing of Blender and can be read
and tested alone.
"""

classes = ()


def register():
    pass


def unregister():
    pass
