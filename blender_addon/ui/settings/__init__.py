# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of each kind of deformer, for the sections of the panel to draw in their places.

    draw_bind(layout, obj)       what takes effect at Bind
    draw_pose(layout, obj)       what one turns while posing
    draw_advanced(layout, obj)   what one seldom turns
"""

from . import amrap, blended, rigidity

DRAWN_BY = {
    "AMRAP": amrap,
    "BLENDED": blended,
    "RIGIDITY": rigidity,
}


def of(type_):
    return DRAWN_BY[type_.identifier]
