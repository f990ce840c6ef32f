# SPDX-License-Identifier: GPL-3.0-or-later
"""Exemplars: the list of shape keys, each with a switch."""

import bpy

from ..scene import exemplars, rigs
from .main import Section


class EXEMPLAR_UL_exemplars(bpy.types.UIList):
    """Shape keys themselves, so that the list is never out of date."""

    def draw_item(self, _context, layout, keys, key, _icon, _active, _property, index=0):
        # The list belongs to the keys; only the rig knows which of them are switched off.
        obj = rigs.rig_of(bpy.context.view_layer.objects.active)
        enabled = obj is not None and exemplars.is_enabled(obj, key.name)
        row = layout.row(align=True)
        row.label(text=key.name, icon="SHAPEKEY_DATA")
        switch = row.operator(
            "exemplar.exemplar_toggle",
            text="",
            icon="CHECKBOX_HLT" if enabled else "CHECKBOX_DEHLT",
            emboss=False,
        )
        switch.name = key.name

    def filter_items(self, _context, keys, property_name):
        obj = rigs.rig_of(bpy.context.view_layer.objects.active)
        result = obj.exemplar.result_key if obj is not None else ""
        shown = [
            self.bitflag_filter_item if key.name != result else 0
            for key in getattr(keys, property_name)
        ]
        return shown, []


class EXEMPLAR_PT_exemplars(Section, bpy.types.Panel):
    bl_label = "Exemplars"
    bl_order = 1

    def draw(self, context):
        obj = rigs.active_rig(context)
        keys = obj.data.shape_keys
        if not exemplars.all_names(obj):
            self.layout.label(text="No shape keys", icon="SHAPEKEY_DATA")
            return
        row = self.layout.row()
        row.template_list(
            "EXEMPLAR_UL_exemplars",
            "",
            keys,
            "key_blocks",
            obj,
            "active_shape_key_index",
            rows=3,
            sort_lock=True,
        )
        column = row.column(align=True)
        for icon, enabled in (("CHECKBOX_HLT", True), ("CHECKBOX_DEHLT", False)):
            switch = column.operator("exemplar.exemplar_switch_all", text="", icon=icon)
            switch.enabled = enabled


classes = (EXEMPLAR_UL_exemplars, EXEMPLAR_PT_exemplars)
register, unregister = bpy.utils.register_classes_factory(classes)
