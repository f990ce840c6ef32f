# SPDX-License-Identifier: GPL-3.0-or-later
"""Switch exemplars on and off."""

import bpy

from ..scene import exemplars
from .base import ExemplarOperator, why_linked


class EXEMPLAR_OT_exemplar_toggle(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.exemplar_toggle"
    bl_label = "Switch Exemplar"
    bl_description = (
        "Whether this shape key is one of the poses that the result is made of. "
        "Takes effect at the next Bind"
    )

    name: bpy.props.StringProperty(name="Shape Key", description="The exemplar to switch")

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj)

    def run(self, _context, obj):
        exemplars.set_enabled(obj, self.name, not exemplars.is_enabled(obj, self.name))


class EXEMPLAR_OT_exemplar_switch_all(ExemplarOperator, bpy.types.Operator):
    bl_idname = "exemplar.exemplar_switch_all"
    bl_label = "Switch All Exemplars"
    bl_description = "Switch all exemplars on or off. Takes effect at the next Bind"

    enabled: bpy.props.BoolProperty(
        name="On", description="Switch them on rather than off", default=True
    )

    @classmethod
    def why_not(cls, _context, obj):
        return why_linked(obj)

    def run(self, _context, obj):
        for name in exemplars.all_names(obj):
            exemplars.set_enabled(obj, name, self.enabled)


classes = (EXEMPLAR_OT_exemplar_toggle, EXEMPLAR_OT_exemplar_switch_all)
register, unregister = bpy.utils.register_classes_factory(classes)
