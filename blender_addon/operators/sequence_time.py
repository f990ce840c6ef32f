# SPDX-License-Identifier: GPL-3.0-or-later
"""Retime a sequence at once; everything else is done in the Graph Editor."""

import bpy

from ..scene.sequences import retiming, store
from .base import why_linked
from .sequence import SequenceOperator


class TimeOperator(SequenceOperator):
    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj)


class EXEMPLAR_OT_sequence_speed(TimeOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_speed"
    bl_label = "Speed"
    bl_description = (
        "Play faster or slower from the present frame on and before it: moves keyframes"
    )

    factor: bpy.props.FloatProperty(
        name="Factor",
        description="2: twice as fast. 0.5: half as fast",
        default=2.0,
        min=0.01,
        max=100.0,
    )

    def run(self, context, obj):
        retiming.stretch(obj, 1.0 / self.factor, context.scene.frame_current)


class EXEMPLAR_OT_sequence_frame_rate(TimeOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_frame_rate"
    bl_label = "Convert to Scene's Frame Rate"
    bl_description = (
        "Play as many seconds as before at the scene's present frame rate, with true frames between"
    )

    def run(self, context, obj):
        before = obj.exemplar_sequence.fps
        now = retiming.scene_frame_rate(context.scene)
        retiming.convert_frame_rate(obj, now, context.scene.frame_start)
        self.report({"INFO"}, f"From {before:g} to {now:g} frames a second")


class EXEMPLAR_OT_sequence_play_as_captured(TimeOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_play_as_captured"
    bl_label = "Play as Captured"
    bl_description = "Replace the time's curve by a straight line: every frame at its own time"

    def run(self, _context, obj):
        data = obj.exemplar_sequence
        frames = store.ensure(obj).sequence.info.frame_count
        end = data.first_frame + data.frame_step * (frames - 1)
        retiming.play_as_captured(obj, data.first_frame, end)


classes = (
    EXEMPLAR_OT_sequence_speed,
    EXEMPLAR_OT_sequence_frame_rate,
    EXEMPLAR_OT_sequence_play_as_captured,
)
register, unregister = bpy.utils.register_classes_factory(classes)
