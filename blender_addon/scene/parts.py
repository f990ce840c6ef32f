# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected parts of a mesh. Knows arrays, not Blender."""

import numpy


def components(vertex_count, corners):
    """int64 [V]: the lowest vertex of each vertex's connected part."""
    labels = numpy.arange(vertex_count)
    if not len(corners):
        return labels
    first = numpy.concatenate([corners[:, 0], corners[:, 1]]).astype(numpy.int64)
    second = numpy.concatenate([corners[:, 1], corners[:, 2]]).astype(numpy.int64)
    while True:
        roots_first, roots_second = labels[first], labels[second]
        low = numpy.minimum(roots_first, roots_second)
        # Hook roots onto lower ones, then flatten: a long strip takes few rounds, not one a vertex.
        joined = labels.copy()
        numpy.minimum.at(joined, roots_first, low)
        numpy.minimum.at(joined, roots_second, low)
        while not numpy.array_equal(joined, joined[joined]):
            joined = joined[joined]
        if numpy.array_equal(joined, labels):
            return labels
        labels = joined
