# SPDX-License-Identifier: GPL-3.0-or-later
"""Add, remove, select and change handles."""

import bpy

from ..scene import handle_editing, rigs, status
from .base import ExemplarOperator, why_linked

KINDS = (
    ("PINNED", "Pinned", "The mesh follows the place of the empty"),
    ("ORIENTED", "Oriented", "The mesh follows the place, the rotation and the scale of the empty"),
    ("FREE", "Free", "The mesh does not follow the empty, and has more freedom to deform there"),
)


def why_no_handle(obj):
    return "" if obj.exemplar.handles else "There are no handles yet. Add one from vertices"


def active_handle(obj):
    handles = obj.exemplar.handles
    return handles[min(max(obj.exemplar.handle_index, 0), len(handles) - 1)]


class EXEMPLAR_OT_handle_add(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.handle_add"
    bl_label = "Add Handle"
    bl_description = (
        "Make a handle of the selected vertices: an empty at their centre that moves them"
    )

    kind: bpy.props.EnumProperty(name="Kind", description="What the mesh follows", items=KINDS)

    @classmethod
    def why_not(cls, context, obj):
        if context.view_layer.objects.active != obj:
            return "Select the mesh: a handle is made of its vertices"
        if obj.mode not in {"EDIT", "OBJECT"}:
            return "Go to Edit Mode and select the vertices of the handle"
        return why_linked(obj)

    def run(self, context, obj):
        context.view_layer.update()
        item = handle_editing.add(obj, handle_editing.selected_vertices(obj), self.kind)
        if obj.exemplar.bound:
            self.report({"INFO"}, f"'{item.empty.name}' was added. Press Rebind to use it")


class EXEMPLAR_OT_handle_remove(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.handle_remove"
    bl_label = "Remove Handle"
    bl_description = "Remove the handle of the list, its empty and its vertex group"

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj) or why_no_handle(obj)

    def run(self, context, obj):
        item = active_handle(obj)
        if context.view_layer.objects.active == item.empty:
            # The panel is about the active object; with the empty gone it would have none.
            context.view_layer.objects.active = obj
        handle_editing.remove(obj, item)


class EXEMPLAR_OT_handle_select(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.handle_select"
    bl_label = "Select Empty"
    bl_description = "Select the empty of the handle of the list, ready to be moved"

    extend: bpy.props.BoolProperty(
        name="Extend", description="Keep what is selected", options={"SKIP_SAVE"}
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Empties are selected in Object Mode"
        if not obj.exemplar.handles:
            return why_no_handle(obj)
        empty = active_handle(obj).empty
        if empty is None or context.view_layer.objects.get(empty.name) != empty:
            return "The empty of this handle is not in this view layer"
        return "" if empty.visible_get() else "The empty of this handle is hidden"

    def run(self, context, obj):
        empty = active_handle(obj).empty
        if not self.extend:
            for other in context.selected_objects:
                other.select_set(False)
        empty.select_set(True)
        context.view_layer.objects.active = empty


class EXEMPLAR_OT_handle_kind(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.handle_kind"
    bl_label = "Set Kind"
    bl_description = (
        "Change the kind of all handles whose empties are selected, or else of the one in the "
        "list. Takes effect at the next Bind"
    )

    kind: bpy.props.EnumProperty(name="Kind", description="What the mesh follows", items=KINDS)

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj) or why_no_handle(obj)

    def run(self, context, obj):
        chosen = set(context.selected_objects)
        items = [item for item in obj.exemplar.handles if item.empty in chosen]
        for item in items or [active_handle(obj)]:
            item.kind = self.kind


class EXEMPLAR_OT_select_problem(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.select_problem"
    bl_label = "Select Vertices at Fault"
    bl_description = "Enter Edit Mode with the vertices selected that the message is about"

    @classmethod
    def why_not(cls, _context, obj):
        if not len(status.problem_vertices(obj)):
            return "There are no vertices at fault"
        return ""

    def execute(self, context):
        # Unlike the others it keeps the message, which is about what it shows.
        obj = rigs.active_rig(context)
        vertices = status.problem_vertices(obj)
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        for other in context.selected_objects:
            other.select_set(False)
        obj.hide_set(False)
        obj.select_set(True)
        context.view_layer.objects.active = obj
        handle_editing.select_vertices(obj, vertices)
        bpy.ops.object.mode_set(mode="EDIT")
        context.tool_settings.mesh_select_mode = (True, False, False)
        self.report({"INFO"}, f"{len(vertices)} vertices selected")
        return {"FINISHED"}


classes = (
    EXEMPLAR_OT_handle_add,
    EXEMPLAR_OT_handle_remove,
    EXEMPLAR_OT_handle_select,
    EXEMPLAR_OT_handle_kind,
    EXEMPLAR_OT_select_problem,
)
register, unregister = bpy.utils.register_classes_factory(classes)
