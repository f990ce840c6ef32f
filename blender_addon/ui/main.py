# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel itself: whose it is, and the status line."""

import bpy

from ..scene import rigs, status
from ..scene.sequences import owners
from .text import sentence


class SidebarPanel:
    """The sections are read from top to bottom, in the order of work."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Exemplar"


class Section(SidebarPanel):
    bl_parent_id = "EXEMPLAR_PT_main"

    @classmethod
    def poll(cls, context):
        is_rig = rigs.active_rig(context) is not None and owners.active(context) is None
        return is_rig and not status.library_problem()


class EXEMPLAR_PT_main(SidebarPanel, bpy.types.Panel):
    bl_label = "Exemplar"

    @classmethod
    def poll(cls, context):
        # A sequence has a panel of its own.
        return owners.active(context) is None

    def draw(self, context):
        layout = self.layout
        obj = rigs.active_rig(context)
        if obj is not None:
            layout.label(text=obj.name, icon="OUTLINER_OB_MESH")
        box = layout.box()
        lines = status.describe(obj)
        for line in lines:
            sentence(box, context, line.text, line.icon)
        if obj is not None and len(status.problem_vertices(obj)):
            box.operator("exemplar.select_problem", icon="RESTRICT_SELECT_OFF")
        if Section.poll(context):
            layout.prop(obj.exemplar, "deformer", text="")


classes = (EXEMPLAR_PT_main,)
register, unregister = bpy.utils.register_classes_factory(classes)
