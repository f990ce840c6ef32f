# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of the artist's own: a pose space of shape keys, a new shape in one, another character."""

import bpy

from ..native import ExemplarError
from ..properties.sequence import FitOptions
from ..scene import meshes, status
from ..scene.sequences import capture, drawn, owners, plane, setup, solving, store, transfer
from .base import ExemplarOperator, why_linked
from .sequence import SequenceOperator, activate
from .threaded import ThreadedOperator


class EXEMPLAR_OT_sequence_from_keys(FitOptions, ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_from_keys"
    bl_label = "Pose Space from Shape Keys"
    bl_description = (
        "Place this mesh's shape keys in a plane, similar ones side by side, and animate along a "
        "curve that is drawn there"
    )
    bl_options = {"UNDO"}

    frame_count: bpy.props.IntProperty(
        name="Frames", description="How long the animation is", default=48, min=2, max=100000
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        if owners.is_owner(obj):
            return "This object shows a sequence already"
        if len(meshes.exemplar_keys(obj)) < drawn.FEWEST:
            return f"Sculpt {drawn.FEWEST} shape keys or more"
        return status.library_problem()

    def run(self, context, obj):
        names = [key.name for key in meshes.exemplar_keys(obj)]
        settings = capture.fit_settings(self)
        owner = drawn.from_keys(obj, names, settings, self.frame_count, context.scene)
        activate(context, owner)


class EXEMPLAR_OT_sequence_loop(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_loop"
    bl_label = "Loop"
    bl_description = (
        "Play a stretch of the animation again before it goes on: the curve in the plane gets a "
        "loop"
    )

    start: bpy.props.FloatProperty(name="From", description="Captured frame", default=1.0)
    end: bpy.props.FloatProperty(name="To", description="Captured frame", default=12.0)
    count: bpy.props.IntProperty(
        name="Times", description="How many times more", default=1, min=1, max=1000
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        return why_linked(obj)

    def run(self, _context, obj):
        added = drawn.loop(obj, self.start, self.end, self.count)
        setup.show(obj)
        self.report({"INFO"}, f"{added} frames more")

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)


class EXEMPLAR_OT_sequence_new_shape(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_new_shape"
    bl_label = "New Shape Here"
    bl_description = (
        "Put a shape into the pose space where the playhead is: that of another selected mesh, "
        "which any deformer may pose, or this mesh as it was sculpted"
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_linked(obj)

    def run(self, context, obj):
        depsgraph = context.evaluated_depsgraph_get()
        positions = self._positions(context, obj, depsgraph)
        point = plane.point_of(obj, depsgraph)
        if obj.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        drawn.add_shape(obj, positions, point)
        obj.exemplar_sequence.live = True
        obj.exemplar_sequence.follow = "PLAYHEAD"
        setup.show(obj)

    @staticmethod
    def _positions(context, obj, depsgraph):
        others = [
            other
            for other in context.selected_objects
            if other.type == "MESH" and other != obj and owners.owner_of(other) is None
        ]
        if len(others) > 1:
            raise ExemplarError("Several meshes are selected. Select the one that has the shape.")
        if others:
            return setup.evaluated_positions(others[0], depsgraph)
        if obj.exemplar_sequence.live and not solving.paused_by(obj):
            raise ExemplarError(
                f"'{obj.name}' shows the pose space as it is. Select another mesh that has the new "
                "shape, or sculpt this one and press the button before leaving Sculpt Mode."
            )
        return setup.positions_of(obj)


class EXEMPLAR_OT_sequence_transfer(SequenceOperator, ThreadedOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_transfer"
    bl_label = "Transfer"
    bl_description = (
        "Play this animation with another character, by poses that both have as shape keys of the "
        "same name. Esc cancels"
    )
    bl_options = {"UNDO"}
    title = "Transfer"

    shape_space: FitOptions.__annotations__["shape_space"]

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        chosen = context.scene.exemplar_transfer
        try:
            transfer.refuse(obj, chosen.examples, chosen.target)
        except ExemplarError as error:
            return str(error)
        return ""

    def prepare(self, context, obj):
        chosen = context.scene.exemplar_transfer
        yield 0.0, "reading the poses"
        # Whatever was edited in the plane goes along.
        store.ensure(obj)
        return transfer.build(obj, chosen.examples, chosen.target, self.shape_space)

    def finish(self, context, obj, result):
        sequence, names = result
        target = context.scene.exemplar_transfer.target
        made = transfer.commit(obj, target, sequence, names, context.scene)
        activate(context, made)
        self.report({"INFO"}, f"Transferred by {len(names)} poses")

    def drop(self, result):
        sequence, _names = result
        sequence.close()


classes = (
    EXEMPLAR_OT_sequence_from_keys,
    EXEMPLAR_OT_sequence_loop,
    EXEMPLAR_OT_sequence_new_shape,
    EXEMPLAR_OT_sequence_transfer,
)
register, unregister = bpy.utils.register_classes_factory(classes)
