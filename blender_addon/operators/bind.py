# SPDX-License-Identifier: GPL-3.0-or-later
"""Bind, rebind, unbind."""

import bpy

from ..native import ExemplarError
from ..scene import bindings, live, rigs, setup, status
from ..scene.binding_job import BindingJob
from .base import ExemplarOperator, why_linked, why_not_bound

# Looking around is harmless while a bind runs.
NAVIGATION = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM"}


class BindOperator(ExemplarOperator):
    """In a window a thread binds while a timer shows how far it is; from scripts in one go."""

    @classmethod
    def why_not(cls, _context, obj):
        return status.library_problem() or why_linked(obj) or status.why_not_ready(obj)

    def run(self, context, obj):
        context.view_layer.update()
        gathered = setup.prepare(obj)
        self.finish(obj, gathered, *bindings.build(gathered))

    def finish(self, obj, gathered, deformer, warnings):
        notes = setup.commit(obj, gathered, deformer, warnings)
        live.update(obj)
        for note in notes:
            self.report({"WARNING" if warnings else "INFO"}, note)

    def invoke(self, context, _event):
        if bpy.app.background:
            return self.execute(context)
        obj = rigs.active_rig(context)
        try:
            context.view_layer.update()
            self._job = BindingJob(setup.prepare(obj))
        except ExemplarError as error:
            return self.fail(obj, error)
        self._name = bindings.owner_name(obj)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.05, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._job.ask_to_stop()
        if event.type in NAVIGATION:
            return {"PASS_THROUGH"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        if self._job.finished:
            if self._job.is_stopping:
                self.cancel(context)
                self.report({"INFO"}, "Bind cancelled; everything is as it was")
                return {"CANCELLED"}
            self._tidy(context)
            return self._finish_job(context)
        self._show_progress(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """The end of an Esc, or Blender ends us: another file is loaded, the window closes."""
        self._job.cancel()
        self._tidy(context)

    def _finish_job(self, context):
        obj = bpy.data.objects.get(self._name)
        try:
            deformer, warnings = self._job.result()
            if obj is None:
                deformer.close()
                return {"CANCELLED"}
            self.finish(obj, self._job.gathered, deformer, warnings)
        except ExemplarError as error:
            return self.fail(obj, error)
        status.forget(obj)
        live.redraw_panels()
        return {"FINISHED"}

    def _show_progress(self, context):
        percent = round(100 * self._job.fraction)
        stage = self._job.stage or "preparing"
        hint = "Cancelling" if self._job.is_stopping else "Esc cancels"
        context.workspace.status_text_set(f"Bind: {stage}, {percent} %. {hint}")
        context.window_manager.progress_update(percent)

    def _tidy(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class EXEMPLAR_OT_bind(BindOperator, bpy.types.Operator):
    bl_idname = "exemplar.bind"
    bl_label = "Bind"
    bl_description = (
        "Prepare the mesh to follow its handles. The empties go to the vertices of their handles. "
        "Esc cancels"
    )

    @classmethod
    def why_not(cls, context, obj):
        if obj.exemplar.bound:
            return "The mesh is bound already: press Rebind to use what you changed"
        return super().why_not(context, obj)


class EXEMPLAR_OT_rebind(BindOperator, bpy.types.Operator):
    bl_idname = "exemplar.rebind"
    bl_label = "Rebind"
    bl_description = (
        "Prepare the mesh again, after exemplars, handles or the mesh itself were changed. "
        "The pose stays. Esc cancels"
    )

    @classmethod
    def why_not(cls, context, obj):
        return why_not_bound(obj) or super().why_not(context, obj)


class EXEMPLAR_OT_unbind(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.unbind"
    bl_label = "Unbind"
    bl_description = "Remove the result and let go of the mesh. Handles and settings stay"

    @classmethod
    def why_not(cls, context, obj):
        if obj.mode != "OBJECT":
            return "Leave the present mode first"
        return why_linked(obj) or why_not_bound(obj)

    def run(self, context, obj):
        result = obj.exemplar.result_object
        if result is not None and context.view_layer.objects.active == result:
            context.view_layer.objects.active = obj
        setup.unbind(obj)


classes = (EXEMPLAR_OT_bind, EXEMPLAR_OT_rebind, EXEMPLAR_OT_unbind)
register, unregister = bpy.utils.register_classes_factory(classes)
