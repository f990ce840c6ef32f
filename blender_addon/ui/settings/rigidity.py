# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Rigidity."""


def draw_bind(layout, obj):
    layout.prop(obj.exemplar.rigidity, "handle_size")


def draw_pose(layout, obj):
    layout.prop(obj.exemplar.rigidity, "tolerance")


def draw_advanced(layout, obj):
    layout.prop(obj.exemplar.rigidity, "iterations")
    layout.prop(obj.exemplar.rigidity, "acceleration")
