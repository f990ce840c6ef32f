# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences: capture an animation, fit it anew, let it go."""

import functools

import bpy

from ..properties.sequence import CaptureOptions
from ..scene import status
from ..scene.sequences import capture, live, owners, setup
from .base import ExemplarOperator, why_linked
from .threaded import ThreadedOperator


class SequenceOperator(ExemplarOperator):
    """About the object that shows a sequence, whichever of its parts is active."""

    @classmethod
    def subject(cls, context):
        return owners.active(context)

    @classmethod
    def why_no_subject(cls):
        return "Select an object that shows a sequence, or a part of its pose space"


class EXEMPLAR_OT_sequence_capture(CaptureOptions, ThreadedOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_capture"
    bl_label = "Capture"
    bl_description = (
        "Take the animation of this object's mesh, whatever moves it, and make an object of it "
        "whose time and poses can be edited. Esc cancels"
    )
    bl_options = {"UNDO"}
    title = "Capture"

    hide_source: bpy.props.BoolProperty(
        name="Hide Source",
        description="Hide the captured object: the sequence takes its place",
        default=True,
    )

    @classmethod
    def subject(cls, context):
        return context.view_layer.objects.active

    @classmethod
    def why_no_subject(cls):
        return "Select the object whose animation is to be captured"

    @classmethod
    def why_not(cls, context, obj):
        if obj.type not in capture.TYPES:
            return "The active object has no surface"
        if context.mode != "OBJECT":
            return "Capturing needs Object Mode: leave the present mode"
        return status.library_problem()

    def invoke(self, context, event):
        """From the panel: its settings."""
        settings = self.subject(context).exemplar_capture
        for name in (*CaptureOptions.__annotations__, *_inherited()):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
        return super().invoke(context, event)

    def prepare(self, context, obj):
        self._range = frame_range(self, context.scene)
        fit = capture.fit_settings(self)
        captured = yield from capture.frames(
            obj, context.scene, context.view_layer, self._range, fit.shape_space
        )
        return functools.partial(_fit, captured, fit)

    def finish(self, context, obj, result):
        captured, report = result
        owner = setup.commit(obj, captured, report, context.scene, self.hide_source)
        _keep_options(owner, self, self._range)
        activate(context, owner)
        self.report({"INFO"}, f"Captured {owner.exemplar_sequence.summary}")

    def drop(self, result):
        captured, _report = result
        captured.sequence.close()


class EXEMPLAR_OT_sequence_refit(SequenceOperator, ThreadedOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_refit"
    bl_label = "Capture Again"
    bl_description = (
        "Capture the same object anew with the settings above. Edits of the pose space are "
        "replaced; the time's curve stays. Esc cancels"
    )
    bl_options = {"UNDO"}
    title = "Capture"

    @classmethod
    def why_not(cls, context, obj):
        source = obj.exemplar_sequence.source
        if source is None:
            return "The object that was captured is not in this file"
        if context.mode != "OBJECT":
            return "Capturing needs Object Mode: leave the present mode"
        return why_linked(obj) or status.library_problem()

    def prepare(self, context, obj):
        settings, source = obj.exemplar_capture, obj.exemplar_sequence.source
        fit = capture.fit_settings(settings)
        hidden = source.hide_get(), source.hide_viewport
        source.hide_set(False)
        source.hide_viewport = False
        try:
            context.view_layer.update()
            captured = yield from capture.frames(
                source,
                context.scene,
                context.view_layer,
                frame_range(settings, context.scene),
                fit.shape_space,
            )
        finally:
            source.hide_set(hidden[0])
            source.hide_viewport = hidden[1]
        return functools.partial(_fit, captured, fit)

    def finish(self, _context, obj, result):
        captured, report = result
        setup.refit(obj, captured, report)
        self.report({"INFO"}, f"Captured {obj.exemplar_sequence.summary}")

    def drop(self, result):
        captured, _report = result
        captured.sequence.close()


def _fit(captured, settings, report):
    """What the thread does."""
    try:
        return captured, capture.fit(captured.sequence, settings, report)
    except BaseException:
        captured.sequence.close()
        raise


def _inherited():
    names = []
    for base in CaptureOptions.__mro__[1:]:
        names += getattr(base, "__annotations__", {})
    return names


def frame_range(options, scene):
    start, end = options.frame_start, options.frame_end
    if options.use_scene_range:
        start, end = scene.frame_start, scene.frame_end
    return capture.Range(start, end, options.frame_step, options.use_world_space)


def _keep_options(owner, options, captured_range):
    """For Capture Again: the scene's range may have changed by then."""
    settings = owner.exemplar_capture
    for name in (*CaptureOptions.__annotations__, *_inherited()):
        setattr(settings, name, getattr(options, name))
    settings.use_scene_range = False
    settings.frame_start, settings.frame_end = captured_range.start, captured_range.end


def activate(context, obj):
    for other in context.view_layer.objects:
        if other.select_get():
            other.select_set(False)
    context.view_layer.objects.active = obj
    obj.select_set(True)


class EXEMPLAR_OT_sequence_update(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_update"
    bl_label = "Update"
    bl_description = "Show the shape for the present time or playhead, also while Live is off"

    def run(self, _context, obj):
        live.update(obj)


class EXEMPLAR_OT_sequence_remove(SequenceOperator, bpy.types.Operator):
    bl_idname = "exemplar.sequence_remove"
    bl_label = "Remove Sequence"
    bl_description = (
        "Let go of the sequence: the pose space goes, the mesh stays in the shape that it has, and "
        "what was captured is shown again"
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        return why_linked(obj)

    def run(self, context, obj):
        setup.remove(obj)
        activate(context, obj)


classes = (
    EXEMPLAR_OT_sequence_capture,
    EXEMPLAR_OT_sequence_refit,
    EXEMPLAR_OT_sequence_update,
    EXEMPLAR_OT_sequence_remove,
)
register, unregister = bpy.utils.register_classes_factory(classes)
