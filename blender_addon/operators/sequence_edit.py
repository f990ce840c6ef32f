# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of the pose space that need a button. Most need none: curve and marks are meshes."""

import bpy

from ..native import ExemplarError
from ..scene.sequences import drawn, live, owners, plane, setup, solving, store, syncing
from .base import why_linked
from .sequence import SequenceOperator, activate


class EXEMPLAR_OT_sequence_pin(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_pin"
    bl_label = "Pin Frames"
    bl_description = "Hold the selected frames' marks where they are, while others relax"

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj)

    def run(self, _context, obj):
        state = store.ensure(obj)
        syncing.pin(obj, state, selected(obj))
        live.update(obj)


class EXEMPLAR_OT_sequence_unpin(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_unpin"
    bl_label = "Unpin Frames"
    bl_description = "Let the selected frames' marks go where the others want them"

    all: bpy.props.BoolProperty(
        name="All", description="All marks, and not only the selected ones", default=False
    )

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj)

    def run(self, _context, obj):
        state = store.ensure(obj)
        count = state.sequence.window().fitted_frame_count
        syncing.unpin(obj, state, range(count) if self.all else selected(obj))
        live.update(obj)


def selected(obj):
    marks = obj.exemplar_sequence.marks
    plane.check(marks, "The object of the frames' marks")
    found = plane.selected_marks(marks)
    if not found:
        raise ExemplarError(f"No marks are selected: select some in Edit Mode of '{marks.name}'.")
    return found


class EXEMPLAR_OT_sequence_select(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_select"
    bl_label = "Select"
    bl_description = "Select this part of the pose space"

    name: bpy.props.StringProperty(name="Object", description="The part of the sequence to select")

    def run(self, context, obj):
        part = next((p for p in owners.parts(obj) if p.name == self.name), None)
        if part is None or part.name not in context.view_layer.objects:
            raise ExemplarError(f"'{self.name}' is not in this view layer.")
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        activate(context, part)


class EXEMPLAR_OT_sequence_reset_curve(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_reset_curve"
    bl_label = "Reset Curve"
    bl_description = "Put the curve back to where it was fitted, through the frames' marks"

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        return why_linked(obj)

    def run(self, context, obj):
        state = store.ensure(obj)
        if syncing.plane_is_whole(obj):
            syncing.reset_curve(obj, state)
        else:
            setup.make_plane(obj, state)
        setup.show(obj)


class EXEMPLAR_OT_sequence_playhead_to_time(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_playhead_to_time"
    bl_label = "Playhead to Time"
    bl_description = "Move the playhead to where the present time is on the curve"

    def run(self, context, obj):
        state = store.ensure(obj)
        data = obj.exemplar_sequence
        plane.check(data.playhead, "The playhead")
        time = obj.evaluated_get(context.evaluated_depsgraph_get()).exemplar_sequence.time
        point = state.sequence.curve_point(solving.sequence_time(obj, time))
        data.playhead.location = (*point, 0.0)


class EXEMPLAR_OT_sequence_draw(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_draw"
    bl_label = "Animate Along Curve"
    bl_description = (
        "Make the control polygon as it is, or the selected curve object, the way of the "
        "animation, at an even pace and for this many frames"
    )

    frame_count: bpy.props.IntProperty(
        name="Frames", description="How long the animation is", default=48, min=2, max=100000
    )
    control_points: bpy.props.IntProperty(
        name="Control Points",
        description="How many of them a selected curve object is followed with",
        default=16,
        min=4,
        soft_max=200,
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        return why_linked(obj)

    def run(self, context, obj):
        curves = [other for other in context.selected_objects if other.type == "CURVE"]
        if len(curves) > 1:
            raise ExemplarError("Several curves are selected. Select one.")
        source = curves[0] if curves else None
        drawn.draw(obj, source, self.frame_count, self.control_points, context)
        setup.show(obj)

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)


classes = (
    EXEMPLAR_OT_sequence_select,
    EXEMPLAR_OT_sequence_pin,
    EXEMPLAR_OT_sequence_unpin,
    EXEMPLAR_OT_sequence_reset_curve,
    EXEMPLAR_OT_sequence_playhead_to_time,
    EXEMPLAR_OT_sequence_draw,
)
register, unregister = bpy.utils.register_classes_factory(classes)
