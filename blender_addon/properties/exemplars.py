# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shape keys are exemplars."""

import bpy

OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}


def tag_owner(properties, _context):
    """Assigned from Python, a property of an add-on wakes nobody up."""
    properties.id_data.update_tag(refresh={"OBJECT"})


class ExemplarItem(bpy.types.PropertyGroup):
    """`name` is the shape key's; a key without an item counts as switched on."""

    enabled: bpy.props.BoolProperty(
        name="Exemplar",
        description="Use this shape key as an exemplar. Takes effect at the next Bind",
        default=True,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    # Tells a renamed key from a new one.
    index: bpy.props.IntProperty(options={"HIDDEN"}, override=OVERRIDABLE)


classes = (ExemplarItem,)
register, unregister = bpy.utils.register_classes_factory(classes)
