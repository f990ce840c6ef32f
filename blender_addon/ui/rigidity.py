# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigidity: how stiff the mesh is, and where."""

import bpy

from ..scene import deformers, rigs, stiffness
from .main import Section


class RigiditySection(Section):
    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        return deformers.chosen(rigs.active_rig(context)).identifier == "RIGIDITY"


class EXEMPLAR_PT_rigidity(RigiditySection, bpy.types.Panel):
    bl_label = "Rigidity"
    bl_order = 2  # after Handles, which is registered first

    def draw(self, context):
        obj = rigs.active_rig(context)
        own, layout = obj.exemplar.rigidity, self.layout
        layout.row().prop(own, "source", expand=True)
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        if own.source == "UNIFORM":
            column.prop(own, "radius")
        else:
            column.prop(own, "radius_min")
            column.prop(own, "radius_max")
            if stiffness.find_group(obj) is None:
                layout.label(text="Not painted yet: paint, fill or learn", icon="INFO")
        painting = obj.mode == "WEIGHT_PAINT"
        layout.operator(
            "exemplar.rigidity_paint",
            text="Stop Painting" if painting else "Paint",
            icon="BRUSH_DATA",
            depress=painting,
        )
        row = layout.row(align=True)
        row.prop(own, "fill_value", text="")
        row.operator("exemplar.rigidity_fill", text="Fill", icon="SNAP_FACE")
        layout.prop(own, "show_radii", icon="OVERLAY")
        if own.show_radii:
            text = f"Blue: {own.radius_min}, red: {own.radius_max} rings"
            layout.label(text=text, icon="BLANK1")


class EXEMPLAR_PT_rigidity_learn(RigiditySection, bpy.types.Panel):
    bl_label = "Learn"
    bl_parent_id = "EXEMPLAR_PT_rigidity"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own, layout = rigs.active_rig(context).exemplar.rigidity, self.layout
        layout.operator("exemplar.rigidity_learn_keys", icon="SHAPEKEY_DATA")
        layout.operator("exemplar.rigidity_learn_animation", icon="ANIM")
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(own, "animated")
        column.prop(own, "use_scene_range")
        range_ = column.column(align=True)
        if own.use_scene_range:
            range_.enabled = False
            range_.prop(context.scene, "frame_start", text="Start")
            range_.prop(context.scene, "frame_end", text="End")
        else:
            range_.prop(own, "frame_start")
            range_.prop(own, "frame_end")
        column.prop(own, "frame_step")
        column.prop(own, "omega")


classes = (EXEMPLAR_PT_rigidity, EXEMPLAR_PT_rigidity_learn)
register, unregister = bpy.utils.register_classes_factory(classes)
