# SPDX-License-Identifier: GPL-3.0-or-later
# flake8: noqa: F722, F821 (Blender's properties are calls where annotations should be)
"""How an object is baked: `Object.exemplar_bake`, and the options of the operator, which are the
same ones.
"""

import bpy

FORMATS = (
    (
        "PC2",
        "PC2 Cache",
        "A file of positions, played by a Mesh Cache modifier. Exact",
    ),
    (
        "MDD",
        "MDD Cache",
        "A file of positions that most packages read, played by a Mesh Cache modifier. Exact",
    ),
    (
        "SHAPE_KEYS",
        "Shape Keys",
        "One shape key a frame, kept in the .blend file. Exact, and large",
    ),
    (
        "WEIGHTS",
        "Weights",
        "Keyframes on the values of your own shape keys, for glTF and game engines. "
        "As near as a plain mixture of them comes; how near is reported",
    ),
)


class BakeOptions:
    """Annotations for a PropertyGroup and an Operator to share."""

    format: bpy.props.EnumProperty(
        name="Format", description="Where the baked frames go", items=FORMATS
    )
    filepath: bpy.props.StringProperty(
        name="File",
        description=(
            "The file to write; // is the folder of the .blend file. "
            "Empty: named after the object, beside the .blend file"
        ),
        subtype="FILE_PATH",
    )
    use_scene_range: bpy.props.BoolProperty(
        name="Scene Range",
        description="Bake from the scene's first frame to its last",
        default=True,
    )
    frame_start: bpy.props.IntProperty(name="Start", description="The first baked frame", default=1)
    frame_end: bpy.props.IntProperty(name="End", description="The last baked frame", default=250)
    frame_step: bpy.props.IntProperty(
        name="Step",
        description="Bake every so many frames; those between go straight from one to the next",
        default=1,
        min=1,
        soft_max=10,
    )
    use_modifier: bpy.props.BoolProperty(
        name="Modifier",
        description="Add a Mesh Cache modifier that plays the file, with or without this add-on",
        default=True,
    )
    stop_live: bpy.props.BoolProperty(
        name="Stop Live",
        description="Switch Live off after the bake: the file plays, nothing needs to be solved",
        default=True,
    )


class BakeProperties(BakeOptions, bpy.types.PropertyGroup):
    pass


classes = (BakeProperties,)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(classes)


def register():
    _register_classes()
    bpy.types.Object.exemplar_bake = bpy.props.PointerProperty(
        type=BakeProperties, name="Exemplar Bake"
    )


def unregister():
    del bpy.types.Object.exemplar_bake
    _unregister_classes()
