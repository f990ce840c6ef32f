# SPDX-License-Identifier: GPL-3.0-or-later
"""Bind: where the result is shown, and the buttons."""

import bpy

from ..scene import deformers, rigs
from . import settings
from .main import Section


class EXEMPLAR_PT_bind(Section, bpy.types.Panel):
    bl_label = "Bind"
    bl_order = 3

    def draw(self, context):
        obj = rigs.active_rig(context)
        layout = self.layout
        column = layout.column()
        column.label(text="Show Result In")
        column.prop(obj.exemplar, "target", text="")
        if not obj.exemplar.bound:
            row = layout.row()
            row.scale_y = 1.4
            row.operator("exemplar.bind", icon="LINKED")
            return
        row = layout.row(align=True)
        row.operator("exemplar.rebind", icon="FILE_REFRESH")
        row.operator("exemplar.unbind", icon="UNLINKED")


class EXEMPLAR_PT_bind_advanced(Section, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "EXEMPLAR_PT_bind"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        obj = rigs.active_rig(context)
        settings.of(deformers.chosen(obj)).draw_bind(layout, obj)


classes = (EXEMPLAR_PT_bind, EXEMPLAR_PT_bind_advanced)
register, unregister = bpy.utils.register_classes_factory(classes)
