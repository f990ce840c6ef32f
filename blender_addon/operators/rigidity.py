# SPDX-License-Identifier: GPL-3.0-or-later
"""Paint, fill and learn the stiffness of a mesh."""

import functools

import bpy

from ..scene import handle_editing, learning, live, status, stiffness
from ..scene.baking.frames import frame_numbers
from .base import ExemplarOperator, why_linked
from .threaded import ThreadedOperator


def why_not_painted(context, obj):
    if context.view_layer.objects.active != obj:
        return "Select the mesh: its vertices are what is painted"
    return why_linked(obj)


class EXEMPLAR_OT_rigidity_paint(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.rigidity_paint"
    bl_label = "Paint"
    bl_description = (
        "Paint how stiff the mesh is, with the brushes of Weight Paint: 0 (blue) is softest, "
        "1 (red) stiffest. The mesh takes it up at the end of each stroke. Press again to stop"
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_not_painted(context, obj)

    def run(self, _context, obj):
        if obj.mode == "WEIGHT_PAINT":
            bpy.ops.object.mode_set(mode="OBJECT")
            return
        bpy.ops.object.mode_set(mode="OBJECT")
        group = stiffness.ensure_group(obj)
        obj.vertex_groups.active_index = group.index
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")


class EXEMPLAR_OT_rigidity_fill(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.rigidity_fill"
    bl_label = "Fill"
    bl_description = "Give one stiffness to all selected vertices, like a paint bucket"

    value: bpy.props.FloatProperty(
        name="Stiffness",
        description="0: softest, 1: stiffest",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_not_painted(context, obj)

    def invoke(self, context, _event):
        self.value = context.view_layer.objects.active.exemplar.rigidity.fill_value
        return self.execute(context)

    def run(self, _context, obj):
        stiffness.fill(obj, handle_editing.selected_vertices(obj), self.value)
        live.refresh(obj)


class LearnOperator(ThreadedOperator):
    title = "Learn Stiffness"
    # Without REGISTER: its panel of last options would learn anew at every change.
    bl_options = {"UNDO"}

    @classmethod
    def why_not(cls, _context, obj):
        reason = status.library_problem() or why_linked(obj)
        if not reason and obj.mode == "EDIT":
            return "Leave Edit Mode first"
        return reason

    def finish(self, _context, obj, result):
        stiffness.write(obj, result)
        live.refresh(obj)
        mean = f"{result.mean():.1f} rings on average"
        self.report({"INFO"}, f"Learned {result.min()} to {result.max()} rings, {mean}")


class EXEMPLAR_OT_rigidity_learn_keys(LearnOperator, bpy.types.Operator):
    bl_idname = "exemplar.rigidity_learn_keys"
    bl_label = "Learn from Shape Keys"
    bl_description = (
        "Find what is stiff and what bends from the exemplars that are switched on, and write it "
        "into the painted group, where it can be painted over. Esc cancels"
    )

    def prepare(self, _context, obj):
        problem = learning.from_keys(obj)
        yield 0.0, "preparing"
        return functools.partial(learning.learn, problem)


class EXEMPLAR_OT_rigidity_learn_animation(LearnOperator, bpy.types.Operator):
    bl_idname = "exemplar.rigidity_learn_animation"
    bl_label = "Learn from Animation"
    bl_description = (
        "Find what is stiff and what bends from the frames of an animated mesh, and write it into "
        "the painted group, where it can be painted over. Esc cancels"
    )

    def prepare(self, context, obj):
        own, scene = obj.exemplar.rigidity, context.scene
        start, end = own.frame_start, own.frame_end
        if own.use_scene_range:
            start, end = scene.frame_start, scene.frame_end
        problem = yield from learning.from_animation(
            obj,
            own.animated or obj,
            scene,
            context.evaluated_depsgraph_get,
            frame_numbers(start, end, own.frame_step),
        )
        return functools.partial(learning.learn, problem)


classes = (
    EXEMPLAR_OT_rigidity_paint,
    EXEMPLAR_OT_rigidity_fill,
    EXEMPLAR_OT_rigidity_learn_keys,
    EXEMPLAR_OT_rigidity_learn_animation,
)
register, unregister = bpy.utils.register_classes_factory(classes)
