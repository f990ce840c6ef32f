# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles: the list, and the handle that is chosen in it."""

import bpy

from ..scene import handles, rigs
from .main import Section

ICONS = {"PINNED": "SPHERE", "ORIENTED": "EMPTY_ARROWS", "FREE": "EMPTY_AXIS"}


class EXEMPLAR_UL_handles(bpy.types.UIList):
    def draw_item(self, _context, layout, _rig, item, _icon, _active, _property, index=0):
        row = layout.row(align=True)
        if handles.is_missing(item):
            row.alert = True
            row.label(text=f"{handles.label(item)} (deleted)", icon="ERROR")
        else:
            row.prop(item.empty, "name", text="", icon=ICONS[item.kind], emboss=False)

    def filter_items(self, _context, rig, property_name):
        items = getattr(rig, property_name)
        wanted = self.filter_name.lower()
        shown = [
            self.bitflag_filter_item if wanted in handles.label(item).lower() else 0
            for item in items
        ]
        return shown, []


class EXEMPLAR_PT_handles(Section, bpy.types.Panel):
    bl_label = "Handles"
    bl_order = 2

    def draw(self, context):
        obj = rigs.active_rig(context)
        rig, layout = obj.exemplar, self.layout
        row = layout.row()
        row.template_list("EXEMPLAR_UL_handles", "", rig, "handles", rig, "handle_index", rows=3)
        column = row.column(align=True)
        column.operator("exemplar.handle_remove", text="", icon="REMOVE")
        column.operator("exemplar.handle_select", text="", icon="RESTRICT_SELECT_OFF")
        column.operator("exemplar.handle_mirror", text="", icon="MOD_MIRROR")
        # One under the other: side by side they are cut off in a narrow sidebar.
        buttons = layout.column(align=True)
        buttons.operator("exemplar.handle_add", icon="ADD")
        buttons.operator("exemplar.quick_rig", icon="OUTLINER_OB_ARMATURE")
        if 0 <= rig.handle_index < len(rig.handles):
            column = layout.column()
            column.use_property_split = True
            column.use_property_decorate = False
            column.prop(rig.handles[rig.handle_index], "kind")
            column.prop(rig.handles[rig.handle_index], "radius")


classes = (EXEMPLAR_UL_handles, EXEMPLAR_PT_handles)
register, unregister = bpy.utils.register_classes_factory(classes)
