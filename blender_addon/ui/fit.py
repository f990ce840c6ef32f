# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit: the scan, the landmarks, the button."""

import bpy

from ..scene import rigs
from .main import Section, SidebarPanel
from .text import sentence


class EXEMPLAR_UL_landmarks(bpy.types.UIList):
    bl_idname = "EXEMPLAR_UL_landmarks"

    def draw_item(self, _context, layout, _data, item, _icon, _active, _property, _index):
        row = layout.row(align=True)
        # The residual is worth two digits, and less room than the name.
        columns = row.split(factor=0.65, align=True) if item.residual >= 0 else row
        icon = "EMPTY_AXIS" if item.empty else "NONE"
        columns.prop(item, "name", text="", emboss=False, icon=icon)
        if item.residual >= 0:
            columns.label(text=f"{item.residual:.1g}")
        row.prop(item, "is_ambiguous", text="", icon="QUESTION", emboss=item.is_ambiguous)


class EXEMPLAR_PT_fit(SidebarPanel, bpy.types.Panel):
    bl_label = "Fit to Scan"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return Section.poll(context)

    def draw(self, context):
        own, layout = rigs.active_rig(context).exemplar_fit, self.layout
        layout.prop(own, "scan")
        layout.label(text="Landmarks")
        row = layout.row()
        row.template_list(
            "EXEMPLAR_UL_landmarks", "", own, "landmarks", own, "landmark_index", rows=3
        )
        column = row.column(align=True)
        column.operator("exemplar.fit_landmark_remove", text="", icon="REMOVE")
        column.operator("exemplar.fit_landmark_remove", text="", icon="TRASH").everything = True
        layout.operator("exemplar.fit_pick", icon="RESTRICT_SELECT_OFF")
        row = layout.row(align=True)
        row.operator("exemplar.fit_from_names")
        row.operator("exemplar.fit_from_handles")
        if own.landmarks:
            _draw_active(layout, own)
        layout.operator("exemplar.fit_match", icon="QUESTION")
        column = _properties(layout)
        column.prop(own, "place")
        column.prop(own, "find_scale")
        column.prop(own, "finish")
        layout.operator("exemplar.fit", icon="MOD_SHRINKWRAP")
        if own.message:
            icon = "ERROR" if own.is_doubtful else "CHECKMARK"
            sentence(layout.box(), context, own.message, icon)


def _draw_active(layout, own):
    item = own.landmarks[min(own.landmark_index, len(own.landmarks) - 1)]
    column = _properties(layout)
    column.prop(item, "empty")
    column.prop(item, "vertex")


def _properties(layout):
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    return column


class EXEMPLAR_PT_fit_advanced(SidebarPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "EXEMPLAR_PT_fit"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own = rigs.active_rig(context).exemplar_fit
        column = _properties(self.layout)
        row = column.row()
        row.enabled = own.finish
        row.prop(own, "detail")
        column.prop(own, "reach")
        column.prop(own, "disc_radius")
        column.prop(own, "use_colours")
        column.prop(own, "use_matches")


class EXEMPLAR_PT_fit_frames(SidebarPanel, bpy.types.Panel):
    bl_label = "Frames"
    bl_parent_id = "EXEMPLAR_PT_fit"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own = rigs.active_rig(context).exemplar_fit
        column = _properties(self.layout)
        column.prop(own, "use_scene_range")
        frames = column.column(align=True)
        if own.use_scene_range:
            frames.enabled = False
            frames.prop(context.scene, "frame_start", text="Start")
            frames.prop(context.scene, "frame_end", text="End")
        else:
            frames.prop(own, "frame_start")
            frames.prop(own, "frame_end")
        column.prop(own, "frame_step")
        column.prop(own, "filepath")
        self.layout.operator("exemplar.fit_sequence", icon="RENDER_ANIMATION")


classes = (
    EXEMPLAR_UL_landmarks,
    EXEMPLAR_PT_fit,
    EXEMPLAR_PT_fit_advanced,
    EXEMPLAR_PT_fit_frames,
)
register, unregister = bpy.utils.register_classes_factory(classes)
