# SPDX-License-Identifier: GPL-3.0-or-later
"""Put all handles somewhere at once, and solve once."""

import bpy

from ..scene import live, posing, solving
from .base import ExemplarOperator, why_linked, why_not_bound
from .handles import why_no_handle


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


class EXEMPLAR_OT_pose_mirror(PoseOperator, bpy.types.Operator):
    bl_idname = "exemplar.pose_mirror"
    bl_label = "Mirror Pose"
    bl_description = (
        "Exchange the left and the right of the pose, across the mesh's own X axis. "
        "Every handle needs its mirror image, or a place in the middle"
    )

    def run(self, _context, obj):
        _report_left(self, posing.mirror(obj))


class EXEMPLAR_OT_key_all(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.key_all"
    bl_label = "Key All Handles"
    bl_description = (
        "Insert keyframes for all handles on this frame: the place of pinned ones, place, rotation "
        "and scale of oriented ones"
    )

    @classmethod
    def why_not(cls, _context, obj):
        return why_no_handle(obj)

    def run(self, context, obj):
        keyed, linked = posing.key_all(obj, context.scene.frame_current)
        if linked:
            text = f"{', '.join(linked[:3])}: linked, so without a keyframe"
            self.report({"WARNING"}, text)
        else:
            self.report({"INFO"}, f"{keyed} handles keyed on frame {context.scene.frame_current}")


class EXEMPLAR_OT_result_to_key(PoseOperator, bpy.types.Operator):
    bl_idname = "exemplar.result_to_key"
    bl_label = "Result to Shape Key"
    bl_description = (
        "Keep the mesh as it is now in a new shape key, to sculpt on or to use as an exemplar "
        "from the next Bind on"
    )

    name: bpy.props.StringProperty(
        name="Name", description="The name of the new shape key", default="Pose"
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_linked(obj) or super().why_not(context, obj)

    def run(self, _context, obj):
        key = posing.result_to_key(obj, self.name)
        self.report({"INFO"}, f"Kept as '{key.name}'. Press Rebind to use it as an exemplar")


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


classes = (
    EXEMPLAR_OT_pose_to_exemplar,
    EXEMPLAR_OT_pose_reset,
    EXEMPLAR_OT_pose_mirror,
    EXEMPLAR_OT_key_all,
    EXEMPLAR_OT_result_to_key,
    EXEMPLAR_OT_update,
)
register, unregister = bpy.utils.register_classes_factory(classes)
