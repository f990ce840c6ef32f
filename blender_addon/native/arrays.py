# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays as the library wants them: contiguous, of one type, of a shape that was checked."""

import numpy

from .errors import ExemplarError


def as_input(name, values, dtype, shape):
    """`values` as a contiguous array of `dtype`; -1 in `shape` stands for any size."""
    try:
        array = numpy.ascontiguousarray(values, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise ExemplarError(f"{name} cannot be read as an array of {dtype.__name__}: {error}")
    fits = array.ndim == len(shape) and all(
        wanted in (-1, size) for wanted, size in zip(shape, array.shape)
    )
    if not fits:
        wanted = " x ".join("any" if size < 0 else str(size) for size in shape)
        given = " x ".join(map(str, array.shape)) or "a single number"
        raise ExemplarError(f"{name} has the shape {given}; {wanted} is wanted")
    return array


def as_indices(name, values, dtype, shape):
    """Like as_input, for indices: a negative or fractional one would wrap into a valid one."""
    array = numpy.asarray(values)
    if array.size and not numpy.issubdtype(array.dtype, numpy.integer):
        raise ExemplarError(f"{name} must be whole numbers")
    if array.size and (array.min() < 0 or array.max() > numpy.iinfo(dtype).max):
        raise ExemplarError(f"{name} must lie between 0 and {numpy.iinfo(dtype).max}")
    return as_input(name, array, dtype, shape)


def as_output(name, out, dtype, shape):
    """`out` if it fits, or a new array."""
    if out is None:
        return numpy.empty(shape, dtype)
    if out.dtype != dtype or out.shape != shape or not out.flags.c_contiguous:
        raise ExemplarError(f"{name} must be a contiguous {dtype.__name__} array of shape {shape}")
    if not out.flags.writeable:
        raise ExemplarError(f"{name} cannot be written to")
    return out
