# SPDX-License-Identifier: GPL-3.0-or-later
"""Display: what is shown besides the mesh itself."""

import bpy

from ..scene import figures, rigs
from .main import Section


class EXEMPLAR_PT_display(Section, bpy.types.Panel):
    bl_label = "Display"
    bl_order = 6
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        display = context.window_manager.exemplar_display
        column = layout.column(align=True)
        column.prop(display, "show_handles")
        row = column.row()
        row.active = display.show_handles
        row.prop(display, "show_names")
        rig = rigs.active_rig(context).exemplar
        if 0 <= rig.handle_index < len(rig.handles):
            column = layout.column(align=True)
            column.label(text="Shape of the Handle")
            column.prop(rig.handles[rig.handle_index], "shape", text="")
        column = layout.column(align=True)
        column.operator("exemplar.influence_show", icon="COLOR")
        column.operator("exemplar.influence_hide", icon="X")
        layout.prop(display, "show_figures")
        if display.show_figures:
            _draw_figures(layout)


def _draw_figures(layout):
    seen = figures.of_late()
    column = layout.column(align=True)
    if seen is None:
        column.label(text="Move a handle", icon="INFO")
        return
    rows = (
        ("Frames a second", f"{seen.per_second:.0f}" if seen.per_second else "-"),
        ("Ours of a frame", f"{1000 * seen.own:.2f} ms"),
        ("Solve", f"{1000 * seen.solve:.2f} ms"),
        ("Iterations", f"{seen.iterations:.1f}"),
    )
    for name, value in rows:
        row = column.split(factor=0.6)
        row.label(text=name)
        row.label(text=value)


classes = (EXEMPLAR_PT_display,)
register, unregister = bpy.utils.register_classes_factory(classes)
