# SPDX-License-Identifier: GPL-3.0-or-later
"""Pose: how the mesh follows, and shortcuts for the handles."""

import bpy

from ..scene import deformers, rigs
from . import settings
from .main import Section


class EXEMPLAR_PT_pose(Section, bpy.types.Panel):
    bl_label = "Pose"
    bl_order = 4

    def draw(self, context):
        obj = rigs.active_rig(context)
        rig, layout = obj.exemplar, self.layout
        layout.active = rig.bound
        row = layout.row(align=True)
        row.prop(rig, "live", toggle=True, icon="PLAY")
        row.operator("exemplar.update", text="", icon="FILE_REFRESH")
        layout.menu("EXEMPLAR_MT_presets", icon="PRESET")
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        settings.of(deformers.current(obj)).draw_pose(column, obj)
        column = layout.column(align=True)
        column.operator("exemplar.pose_to_exemplar", icon="SHAPEKEY_DATA")
        column.operator("exemplar.pose_reset", icon="LOOP_BACK")
        column.operator("exemplar.pose_mirror", icon="MOD_MIRROR")
        column = layout.column(align=True)
        column.operator("exemplar.key_all", icon="KEY_HLT")
        column.operator("exemplar.result_to_key", icon="ADD")


class EXEMPLAR_PT_pose_advanced(Section, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "EXEMPLAR_PT_pose"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        obj = rigs.active_rig(context)
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings.of(deformers.current(obj)).draw_advanced(layout, obj)


classes = (EXEMPLAR_PT_pose, EXEMPLAR_PT_pose_advanced)
register, unregister = bpy.utils.register_classes_factory(classes)
