# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the active object: with progress and Esc in a window, in one go from scripts."""

import time

import bpy

from ..native import ExemplarError
from ..properties.bake import BakeOptions
from ..scene import rigs
from ..scene.baking import job
from ..scene.baking.errors import BakeError

# How long one turn may take before the window gets to draw and to hear Esc.
_TURN_SECONDS = 0.05


class EXEMPLAR_OT_bake(BakeOptions, bpy.types.Operator):
    bl_idname = "exemplar.bake"
    bl_label = "Bake"
    bl_description = (
        "Solve every frame and keep the result so that it plays without this add-on. "
        "Esc cancels and leaves everything as it was"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        obj = rigs.active_rig(context)
        if obj is None or not obj.exemplar.bound:
            cls.poll_message_set("Bind the mesh first: there is nothing to bake yet")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave the present mode: baking needs Object Mode")
            return False
        if obj.library is not None:
            cls.poll_message_set("The object is linked: make a library override of it first")
            return False
        return True

    def invoke(self, context, _event):
        """From the panel: its settings, in turns, so that the window stays alive."""
        settings = rigs.active_rig(context).exemplar_bake
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
        obj, scene = rigs.active_rig(context), context.scene
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
            return self._succeed(stop.value)
        except (BakeError, ExemplarError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._show(
            context,
            f"Baking frame {progress.frame}, {progress.done} of {progress.total}. Esc cancels",
        )
        context.window_manager.progress_update(100 * progress.done // progress.total)
        return None

    def _succeed(self, result):
        self.report({"WARNING"} if result.unconverged else {"INFO"}, result.message)
        return {"FINISHED"}

    def _show(self, context, text):
        if context.workspace is not None and not bpy.app.background:
            context.workspace.status_text_set(text)

    def _tidy(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        self._show(context, None)


classes = (EXEMPLAR_OT_bake,)
register, unregister = bpy.utils.register_classes_factory(classes)
