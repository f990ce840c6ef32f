# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lists of handlers, entered and left alike.

    TABLE = (("load_post", on_load), ...)
"""

import bpy


def add(table):
    for name, function in table:
        getattr(bpy.app.handlers, name).append(function)


def remove(table, timer):
    """What is in the table, where it is still there, and a timer that may be running."""
    for name, function in table:
        handlers = getattr(bpy.app.handlers, name)
        if function in handlers:
            handlers.remove(function)
    if bpy.app.timers.is_registered(timer):
        bpy.app.timers.unregister(timer)
