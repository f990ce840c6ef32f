# SPDX-License-Identifier: GPL-3.0-or-later
"""The menus of presets; the section Pose shows the first."""

import bpy

from ..scene import presets


class EXEMPLAR_MT_presets_remove(bpy.types.Menu):
    bl_label = "Remove Preset"

    def draw(self, _context):
        for name in presets.saved_names():
            self.layout.operator("exemplar.preset_remove", text=name).name = name


class EXEMPLAR_MT_presets(bpy.types.Menu):
    bl_label = "Presets"
    bl_description = "Settings of the deformer under a name"

    def draw(self, _context):
        layout = self.layout
        for name in presets.OWN:
            layout.operator("exemplar.preset_apply", text=name).name = name
        saved = presets.saved_names()
        if saved:
            layout.separator()
        for name in saved:
            layout.operator("exemplar.preset_apply", text=name, icon="USER").name = name
        layout.separator()
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator("exemplar.preset_save", text="Save Preset...", icon="ADD")
        if saved:
            layout.menu("EXEMPLAR_MT_presets_remove", icon="REMOVE")


classes = (EXEMPLAR_MT_presets_remove, EXEMPLAR_MT_presets)
register, unregister = bpy.utils.register_classes_factory(classes)
