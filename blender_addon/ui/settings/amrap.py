# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of AMRAP."""


def draw_bind(layout, obj):
    layout.prop(obj.exemplar.amrap, "edge_groups")


def draw_pose(layout, obj):
    settings = obj.exemplar.amrap
    layout.prop(settings, "lambda_")
    layout.prop(settings, "blend")
    layout.prop(settings, "rotations")


def draw_advanced(layout, obj):
    settings = obj.exemplar.amrap
    layout.prop(settings, "iterations")
    layout.prop(settings, "tolerance")
    layout.prop(settings, "descent")
