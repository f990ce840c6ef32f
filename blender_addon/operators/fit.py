# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit a mesh to a scan, or to a sequence of scans."""

import functools
from contextlib import closing

import bpy
import numpy

from ..native import ExemplarError
from ..scene import live, status
from ..scene.baking.frames import frame_numbers, walk
from ..scene.fitting import cache, inputs, outputs, solving
from .base import why_linked
from .threaded import ThreadedOperator


class FitOperator(ThreadedOperator):
    # Without REGISTER: its panel of last options would fit anew at every change.
    bl_options = {"UNDO"}

    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        if obj.exemplar_fit.scan is None:
            return "Choose the scan first"
        return status.library_problem() or why_linked(obj)

    def modal(self, context, event):
        if event.type == "TIMER":
            live.redraw_panels()  # and the views, where the shape so far is drawn
        return super().modal(context, event)

    def tell(self, obj):
        own = obj.exemplar_fit
        self.report({"WARNING" if own.is_doubtful else "INFO"}, own.message)


class EXEMPLAR_OT_fit(FitOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit"
    bl_label = "Fit"
    bl_description = (
        "Pose the mesh, within what its exemplars can do, so that it lies on the scan, and "
        "complete the scan where it has holes. Esc cancels and leaves everything as it was"
    )
    title = "Fit"

    def prepare(self, context, obj):
        outputs.refuse(obj)
        gathered = inputs.gather(obj, context.evaluated_depsgraph_get())
        yield 0.0, "preparing"
        return functools.partial(_fit, gathered)

    def finish(self, context, obj, result):
        shown = outputs.write(obj, *result)
        if obj.exemplar_fit.use_colours and _is_view(context):
            context.space_data.shading.color_type = "VERTEX"
        shown.update_tag()
        self.tell(obj)


def _fit(gathered, report):
    return gathered, solving.fit(gathered, report)


def _is_view(context):
    return context.space_data is not None and context.space_data.type == "VIEW_3D"


class EXEMPLAR_OT_fit_match(FitOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit_match"
    bl_label = "Find Correspondence"
    bl_description = (
        "Find out which of the ambiguous landmarks is which: the one way of pairing them that "
        "bends the mesh least. Esc cancels"
    )
    title = "Find Correspondence"

    @classmethod
    def why_not(cls, context, obj):
        marked = sum(item.is_ambiguous for item in obj.exemplar_fit.landmarks)
        if marked < 2:
            return "Mark two or more landmarks as ambiguous first"
        return super().why_not(context, obj)

    def prepare(self, context, obj):
        own = obj.exemplar_fit
        gathered = inputs.gather(obj, context.evaluated_depsgraph_get())
        groups = numpy.array([0 if item.is_ambiguous else -1 for item in own.landmarks])
        yield 0.0, "preparing"
        return functools.partial(solving.match, gathered, groups, own.find_scale)

    def finish(self, _context, obj, found):
        items = obj.exemplar_fit.landmarks
        places = [(tuple(item.point), item.empty) for item in items]
        moved = 0
        for index, (item, source) in enumerate(zip(items, found.order)):
            item.point, item.empty = places[source]
            moved += int(source) != index
        how = "All were right already" if not moved else f"{moved} landmarks changed places"
        sure = f"the next best is {found.margin:.0%} worse"
        if found.mirrored:
            sure += ", and is this one mirrored: compare left and right"
        level = "WARNING" if found.warning else "INFO"
        self.report({level}, f"{how}; {sure}" if found.solved > 1 else how)


class EXEMPLAR_OT_fit_sequence(FitOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit_sequence"
    bl_label = "Fit Frames"
    bl_description = (
        "Fit the mesh to the scan as it is on every frame, each from the frame before it, and bake "
        "the fits to a PC2 cache on an object of their own. Landmarks count on the first frame; on "
        "the others only those that are empties. Esc cancels"
    )
    title = "Fit Frames"

    def prepare(self, context, obj):
        own, scene = obj.exemplar_fit, context.scene
        start, end = own.frame_start, own.frame_end
        if own.use_scene_range:
            start, end = scene.frame_start, scene.frame_end
        numbers = frame_numbers(start, end, own.frame_step)
        self._numbers = numbers
        self._path = cache.path(obj)
        inputs.scan_object(obj)
        frames = []
        with closing(walk(scene, numbers)) as walked:
            for done, number in enumerate(walked):
                frames.append(_frame(obj, context.evaluated_depsgraph_get(), number, done > 0))
                yield done / len(numbers), f"frame {number}"
        world = numpy.array(obj.matrix_world)
        return functools.partial(
            solving.fit_frames,
            inputs.shape(obj),
            frames,
            inputs.settings(obj),
            world,
            list(numbers),
        )

    def finish(self, _context, obj, result):
        positions, reports = result
        worst = min(range(len(reports)), key=lambda k: reports[k].quality)
        cache.write(obj, self._path, self._numbers, positions)
        own = obj.exemplar_fit
        own.is_doubtful = any(report.warning for report in reports)
        own.message = (
            f"Fitted {len(reports)} frames to {self._path}; frame {self._numbers[worst]} is worst, "
            f"where {reports[worst].quality:.0%} of the scan is explained"
        )
        self.tell(obj)


def _frame(obj, depsgraph, number, is_later):
    """The scan on a frame; on later ones with the landmarks that move with it, if enough do."""
    try:
        frame = inputs.scan_frame(obj, depsgraph)
    except ExemplarError as error:
        raise ExemplarError(f"Frame {number}: {error}", vertices=error.vertices) from error
    if not is_later:
        inputs.refuse_few(frame)
        return frame
    moving = [item.empty is not None for item in obj.exemplar_fit.landmarks]
    return inputs.with_landmarks(frame, numpy.array(moving, bool))


classes = (EXEMPLAR_OT_fit, EXEMPLAR_OT_fit_match, EXEMPLAR_OT_fit_sequence)
register, _unregister_classes = bpy.utils.register_classes_factory(classes)


def unregister():
    _unregister_classes()
    solving.forget()
