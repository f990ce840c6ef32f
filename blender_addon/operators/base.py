# SPDX-License-Identifier: GPL-3.0-or-later
"""What all operators share: they say why they cannot run, and fail in words."""

from ..native import ExemplarError
from ..scene import rigs, status


class ExemplarOperator:
    """`why_not` says why the operator cannot run now; `run` does the work, or raises
    ExemplarError before it has changed anything."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        reason = why_no_rig(context) or cls.why_not(context, rigs.active_rig(context))
        if reason:
            cls.poll_message_set(reason)
        return not reason

    @classmethod
    def why_not(cls, _context, _obj):
        return ""

    def execute(self, context):
        obj = rigs.active_rig(context)
        try:
            self.run(context, obj)
        except ExemplarError as error:
            return self.fail(obj, error)
        status.forget(obj)
        return {"FINISHED"}

    def fail(self, obj, error):
        """The status line keeps the sentence, and what there is to select."""
        if obj is not None:
            status.remember(obj, error)
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


def why_no_rig(context):
    if rigs.active_rig(context) is None:
        return "Select a mesh, or one of its handles"
    return ""


def why_not_bound(obj):
    return "" if obj.exemplar.bound else "Bind the mesh first"


def why_linked(obj):
    if obj.library is not None:
        return "The object is linked: make a library override of it first"
    return ""
