# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blended can do beside following handles."""

import bpy

from ..scene import skin
from .base import ExemplarOperator, why_linked, why_not_bound


class EXEMPLAR_OT_skin_to_groups(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.skin_to_groups"
    bl_label = "Skinning Weights to Vertex Groups"
    bl_description = (
        "Write the bones' weights that were found in the exemplars into vertex groups, one a bone, "
        "for an armature. Those of the last time are replaced"
    )

    @classmethod
    def why_not(cls, context, obj):
        reason = why_linked(obj) or why_not_bound(obj) or skin.why_not(obj)
        if not reason and obj.mode == "EDIT":
            return "Leave Edit Mode first"
        return reason

    def run(self, _context, obj):
        names = skin.write(obj)
        self.report({"INFO"}, f"{len(names)} vertex groups: {names[0]} to {names[-1]}")


classes = (EXEMPLAR_OT_skin_to_groups,)
register, unregister = bpy.utils.register_classes_factory(classes)
