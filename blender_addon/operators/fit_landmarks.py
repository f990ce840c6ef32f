# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks of a fit: picked by clicks, taken over by name or from handles, removed."""

import bpy
from bpy_extras import view3d_utils

from ..scene.fitting import landmarks
from .base import ExemplarOperator, why_linked
from .threaded import NAVIGATION


class LandmarkOperator(ExemplarOperator):
    @classmethod
    def why_not(cls, context, obj):
        if context.mode != "OBJECT":
            return "Leave the present mode first"
        if obj.exemplar_fit.scan is None:
            return "Choose the scan first"
        return why_linked(obj)


class EXEMPLAR_OT_fit_pick(LandmarkOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit_pick"
    bl_label = "Pick"
    bl_description = (
        "Click a point of the mesh, then the same point of the scan, again and again. Right click "
        "takes back the first of two, Enter or Esc ends"
    )

    @classmethod
    def why_not(cls, context, obj):
        if context.area is None or context.area.type != "VIEW_3D":
            return "Points are picked in a 3D view"
        return super().why_not(context, obj)

    def invoke(self, context, _event):
        self._name = self.subject(context).name
        self._vertex = None
        self._count = 0
        self._window = next(r for r in context.area.regions if r.type == "WINDOW")
        context.window.cursor_modal_set("CROSSHAIR")
        context.window_manager.modal_handler_add(self)
        self._ask(context)
        return {"RUNNING_MODAL"}

    def execute(self, _context):
        self.report({"ERROR"}, "Points are picked with the mouse: there is no window")
        return {"CANCELLED"}

    def modal(self, context, event):
        obj = bpy.data.objects.get(self._name)
        if obj is None or obj.exemplar_fit.scan is None:
            return self._end(context)
        if event.type in {"ESC", "RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return self._end(context)
        if event.type == "RIGHTMOUSE" and event.value == "PRESS":
            self._vertex = None
            self._ask(context)
            return {"RUNNING_MODAL"}
        if event.type == "LEFTMOUSE" and event.value == "PRESS" and self._is_inside(event):
            self._click(context, obj, event)
            return {"RUNNING_MODAL"}
        if event.type in NAVIGATION or event.type in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE"}:
            return {"PASS_THROUGH"}
        if event.type == "LEFTMOUSE":
            return {"PASS_THROUGH"}
        return {"RUNNING_MODAL"}

    def _is_inside(self, event):
        x, y = event.mouse_x - self._window.x, event.mouse_y - self._window.y
        return 0 <= x < self._window.width and 0 <= y < self._window.height

    def _click(self, context, obj, event):
        at = (event.mouse_x - self._window.x, event.mouse_y - self._window.y)
        view = context.area.spaces.active.region_3d
        origin = view3d_utils.region_2d_to_origin_3d(self._window, view, at)
        direction = view3d_utils.region_2d_to_vector_3d(self._window, view, at)
        depsgraph = context.evaluated_depsgraph_get()
        if self._vertex is None:
            self._vertex = landmarks.hit_vertex(obj, depsgraph, origin, direction)
        else:
            scan = obj.exemplar_fit.scan
            point = landmarks.hit_point(scan, depsgraph, origin, direction)
            if point is not None:
                landmarks.add(obj, landmarks.next_name(obj), self._vertex, point)
                self._vertex = None
                self._count += 1
        self._ask(context)
        context.area.tag_redraw()

    def _ask(self, context):
        where = "mesh" if self._vertex is None else "scan: the same point"
        count = f"{self._count} picked" if self._count else "Pick landmarks"
        context.workspace.status_text_set(
            f"{count}. Click a point of the {where}. Right click takes it back, Enter ends"
        )

    def cancel(self, context):
        self._tidy(context)

    def _end(self, context):
        self._tidy(context)
        return {"FINISHED"} if self._count else {"CANCELLED"}

    def _tidy(self, context):
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)


class EXEMPLAR_OT_fit_from_names(LandmarkOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit_from_names"
    bl_label = "From Names"
    bl_description = (
        "Make landmarks of the vertex groups, and of the empties parented to mesh and scan, that "
        "have the same names on both"
    )

    def run(self, _context, obj):
        count = landmarks.from_names(obj)
        self.report({"INFO"}, f"{count} landmarks")


class EXEMPLAR_OT_fit_from_handles(LandmarkOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit_from_handles"
    bl_label = "From Handles"
    bl_description = (
        "Make landmarks of the handles: move their empties to where the scan has these points"
    )

    def run(self, _context, obj):
        count = landmarks.from_handles(obj)
        self.report({"INFO"}, f"{count} landmarks: move the empties to their points on the scan")


class EXEMPLAR_OT_fit_landmark_remove(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.fit_landmark_remove"
    bl_label = "Remove Landmark"
    bl_description = "Remove the landmark of the list; its empty stays"

    everything: bpy.props.BoolProperty(
        name="All", description="Remove all landmarks", options={"SKIP_SAVE"}
    )

    @classmethod
    def why_not(cls, _context, obj):
        if not obj.exemplar_fit.landmarks:
            return "There are no landmarks"
        return why_linked(obj)

    def run(self, _context, obj):
        own = obj.exemplar_fit
        if self.everything:
            own.landmarks.clear()
        else:
            own.landmarks.remove(min(own.landmark_index, len(own.landmarks) - 1))
        own.landmark_index = max(0, min(own.landmark_index, len(own.landmarks) - 1))


classes = (
    EXEMPLAR_OT_fit_pick,
    EXEMPLAR_OT_fit_from_names,
    EXEMPLAR_OT_fit_from_handles,
    EXEMPLAR_OT_fit_landmark_remove,
)
register, unregister = bpy.utils.register_classes_factory(classes)
