# SPDX-License-Identifier: GPL-3.0-or-later
"""What to tell the artist of a sequence. Draw functions ask: nothing is written here."""

from .. import status
from . import solving, store


def describe(owner):
    """[status.Line], the most important first."""
    data = owner.exemplar_sequence
    lines = []
    error = status.last_error(owner)
    if error is not None:
        lines.append(status.Line("ERROR", str(error)))
    mode = solving.paused_by(owner)
    shown, state = store.peek_shown(owner), store.peek(owner)
    if data.data is None:
        lines.append(status.Line("ERROR", "The text with the sequence was deleted."))
    elif mode:
        lines.append(status.Line("PAUSE", f"Paused in {mode}."))
    elif shown is not None and shown.problem is not None:
        lines.append(status.Line("ERROR", str(shown.problem)))
    elif state is not None and state.problem is not None:
        lines.append(status.Line("ERROR", f"Not taken: {state.problem}"))
    elif not data.live:
        lines.append(status.Line("PAUSE", "Live is off. The mesh keeps the shape that it has."))
    if data.summary:
        lines.append(status.Line("CHECKMARK", data.summary[:1].upper() + data.summary[1:] + "."))
    return lines
