# SPDX-License-Identifier: GPL-3.0-or-later
"""What is shown besides the mesh: of the session, not of the file."""

import bpy


class DisplayProperties(bpy.types.PropertyGroup):
    show_handles: bpy.props.BoolProperty(
        name="Handle Marks",
        description=(
            "Mark the handles in the 3D view, in front of everything: orange for pinned, "
            "blue for oriented, a grey ring for free ones"
        ),
        default=True,
    )
    show_names: bpy.props.BoolProperty(
        name="Handle Names", description="Write the names of the handles beside their marks"
    )
    show_figures: bpy.props.BoolProperty(
        name="Figures",
        description="Show how many frames a second and how many iterations a solve takes",
    )


classes = (DisplayProperties,)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(classes)


def register():
    _register_classes()
    bpy.types.WindowManager.exemplar_display = bpy.props.PointerProperty(
        type=DisplayProperties, name="Exemplar Display"
    )


def unregister():
    del bpy.types.WindowManager.exemplar_display
    _unregister_classes()
