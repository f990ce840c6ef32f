# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blended can do beside following handles."""

import bpy

from ..scene import interpolation, skin
from .base import ExemplarOperator, why_linked, why_not_bound
from .threaded import ThreadedOperator


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


class EXEMPLAR_OT_interpolate(ThreadedOperator, bpy.types.Operator):
    bl_idname = "exemplar.interpolate"
    bl_label = "Interpolate"
    bl_description = (
        "Fill the frames between two keyed poses of the handles, the last before the current frame "
        "and the next, by turning the parts of the mesh from the one to the other. "
        "The handles get a keyframe on each. Esc cancels"
    )
    bl_options = {"UNDO"}
    title = "Interpolate"

    all_keys: bpy.props.BoolProperty(
        name="All Keys",
        description="Over all keyed poses in the scene's range, smoothly through each",
    )

    @classmethod
    def why_not(cls, context, obj):
        reason = why_linked(obj) or why_not_bound(obj) or interpolation.why_not(obj)
        if not reason and context.mode != "OBJECT":
            return "Leave the present mode first"
        return reason

    def prepare(self, context, obj):
        scene = context.scene
        interpolation.refuse(obj)
        keyed = interpolation.choose(obj, scene, self.all_keys)
        found = yield from interpolation.find(obj, scene, context.evaluated_depsgraph_get, keyed)
        self._ends = keyed[0], keyed[-1]
        return lambda _report: found

    def finish(self, context, obj, result):
        distance = interpolation.write(obj, context.scene, result)
        first, last = self._ends
        self.report(
            {"INFO"},
            f"{len(result.frames)} frames between {first} and {last} keyed; the mesh that follows "
            f"them is within {distance:.1%} of its size of the interpolated one",
        )


classes = (EXEMPLAR_OT_skin_to_groups, EXEMPLAR_OT_interpolate)
register, unregister = bpy.utils.register_classes_factory(classes)
