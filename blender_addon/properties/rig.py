# SPDX-License-Identifier: GPL-3.0-or-later
"""The state of one mesh object: `Object.exemplar`."""

import bpy

from ..scene.deformers import TYPES
from .amrap import AmrapProperties
from .blended import BlendedProperties
from .exemplars import OVERRIDABLE, ExemplarItem, tag_owner
from .handles import HandleItem
from .rigidity import RigidityProperties

COLLECTION = {"LIBRARY_OVERRIDABLE", "USE_INSERTION"}
TARGETS = (
    ("KEY", "Shape Key", "Show the result in a shape key of its own on this mesh"),
    ("OBJECT", "Separate Object", "Show the result on a copy of this mesh that has no shape keys"),
)


class RigProperties(bpy.types.PropertyGroup):
    exemplars: bpy.props.CollectionProperty(type=ExemplarItem, override=COLLECTION)
    handles: bpy.props.CollectionProperty(type=HandleItem, override=COLLECTION)
    handle_index: bpy.props.IntProperty(
        name="Handle", description="The handle that the buttons are about", options=set()
    )

    live: bpy.props.BoolProperty(
        name="Live",
        description="The mesh follows its handles at once, in the viewport and in renders",
        default=True,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    target: bpy.props.EnumProperty(
        name="Show Result In",
        description="Where the posed mesh is shown. Your own shape keys are never changed",
        items=TARGETS,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    deformer: bpy.props.EnumProperty(
        name="Deformer",
        description="How the mesh follows its handles. Takes effect at the next Bind",
        items=[(type_.identifier, type_.label, type_.description) for type_ in TYPES.values()],
        default="AMRAP",
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    amrap: bpy.props.PointerProperty(type=AmrapProperties, override=OVERRIDABLE)
    blended: bpy.props.PointerProperty(type=BlendedProperties, override=OVERRIDABLE)
    rigidity: bpy.props.PointerProperty(type=RigidityProperties, override=OVERRIDABLE)

    bound: bpy.props.BoolProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    uuid: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    # JSON: what the deformer was bound to, in digests (scene/fingerprint.py).
    fingerprint: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    bound_target: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    result_key: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    result_object: bpy.props.PointerProperty(
        type=bpy.types.Object, options={"HIDDEN"}, override=OVERRIDABLE
    )
    # What Unbind gives back to the mesh object when a separate object showed the result.
    display_before: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    # Driven by the empties, to no effect of its own (scene/follow.py).
    follow: bpy.props.FloatProperty(options={"HIDDEN", "ANIMATABLE"}, override=OVERRIDABLE)


classes = (RigProperties,)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(classes)


def register():
    _register_classes()
    bpy.types.Object.exemplar = bpy.props.PointerProperty(
        type=RigProperties, name="Exemplar", override=OVERRIDABLE
    )


def unregister():
    del bpy.types.Object.exemplar
    _unregister_classes()
