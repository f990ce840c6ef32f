# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply, save and remove presets of settings."""

import bpy

from ..scene import presets
from .base import ExemplarOperator, why_linked


class PresetOperator(ExemplarOperator):
    name: bpy.props.StringProperty(name="Name", description="The name of the preset")

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj)


class EXEMPLAR_OT_preset_apply(PresetOperator, bpy.types.Operator):
    bl_idname = "exemplar.preset_apply"
    bl_label = "Apply Preset"
    bl_description = "Set the deformer and its settings to those of this preset"

    def run(self, _context, obj):
        presets.apply(obj, self.name)


class EXEMPLAR_OT_preset_save(PresetOperator, bpy.types.Operator):
    bl_idname = "exemplar.preset_save"
    bl_label = "Save Preset"
    bl_description = "Keep the present settings of the deformer under a name, for all your files"

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def run(self, _context, obj):
        presets.save(obj, self.name)
        self.report({"INFO"}, f"Saved as preset '{self.name.strip()}'")


class EXEMPLAR_OT_preset_remove(PresetOperator, bpy.types.Operator):
    bl_idname = "exemplar.preset_remove"
    bl_label = "Remove Preset"
    bl_description = "Delete this preset of yours from the disk"

    def run(self, _context, _obj):
        presets.remove(self.name)


classes = (EXEMPLAR_OT_preset_apply, EXEMPLAR_OT_preset_save, EXEMPLAR_OT_preset_remove)
register, unregister = bpy.utils.register_classes_factory(classes)
