# SPDX-License-Identifier: GPL-3.0-or-later
"""Put all handles somewhere at once, and solve once."""

import bpy

from ..scene import live, posing, solving
from .base import ExemplarOperator, why_not_bound


class PoseOperator(ExemplarOperator):
    @classmethod
    def why_not(cls, _context, obj):
        mode = solving.paused_by(obj)
        return why_not_bound(obj) or (f"Leave {mode} first" if mode else "")


class EXEMPLAR_OT_pose_to_exemplar(PoseOperator, bpy.types.Operator):
    bl_idname = "exemplar.pose_to_exemplar"
    bl_label = "Pose to Exemplar"
    bl_description = "Move the empties to where this exemplar has their vertices"

    name: bpy.props.StringProperty(
        name="Exemplar", description="The shape key. Empty: the active one"
    )

    def run(self, context, obj):
        name = self.name or (obj.active_shape_key.name if obj.active_shape_key else "")
        left = posing.to_exemplar(obj, name)
        _report_left(self, left)


class EXEMPLAR_OT_pose_reset(PoseOperator, bpy.types.Operator):
    bl_idname = "exemplar.pose_reset"
    bl_label = "Reset Pose"
    bl_description = "Move the empties back to where they were at Bind"

    def run(self, _context, obj):
        _report_left(self, posing.reset(obj))


class EXEMPLAR_OT_update(PoseOperator, bpy.types.Operator):
    bl_idname = "exemplar.update"
    bl_label = "Update"
    bl_description = "Show the result for the handles as they are now, also while Live is off"

    def run(self, _context, obj):
        live.update(obj)


def _report_left(operator, left):
    """Empties that something else moves stay under its control."""
    if left:
        names = ", ".join(left[:3]) + (" and others" if left[3:] else "")
        operator.report({"WARNING"}, f"{names}: moved by animation or constraints, not by this")


classes = (EXEMPLAR_OT_pose_to_exemplar, EXEMPLAR_OT_pose_reset, EXEMPLAR_OT_update)
register, unregister = bpy.utils.register_classes_factory(classes)
