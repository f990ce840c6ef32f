# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Blended."""


def draw_bind(layout, obj):
    settings = obj.exemplar.blended
    layout.prop(settings, "dictionary")
    if settings.dictionary == "EIGENFUNCTIONS":
        layout.prop(settings, "eigenfunctions")
    layout.prop(settings, "bones")
    layout.prop(settings, "atoms_kept")


def draw_pose(layout, obj):
    settings = obj.exemplar.blended
    layout.prop(settings, "constraint_weight")
    layout.prop(settings, "smoothness")
    layout.prop(settings, "sparsity")
    layout.prop(settings, "scale")


def draw_advanced(layout, obj):
    settings = obj.exemplar.blended
    layout.prop(settings, "begin")
    layout.prop(settings, "average_iterations")
    layout.prop(settings, "minimal_iterations")
    layout.prop(settings, "final_iterations")
    layout.prop(settings, "tolerance")
