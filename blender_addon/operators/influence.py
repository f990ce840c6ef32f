# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours on the mesh for the influence of an exemplar."""

import bpy

from ..scene import influence
from .base import ExemplarOperator, why_not_bound


class EXEMPLAR_OT_influence_show(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.influence_show"
    bl_label = "Show Influence"
    bl_description = (
        "Colour the mesh by how much of the active exemplar each region is made of now, from blue "
        "for nothing to red for all. Press again after a change"
    )

    name: bpy.props.StringProperty(
        name="Exemplar", description="The shape key. Empty: the active one"
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        return why_not_bound(obj)

    def run(self, context, obj):
        name = self.name or (obj.active_shape_key.name if obj.active_shape_key else "")
        least, most = influence.show(obj, name)
        if context.space_data is not None and context.space_data.type == "VIEW_3D":
            context.space_data.shading.color_type = "VERTEX"
        self.report({"INFO"}, f"'{name}' has {100 * least:.0f} to {100 * most:.0f} %")


class EXEMPLAR_OT_influence_hide(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.influence_hide"
    bl_label = "Hide Influence"
    bl_description = "Take the colours of the influence away"

    def run(self, context, obj):
        influence.hide(obj)
        if context.space_data is not None and context.space_data.type == "VIEW_3D":
            if context.space_data.shading.color_type == "VERTEX":
                context.space_data.shading.color_type = "MATERIAL"


classes = (EXEMPLAR_OT_influence_show, EXEMPLAR_OT_influence_hide)
register, unregister = bpy.utils.register_classes_factory(classes)
