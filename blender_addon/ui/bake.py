# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake: what to make, which frames, and the button."""

import bpy

from ..scene import rigs
from ..scene.baking import playback
from .main import Section


class EXEMPLAR_PT_bake(Section, bpy.types.Panel):
    bl_label = "Bake"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        obj = rigs.active_rig(context)
        settings = obj.exemplar_bake
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "format")
        if settings.format in ("PC2", "MDD"):
            layout.prop(settings, "filepath")
            layout.prop(settings, "use_modifier")
            layout.prop(settings, "stop_live")
        _draw_frames(layout, settings, context.scene)
        layout.operator("exemplar.bake", icon="FILE_CACHE")
        if obj.exemplar.bound and playback.is_baked(obj):
            if obj.exemplar.live:
                layout.label(text="The bake hides the live result.", icon="INFO")
            layout.operator("exemplar.bake_remove", icon="X")


def _draw_frames(layout, settings, scene):
    layout.prop(settings, "use_scene_range")
    column = layout.column(align=True)
    if settings.use_scene_range:
        # Shown, so that nobody has to look them up; changed where the scene has them.
        column.enabled = False
        column.prop(scene, "frame_start", text="Start")
        column.prop(scene, "frame_end", text="End")
    else:
        column.prop(settings, "frame_start")
        column.prop(settings, "frame_end")
    layout.prop(settings, "frame_step")


classes = (EXEMPLAR_PT_bake,)
register, unregister = bpy.utils.register_classes_factory(classes)
