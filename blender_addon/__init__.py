# SPDX-License-Identifier: GPL-3.0-or-later
"""Exemplar: pose a mesh inside the space of its shape keys by dragging handles.

Calls go one way: ui -> operators -> properties, scene -> native.
"""

import importlib
import sys

bl_info = {
    "name": "Exemplar",
    "author": "The Exemplar authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Exemplar",
    "description": "Pose a mesh inside the space of its shape keys by dragging handles",
    "category": "Animation",
}

# In the order of registration: a class comes after those that it names.
MODULES = (
    "properties.exemplars",
    "properties.handles",
    "properties.amrap",
    "properties.blended",
    "properties.rigidity",
    "properties.rig",
    "properties.bake",
    "properties.display",
    "properties.sequence",
    "properties.fit",
    "operators.exemplars",
    "operators.handles",
    "operators.quick_rig",
    "operators.bind",
    "operators.pose",
    "operators.rigidity",
    "operators.blended",
    "operators.presets",
    "operators.influence",
    "operators.bake",
    "operators.sequence",
    "operators.sequence_edit",
    "operators.sequence_time",
    "operators.sequence_shapes",
    "operators.fit_landmarks",
    "operators.fit",
    "ui.main",
    "ui.exemplars",
    "ui.handles",
    "ui.rigidity",
    "ui.bind",
    "ui.pose",
    "ui.blended",
    "ui.presets",
    "ui.bake",
    "ui.fit",
    "ui.fit_marks",
    "ui.sequence",
    "ui.pose_space",
    "ui.heat",
    "ui.display",
    "ui.handle_marks",
    "scene.live",
    "scene.sequences.live",
)


# Reload Scripts runs this file again and nothing else of ours: the rest must not stay as it was.
for _name in [name for name in sys.modules if name.startswith(f"{__name__}.")]:
    del sys.modules[_name]


def _modules():
    return [importlib.import_module(f".{name}", __package__) for name in MODULES]


def register():
    """All of it or nothing: a class that stays behind would be in the way of the next attempt.

    The native library is not needed for this. While it is missing, the panel says so.
    """
    done = []
    try:
        for module in _modules():
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister():
    for module in reversed(_modules()):
        module.unregister()
