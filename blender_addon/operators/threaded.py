# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that take long: in a window with progress and Esc, from scripts in one go."""

import time

import bpy

from ..native import ExemplarError
from ..scene import background, bindings, live, status
from .base import ExemplarOperator

# Looking around is harmless while one runs.
NAVIGATION = {"MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM"}
# How long one turn of the preparation may take before the window gets to draw and to hear Esc.
TURN_SECONDS = 0.05


class ThreadedOperator(ExemplarOperator):
    """First what needs Blender's data, in turns; then the work, in a thread; then what it changes.

    Nothing is changed before `finish`, so Esc leaves everything as it was.
    """

    title = ""  # in the status bar

    def prepare(self, context, obj):
        """A generator of (fraction, stage). Returns work(report), which may run in a thread and
        sees no Blender data."""
        raise NotImplementedError

    def finish(self, context, obj, result):
        """Make the result of the work the object's own."""
        raise NotImplementedError

    def drop(self, result):
        """The result will not be used."""

    def run(self, context, obj):
        work = _exhaust(self.prepare(context, obj))
        self.finish(context, obj, work(None))

    def invoke(self, context, _event):
        if bpy.app.background:
            return self.execute(context)
        obj = self.subject(context)
        self._name = bindings.owner_name(obj)
        self._job = None
        self._preparation = self.prepare(context, obj)
        try:
            # What is wrong from the beginning is better told now than by a timer.
            self._progress = (0.0, "preparing")
            self._prepare_for(0.0)
        except ExemplarError as error:
            return self.fail(obj, error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.05, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            if self._job is None:
                return self._end_cancelled(context)
            self._job.ask_to_stop()
        if event.type in NAVIGATION:
            return {"PASS_THROUGH"}
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        try:
            if self._job is None:
                self._prepare_for(TURN_SECONDS)
            elif self._job.finished:
                return self._end(context)
        except ExemplarError as error:
            self._tidy(context)
            return self.fail(bpy.data.objects.get(self._name), error)
        self._show_progress(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """The end of an Esc, or Blender ends us: another file is loaded, the window closes."""
        if self._job is None:
            self._preparation.close()
        else:
            self._job.cancel()
        self._tidy(context)

    def _prepare_for(self, seconds):
        until = time.monotonic() + seconds
        try:
            while True:
                self._progress = next(self._preparation)
                if time.monotonic() >= until:
                    return
        except StopIteration as stop:
            self._job = background.BackgroundJob(stop.value, self.drop)

    def _end(self, context):
        if self._job.is_stopping:
            return self._end_cancelled(context)
        self._tidy(context)
        obj = bpy.data.objects.get(self._name)
        try:
            result = self._job.result()
            if obj is None:
                self.drop(result)
                return {"CANCELLED"}
            self.finish(context, obj, result)
        except ExemplarError as error:
            return self.fail(obj, error)
        status.forget(obj)
        live.redraw_panels()
        return {"FINISHED"}

    def _end_cancelled(self, context):
        self.cancel(context)
        self.report({"INFO"}, f"{self.title} cancelled; everything is as it was")
        return {"CANCELLED"}

    def _show_progress(self, context):
        fraction, stage = self._progress
        hint = "Esc cancels"
        if self._job is not None:
            fraction, stage = self._job.fraction, self._job.stage or "preparing"
            hint = "Cancelling" if self._job.is_stopping else hint
        percent = round(100 * fraction)
        context.workspace.status_text_set(f"{self.title}: {stage}, {percent} %. {hint}")
        context.window_manager.progress_update(percent)

    def _tidy(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


def _exhaust(generator):
    """Run a generator to its end and return what it returns."""
    while True:
        try:
            next(generator)
        except StopIteration as stop:
            return stop.value
