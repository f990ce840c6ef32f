# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles by themselves: Quick Rig and Mirror."""

import bpy

from ..scene import quick_rig
from .base import ExemplarOperator, why_linked
from .handles import KINDS, why_no_handle


def why_not_object_mode(context):
    return "" if context.mode == "OBJECT" else "Leave the present mode first"


class EXEMPLAR_OT_quick_rig(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.quick_rig"
    bl_label = "Quick Rig"
    bl_description = (
        "Propose handles from the exemplars: at the tips of limbs, at the joints that bend, "
        "and one that holds the body. Handles that are there stay, and are added to"
    )

    count: bpy.props.IntProperty(
        name="Handles",
        description="How many handles to add. 0: as many as the shape asks for",
        default=0,
        min=0,
        max=64,
        options={"SKIP_SAVE"},
    )
    kind: bpy.props.EnumProperty(
        name="Kind", description="What the mesh follows", items=KINDS, options={"SKIP_SAVE"}
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_linked(obj) or why_not_object_mode(context)

    def run(self, context, obj):
        context.view_layer.update()
        added = quick_rig.propose(obj, self.count, self.kind)
        more = "Press Rebind to use them" if obj.exemplar.bound else "Press Bind"
        self.report({"INFO"}, f"{len(added)} handles added. {more}")


class EXEMPLAR_OT_handle_mirror(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.handle_mirror"
    bl_label = "Mirror Handles"
    bl_description = (
        "Add handles on the other side of the mesh, across its own X axis, for those whose empties "
        "are selected, or for all. Handles that have a mirror image already are left alone"
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_linked(obj) or why_no_handle(obj) or why_not_object_mode(context)

    def run(self, context, obj):
        context.view_layer.update()
        selected = set(context.selected_objects)
        items = [item for item in obj.exemplar.handles if item.empty is not None]
        chosen = [item for item in items if item.empty in selected] or items
        added, present, unmatched = quick_rig.mirror(obj, chosen)
        notes = [f"{len(added)} handles added"]
        if present:
            notes.append(f"{present} had a mirror image")
        if unmatched:
            notes.append(f"{unmatched} find no vertices on the other side")
        self.report({"WARNING" if unmatched else "INFO"}, "; ".join(notes))


classes = (EXEMPLAR_OT_quick_rig, EXEMPLAR_OT_handle_mirror)
register, unregister = bpy.utils.register_classes_factory(classes)
