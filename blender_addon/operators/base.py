# SPDX-License-Identifier: GPL-3.0-or-later
"""What all operators share: they say why they cannot run, and fail in words."""

from ..native import ExemplarError
from ..scene import rigs, status


class ExemplarOperator:
    """`why_not` says why the operator cannot run now; `run` does the work, or raises
    ExemplarError before it has changed anything."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def subject(cls, context):
        """The object that the operator is about, or None."""
        return rigs.active_rig(context)

    @classmethod
    def why_no_subject(cls):
        return "Select a mesh, or one of its handles"

    @classmethod
    def poll(cls, context):
        obj = cls.subject(context)
        reason = cls.why_no_subject() if obj is None else cls.why_not(context, obj)
        if reason:
            cls.poll_message_set(reason)
        return not reason

    @classmethod
    def why_not(cls, _context, _obj):
        return ""

    def execute(self, context):
        obj = self.subject(context)
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


def why_not_bound(obj):
    return "" if obj.exemplar.bound else "Bind the mesh first"


def why_linked(obj):
    if obj.library is not None:
        return "The object is linked: make a library override of it first"
    return ""
