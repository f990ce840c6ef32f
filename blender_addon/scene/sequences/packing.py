# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted sequence as bytes in the .blend file: it goes along when a file is saved, moved or
appended from, and undo knows it.

The bytes are those of the library's file, in a text data-block, which says in words what it is.
They are kept as base64: of properties of bytes, later Blenders lose the end.
What edits change is at the end of the file, and short: it is kept apart, so that an undo step does
not hold the shapes again.
"""

import base64
import os
import tempfile
import uuid

import bpy
import numpy

from ...native import ExemplarError, Sequence

FIT = "exemplar_fit"  # the file as it was after the fit
KEPT = "exemplar_kept"  # how many bytes of it still hold
EDIT = "exemplar_edit"  # and what follows them
REVISION = "exemplar_revision"  # changes with every change
IDENTITY = "exemplar_identity"

WORDS = """\
This text holds an animation for the add-on Exemplar: {about}.

The animation itself is packed beside these words. Delete the text only together with the objects
that show it.
"""


def dump(sequence):
    """bytes"""
    with tempfile.TemporaryDirectory(prefix="exemplar-") as folder:
        path = os.path.join(folder, "packed.exmseq")
        sequence.save(path)
        with open(path, "rb") as file:
            return file.read()


def parse(data):
    """A Sequence. Raises ExemplarError where the bytes are damaged."""
    with tempfile.TemporaryDirectory(prefix="exemplar-") as folder:
        path = os.path.join(folder, "packed.exmseq")
        with open(path, "wb") as file:
            file.write(data)
        try:
            return Sequence.load(path)
        except ExemplarError as error:
            words = str(error).replace(path, "the packed sequence")
            raise ExemplarError(f"The sequence in this file cannot be read: {words}.") from error


def create(name, data, about):
    """A text data-block with a fitted sequence."""
    text = bpy.data.texts.new(name)
    text.use_fake_user = False
    text[IDENTITY] = str(uuid.uuid4())
    replace(text, data, about)
    return text


def replace(text, data, about):
    """Another fit in the place of the old one."""
    text.clear()
    text.write(WORDS.format(about=about))
    write_bytes(text, FIT, data)
    _set_edit(text, len(data), b"")


def write(text, data):
    """Keep what has changed since the fit."""
    fit = read_bytes(text, FIT)
    kept = _common(fit, data)
    _set_edit(text, kept, data[kept:])


def read(text):
    if FIT not in text:
        raise ExemplarError(f"The text '{text.name}' has lost the sequence that was packed in it.")
    return read_bytes(text, FIT)[: text[KEPT]] + read_bytes(text, EDIT)


def write_bytes(text, name, data):
    text[name] = base64.b64encode(data).decode("ascii")


def read_bytes(text, name):
    try:
        return base64.b64decode(text[name], validate=True)
    except (TypeError, ValueError) as error:
        raise ExemplarError(f"The sequence packed in '{text.name}' is damaged.") from error


def _set_edit(text, kept, edit):
    text[KEPT] = kept
    write_bytes(text, EDIT, edit)
    text[REVISION] = str(uuid.uuid4())


def _common(first, second):
    """How many bytes agree from the beginning on."""
    size = min(len(first), len(second))
    a = numpy.frombuffer(first, numpy.uint8, size)
    b = numpy.frombuffer(second, numpy.uint8, size)
    differ = numpy.flatnonzero(a != b)
    return int(differ[0]) if len(differ) else size
