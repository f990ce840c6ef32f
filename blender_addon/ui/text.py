# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in a sidebar of any width."""

import blf

FONT = 0
# What a label with an icon cannot use of the region: margins, icon, scroll bar, in points.
MARGIN = 94
NARROWEST = 60


def sentence(layout, context, text, icon="NONE"):
    """A label that breaks into lines; the icon stands before the first."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for index, line in enumerate(wrap(context, text)):
        column.label(text=line, icon=icon if index == 0 else "BLANK1")


def wrap(context, text):
    preferences = context.preferences
    scale = preferences.system.ui_scale
    blf.size(FONT, preferences.ui_styles[0].widget.points * scale)
    width = max(NARROWEST, context.region.width / scale - MARGIN) * scale
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if blf.dimensions(FONT, longer)[0] <= width:
            lines[-1] = longer
        else:
            lines += _pieces(word, width)
    return [line for line in lines if line]


def _pieces(word, width):
    """A path can be longer than a line."""
    pieces = [""]
    for letter in word:
        if pieces[-1] and blf.dimensions(FONT, pieces[-1] + letter)[0] > width:
            pieces.append("")
        pieces[-1] += letter
    return pieces
