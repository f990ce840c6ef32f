# SPDX-License-Identifier: GPL-3.0-or-later
"""Versions, statuses, progress, and the types of arguments."""

from ctypes import (
    CFUNCTYPE,
    POINTER,
    c_char_p,
    c_double,
    c_int,
    c_int32,
    c_size_t,
    c_uint32,
    c_void_p,
)
from enum import IntEnum

ABI_VERSION = 1

# int (*exm_progress)(void *user, double fraction, const char *stage);
Progress = CFUNCTYPE(c_int, c_void_p, c_double, c_char_p)

# Arrays are passed as addresses (see arrays.py), because typed pointers cost more than the call.
ARRAY = c_void_p
MESH = c_void_p
DEFORMER = c_void_p
STATUS = c_int32


class Status(IntEnum):
    OK = 0
    WARNING_NOT_CONVERGED = 1
    WARNING_MESH = 2
    WARNING_EXEMPLARS = 3
    WARNING_UNDERDETERMINED = 4
    WARNING_CONTRADICTORY = 5
    WARNING_FIT = 6
    WARNING_AMBIGUOUS = 7
    ERROR_ARGUMENT = -1
    ERROR_OUT_OF_MEMORY = -2
    ERROR_CANCELLED = -3
    ERROR_TOPOLOGY = -4
    ERROR_UNCONSTRAINED = -5
    ERROR_NUMERIC = -6
    ERROR_IO = -7
    ERROR_INTERNAL = -8


class Element(IntEnum):
    NONE = 0
    VERTEX = 1
    FACE = 2
    HANDLE = 3
    EXEMPLAR = 4
    LANDMARK = 5
    POINT = 6


FUNCTIONS = {
    # uint32_t exm_abi_version(void);
    "exm_abi_version": (c_uint32,),
    # const char *exm_version(void);
    "exm_version": (c_char_p,),
    # const char *exm_last_error(void);
    "exm_last_error": (c_char_p,),
    # void exm_last_error_element(exm_element *kind, size_t *index);
    "exm_last_error_element": (None, POINTER(c_int), POINTER(c_size_t)),
}


def initialised(library, structure, initialise, **values):
    """A structure as its _init function leaves it, then changed field by field."""
    filled = structure()
    getattr(library, initialise)(filled)
    for name, value in values.items():
        setattr(filled, name, value)
    return filled
