# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the active object: with progress and Esc in a window, in one go from scripts."""

import time

import bpy

from ..native import ExemplarError
from ..properties.bake import BakeOptions
from ..scene import rigs, status
from ..scene.baking import job, playback, sampling
from ..scene.sequences import owners
from .base import ExemplarOperator, why_linked, why_not_bound

# How long one turn may take before the window gets to draw and to hear Esc.
_TURN_SECONDS = 0.05


class EXEMPLAR_OT_bake(BakeOptions, ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.bake"
    bl_label = "Bake"
    bl_description = (
        "Solve every frame and keep the result so that it plays without this add-on. "
        "Esc cancels and leaves everything as it was"
    )
    # Without REGISTER: its panel of last options would bake anew at every change of a number.
    bl_options = {"UNDO"}

    @classmethod
    def subject(cls, context):
        return _subject(context)

    @classmethod
    def why_not(cls, context, obj):
        return _why_not_moved(obj) or why_linked(obj) or _why_not_object_mode(context)

    def invoke(self, context, _event):
        """From the panel: its settings, in turns, so that the window stays alive."""
        settings = self.subject(context).exemplar_bake
        for name in BakeOptions.__annotations__:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
        if not self._begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.01, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self._show(context, "Baking. Esc cancels")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._job.close()
            self._tidy(context)
            self.report({"INFO"}, "Bake cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        finished = self._turn(context)
        if not finished:
            return {"RUNNING_MODAL"}
        self._tidy(context)
        return finished

    def cancel(self, context):
        """Blender ends us: another file is loaded, the window closes."""
        self._job.close()
        self._tidy(context)

    def execute(self, context):
        if not self._begin(context):
            return {"CANCELLED"}
        finished = None
        while not finished:
            finished = self._turn(context)
        return finished

    def _begin(self, context):
        obj, scene = self.subject(context), context.scene
        start, end = self.frame_start, self.frame_end
        if self.use_scene_range:
            start, end = scene.frame_start, scene.frame_end
        settings = job.Settings(
            format=self.format,
            start=start,
            end=end,
            step=self.frame_step,
            filepath=self.filepath,
            use_modifier=self.use_modifier,
            stop_live=self.stop_live,
        )
        self._job = job.run(obj, scene, context.view_layer, settings)
        # The first step opens the file and checks the settings: better now than in a timer.
        return self._turn(context, seconds=0.0) != {"CANCELLED"}

    def _turn(self, context, seconds=_TURN_SECONDS):
        """Go on for a while. Returns the operator's result when that was the end."""
        until = time.monotonic() + seconds
        try:
            while True:
                progress = next(self._job)
                if time.monotonic() >= until:
                    break
        except StopIteration as stop:
            return self._succeed(context, stop.value)
        except ExemplarError as error:
            return self.fail(self.subject(context), error)
        self._show(
            context,
            f"Baking frame {progress.frame}, {progress.done} of {progress.total}. Esc cancels",
        )
        context.window_manager.progress_update(100 * progress.done // progress.total)
        return None

    def _succeed(self, context, result):
        status.forget(self.subject(context))
        self.report({"INFO"}, result.message)
        return {"FINISHED"}

    def _show(self, context, text):
        if context.workspace is not None and not bpy.app.background:
            context.workspace.status_text_set(text)

    def _tidy(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        self._show(context, None)


class EXEMPLAR_OT_bake_remove(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.bake_remove"
    bl_label = "Remove Bake"
    bl_description = (
        "Remove the modifier or the shape keys of a bake, and let the mesh follow its handles. "
        "Baked files, and keyframes on your own shape keys, stay"
    )

    @classmethod
    def subject(cls, context):
        return _subject(context)

    @classmethod
    def why_not(cls, context, obj):
        return _why_not_moved(obj) or why_linked(obj) or _why_not_object_mode(context)

    def run(self, _context, obj):
        playback.remove(obj)


def _subject(context):
    """The sequence whose mesh or pose space is active, or a rig."""
    return owners.active(context) or rigs.active_rig(context)


def _why_not_moved(obj):
    return "" if sampling.can_be_baked(obj) else why_not_bound(obj)


def _why_not_object_mode(context):
    return "" if context.mode == "OBJECT" else "Baking needs Object Mode: leave the present mode"


classes = (EXEMPLAR_OT_bake, EXEMPLAR_OT_bake_remove)
register, unregister = bpy.utils.register_classes_factory(classes)
