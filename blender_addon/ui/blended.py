# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blended can do beside following handles."""

import bpy

from ..scene import deformers, rigs
from .main import Section


class EXEMPLAR_PT_blended(Section, bpy.types.Panel):
    bl_label = "Blended Tools"
    bl_order = 4  # after Pose, which is registered first
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        return deformers.current(rigs.active_rig(context)).identifier == "BLENDED"

    def draw(self, _context):
        layout = self.layout
        column = layout.column(align=True)
        one = column.operator(
            "exemplar.interpolate", text="Interpolate Here", icon="IPO_EASE_IN_OUT"
        )
        one.all_keys = False
        every = column.operator(
            "exemplar.interpolate", text="Interpolate All Keys", icon="IPO_BEZIER"
        )
        every.all_keys = True
        layout.operator("exemplar.skin_to_groups", text="Skin to Groups", icon="GROUP_VERTEX")


classes = (EXEMPLAR_PT_blended,)
register, unregister = bpy.utils.register_classes_factory(classes)
