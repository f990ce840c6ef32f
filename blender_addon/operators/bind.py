# SPDX-License-Identifier: GPL-3.0-or-later
"""Bind, rebind, unbind."""

import functools

import bpy

from ..scene import bindings, live, setup, status
from .base import ExemplarOperator, why_linked, why_not_bound
from .threaded import ThreadedOperator


class BindOperator(ThreadedOperator):
    title = "Bind"

    @classmethod
    def why_not(cls, _context, obj):
        return status.library_problem() or why_linked(obj) or status.why_not_ready(obj)

    def prepare(self, context, obj):
        context.view_layer.update()
        self._gathered = setup.prepare(obj)
        yield 0.0, "preparing"
        return functools.partial(bindings.build, self._gathered)

    def finish(self, _context, obj, result):
        deformer, warnings = result
        notes = setup.commit(obj, self._gathered, deformer, warnings)
        live.update(obj)
        for note in notes:
            self.report({"WARNING" if warnings else "INFO"}, note)

    def drop(self, result):
        deformer, _warnings = result
        deformer.close()


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
