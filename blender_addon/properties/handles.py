# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles: an empty, a vertex group and what the one does to the other."""

import bpy

from .exemplars import OVERRIDABLE, tag_owner

KINDS = (
    ("PINNED", "Pinned", "The mesh follows the place of the empty", "SPHERE", 0),
    (
        "ORIENTED",
        "Oriented",
        "The mesh follows the place, the rotation and the scale of the empty",
        "EMPTY_ARROWS",
        1,
    ),
    (
        "FREE",
        "Free",
        "The mesh does not follow the empty; the handle gives it more freedom to deform",
        "EMPTY_AXIS",
        2,
    ),
)
DISPLAY = {"PINNED": "SPHERE", "ORIENTED": "ARROWS", "FREE": "PLAIN_AXES"}


def show_kind(item, context):
    if item.empty is not None:
        item.empty.empty_display_type = DISPLAY[item.kind]
    tag_owner(item, context)


def is_mesh(_item, obj):
    return obj.type == "MESH"


class HandleItem(bpy.types.PropertyGroup):
    empty: bpy.props.PointerProperty(
        name="Empty",
        description="The empty that moves this handle",
        type=bpy.types.Object,
        override=OVERRIDABLE,
    )
    group: bpy.props.StringProperty(
        name="Vertex Group",
        description="The vertices of this handle",
        override=OVERRIDABLE,
    )
    # Tells a renamed vertex group from one that was removed.
    group_index: bpy.props.IntProperty(default=-1, options={"HIDDEN"}, override=OVERRIDABLE)
    kind: bpy.props.EnumProperty(
        name="Kind",
        description="What of its empty the mesh follows. Takes effect at the next Bind",
        items=KINDS,
        default="PINNED",
        options=set(),
        override=OVERRIDABLE,
        update=show_kind,
    )
    radius: bpy.props.FloatProperty(
        name="Radius",
        description=(
            "Grow the handle by this distance along the surface. "
            "0: only the vertices of its group. Takes effect at the next Bind"
        ),
        min=0.0,
        subtype="DISTANCE",
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )

    shape: bpy.props.PointerProperty(
        name="Shape",
        description=(
            "A mesh whose edges are drawn at this handle, as large as the empty. "
            "It needs not be in the scene"
        ),
        type=bpy.types.Object,
        poll=is_mesh,
        override=OVERRIDABLE,
    )
    # As they were at Bind: the deformer knows only these.
    bound_index: bpy.props.IntProperty(default=-1, options={"HIDDEN"}, override=OVERRIDABLE)
    bound_kind: bpy.props.IntProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    bound_radius: bpy.props.FloatProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    # Linear part of the empty in the mesh's space when the handle is at rest.
    rest: bpy.props.FloatVectorProperty(
        size=9, default=(1, 0, 0, 0, 1, 0, 0, 0, 1), options={"HIDDEN"}, override=OVERRIDABLE
    )


classes = (HandleItem,)
register, unregister = bpy.utils.register_classes_factory(classes)
