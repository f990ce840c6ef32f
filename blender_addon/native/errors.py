# SPDX-License-Identifier: GPL-3.0-or-later
"""Statuses become exceptions here, and nowhere else."""

from ctypes import byref, c_int, c_size_t

from .declarations import Element, Status


class ExemplarError(Exception):
    """A call failed and changed nothing.

    status    Status
    element   Element: the kind of thing at fault
    index     which one of them, or None
    vertices  vertices to show to the user, or ()
    """

    def __init__(
        self, message, status=Status.ERROR_ARGUMENT, element=Element.NONE, index=None, vertices=()
    ):
        super().__init__(message)
        self.status = status
        self.element = element
        self.index = index
        self.vertices = vertices

    @property
    def cancelled(self):
        return self.status == Status.ERROR_CANCELLED


class LibraryError(ExemplarError):
    """The native library is not there, or is not one that this add-on can use."""

    def __init__(self, message):
        super().__init__(message, Status.ERROR_IO)


def last_message(library):
    """What this thread's last failure or warning was about. Ask before the next call."""
    return library.exm_last_error().decode("utf-8", "replace")


def check(library, status):
    """Raise what a negative status means. Returns the sentence of a warning, or ""."""
    if status == Status.OK:
        return ""
    message = last_message(library)
    if status > 0:
        return message
    kind, index = c_int(), c_size_t()
    library.exm_last_error_element(byref(kind), byref(index))
    element = Element(kind.value) if kind.value in Element._value2member_map_ else Element.NONE
    known = Status(status) if status in Status._value2member_map_ else Status.ERROR_INTERNAL
    raise ExemplarError(
        message or f"the library failed with status {status}",
        known,
        element,
        index.value if element != Element.NONE else None,
    )
