# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences: a panel of their own below the deformers', in the order of work."""

import bpy

from ..scene import status
from ..scene.baking import playback
from ..scene.sequences import capture, owners, retiming, transfer, words
from .main import SidebarPanel
from .text import sentence


class EXEMPLAR_PT_sequence(SidebarPanel, bpy.types.Panel):
    bl_label = "Sequence"
    bl_order = 10

    @classmethod
    def poll(cls, context):
        obj = context.view_layer.objects.active
        shown = obj is not None and (obj.type in capture.TYPES or owners.owner_of(obj) is not None)
        return shown and not status.library_problem()

    def draw(self, context):
        layout = self.layout
        owner = owners.active(context)
        if owner is None:
            self._draw_capture(context, context.view_layer.objects.active)
            return
        layout.label(text=owner.name, icon="SEQUENCE")
        box = layout.box()
        for line in words.describe(owner):
            sentence(box, context, line.text, line.icon)
        data = owner.exemplar_sequence
        row = layout.row(align=True)
        row.prop(data, "live", toggle=True, icon="PLAY")
        row.operator("exemplar.sequence_update", text="", icon="FILE_REFRESH")
        row = layout.row(align=True)
        row.prop(data, "follow", expand=True)

    def _draw_capture(self, context, obj):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        error = status.last_error(obj)
        if error is not None:
            sentence(layout.box(), context, str(error), "ERROR")
        settings = obj.exemplar_capture
        draw_range(layout, settings, context.scene)
        layout.prop(settings, "use_world_space")
        draw_fit(layout, settings)
        row = layout.row()
        row.scale_y = 1.4
        row.operator("exemplar.sequence_capture", icon="REC")
        if obj.type == "MESH" and obj.data.shape_keys is not None:
            layout.operator("exemplar.sequence_from_keys", icon="SHAPEKEY_DATA")


def draw_range(layout, settings, scene):
    layout.prop(settings, "use_scene_range")
    column = layout.column(align=True)
    if settings.use_scene_range:
        column.enabled = False
        column.prop(scene, "frame_start", text="Start")
        column.prop(scene, "frame_end", text="End")
    else:
        column.prop(settings, "frame_start")
        column.prop(settings, "frame_end")
    layout.prop(settings, "frame_step")


def draw_fit(layout, settings):
    column = layout.column()
    column.prop(settings, "shape_space")
    column.prop(settings, "fidelity")
    if settings.fidelity == "TOLERANCE":
        column.prop(settings, "tolerance")
    elif settings.fidelity == "COUNTS":
        column.prop(settings, "control_points")
        column.prop(settings, "poses")
        column.prop(settings, "shapes", text="Shape Count")
    column.prop(settings, "cyclic")


class SequenceSection(SidebarPanel):
    bl_parent_id = "EXEMPLAR_PT_sequence"

    @classmethod
    def poll(cls, context):
        return owners.active(context) is not None


class EXEMPLAR_PT_sequence_time(SequenceSection, bpy.types.Panel):
    bl_label = "Time"
    bl_order = 1

    def draw(self, context):
        owner = owners.active(context)
        data, layout = owner.exemplar_sequence, self.layout
        layout.active = data.follow == "TIME"
        row = layout.row()
        row.use_property_split = True
        row.prop(data, "time")
        if retiming.curve_of(owner) is not None:
            layout.label(text="Its curve is in the Graph Editor.", icon="GRAPH")
        row = layout.row(align=True)
        row.operator("exemplar.sequence_speed", text="Half").factor = 0.5
        row.operator("exemplar.sequence_speed", text="Twice").factor = 2.0
        layout.operator("exemplar.sequence_play_as_captured", icon="LOOP_BACK")
        rate = retiming.scene_frame_rate(context.scene)
        if abs(rate - data.fps) > 1e-3:
            text = f"Convert from {data.fps:g} to {rate:g} fps"
            layout.operator("exemplar.sequence_frame_rate", text=text, icon="TIME")
        layout.operator("exemplar.sequence_loop", icon="FILE_REFRESH")


class EXEMPLAR_PT_sequence_space(SequenceSection, bpy.types.Panel):
    bl_label = "Pose Space"
    bl_order = 2

    def draw(self, context):
        owner = owners.active(context)
        data, layout = owner.exemplar_sequence, self.layout
        column = layout.column(align=True)
        for part, icon in (
            (data.curve, "CURVE_BEZCURVE"),
            (data.marks, "STICKY_UVS_DISABLE"),
            (data.playhead, "SPHERE"),
        ):
            if part is not None:
                select = column.operator("exemplar.sequence_select", text=part.name, icon=icon)
                select.name = part.name
        row = layout.row(align=True)
        row.operator("exemplar.sequence_pin", text="Pin", icon="PINNED")
        row.operator("exemplar.sequence_unpin", text="Unpin", icon="UNPINNED")
        layout.operator("exemplar.sequence_playhead_to_time", icon="EMPTY_AXIS")
        layout.operator("exemplar.sequence_new_shape", icon="ADD")
        layout.operator("exemplar.sequence_draw", icon="GREASEPENCIL")
        layout.operator("exemplar.sequence_reset_curve", icon="LOOP_BACK")
        row = layout.row(align=True)
        row.prop(data, "show_curve", toggle=True)
        row.prop(data, "show_shapes", toggle=True)
        row = layout.row()
        row.active = data.show_shapes
        row.prop(data, "shape_count")


class EXEMPLAR_PT_sequence_transfer(SequenceSection, bpy.types.Panel):
    bl_label = "Transfer"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        chosen = context.scene.exemplar_transfer
        layout.prop(chosen, "examples")
        layout.prop(chosen, "target")
        if chosen.examples is not None and chosen.target is not None:
            names = transfer.pairs(chosen.examples, chosen.target)
            sentence(layout, context, f"{len(names)} poses match.", "INFO")
        layout.operator_menu_enum("exemplar.sequence_transfer", "shape_space", icon="ARMATURE_DATA")


class EXEMPLAR_PT_sequence_fit(SequenceSection, bpy.types.Panel):
    bl_label = "Capture Again"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        owner = owners.active(context)
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(owner.exemplar_sequence, "source")
        draw_range(layout, owner.exemplar_capture, context.scene)
        draw_fit(layout, owner.exemplar_capture)
        layout.operator("exemplar.sequence_refit", icon="REC")
        layout.operator("exemplar.sequence_remove", icon="X")


class EXEMPLAR_PT_sequence_bake(SequenceSection, bpy.types.Panel):
    bl_label = "Bake"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        owner = owners.active(context)
        settings, layout = owner.exemplar_bake, self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "format")
        if settings.format in ("PC2", "MDD"):
            layout.prop(settings, "filepath")
            layout.prop(settings, "use_modifier")
            layout.prop(settings, "stop_live")
        draw_range(layout, settings, context.scene)
        layout.operator("exemplar.bake", icon="FILE_CACHE")
        if playback.is_baked(owner):
            layout.operator("exemplar.bake_remove", icon="X")


classes = (
    EXEMPLAR_PT_sequence,
    EXEMPLAR_PT_sequence_time,
    EXEMPLAR_PT_sequence_space,
    EXEMPLAR_PT_sequence_transfer,
    EXEMPLAR_PT_sequence_fit,
    EXEMPLAR_PT_sequence_bake,
)
register, unregister = bpy.utils.register_classes_factory(classes)
