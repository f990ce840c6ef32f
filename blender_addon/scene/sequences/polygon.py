# SPDX-License-Identifier: GPL-3.0-or-later
"""The control polygon as an artist edits it: vertices in any order, and edges between them.

Knows nothing of Blender.
"""

from ...native import ExemplarError

BRANCH = "The control polygon must be one line: {}."


def ordered(count, edges, ranks, cyclic=False):
    """The vertices along the polygon: a list of `count` numbers.

    edges  pairs of vertices
    ranks  [count] numbers that rose along the polygon when it was last in order; they tell one end
           from the other
    cyclic  the polygon is closed, and begins at its lowest rank

    Raises ExemplarError where there is no such line.
    """
    around = _neighbours(count, edges)
    ends = [vertex for vertex in range(count) if len(around[vertex]) == 1]
    if cyclic:
        if ends:
            raise ExemplarError(BRANCH.format("it has to be closed, for its sequence is cyclic"))
        start = min(range(count), key=lambda vertex: (ranks[vertex], vertex))
        line = _walk(start, around, _second(start, around, ranks))
    else:
        if len(ends) != 2:
            raise ExemplarError(BRANCH.format("it has to have two ends"))
        start = min(ends, key=lambda vertex: (ranks[vertex], vertex))
        line = _walk(start, around, next(iter(around[start])))
    if len(line) != count:
        raise ExemplarError(BRANCH.format("it has separate parts"))
    return line


def _neighbours(count, edges):
    around = [dict() for _ in range(count)]  # in the order of the edges
    for first, second in edges:
        if first != second:
            around[first][second] = around[second][first] = None
    for vertex, near in enumerate(around):
        if len(near) > 2:
            raise ExemplarError(BRANCH.format(f"vertex {vertex} has {len(near)} edges"))
        if not near:
            raise ExemplarError(BRANCH.format(f"vertex {vertex} has no edge"))
    return around


def _second(start, around, ranks):
    """A closed polygon goes on from its beginning in the direction in which ranks rise."""
    return min(around[start], key=lambda vertex: (ranks[vertex], vertex))


def _walk(start, around, second):
    line, previous, vertex = [start], start, second
    while vertex != start:
        line.append(vertex)
        onward = [other for other in around[vertex] if other != previous]
        if not onward:
            break
        previous, vertex = vertex, onward[0]
    return line


def apply(sequence, old, new, cyclic):
    """Make `new` the control points of a sequence whose control points are `old`; both lists of
    (x, y), and points that are equal in both stay as they are, to the bit.

    Returns whether control points came or went.
    """
    if len(new) < 4:
        raise ExemplarError(f"The control polygon has {len(new)} points; 4 are needed.")
    before = len(old)
    first, last = _unchanged(old, new)
    points = list(old)
    while len(points) < len(new):
        # At an end there is no place for a new point: it becomes the one before, and the end moves.
        index = max(0 if cyclic else 1, min(len(points) - last, len(points) - 1))
        sequence.insert_control_point(index, new[min(index, len(new) - 1)])
        points.insert(index, new[min(index, len(new) - 1)])
    while len(points) > len(new):
        index = min(first, len(points) - 1)
        sequence.delete_control_point(index)
        del points[index]
    for start, stop in _runs([tuple(a) != tuple(b) for a, b in zip(points, new)]):
        sequence.move_control_points(start, new[start:stop])
    return len(new) != before


def _unchanged(old, new):
    """How many points agree at the beginning, and at the end."""
    shorter = min(len(old), len(new))
    first = 0
    while first < shorter and tuple(old[first]) == tuple(new[first]):
        first += 1
    last = 0
    while last < shorter - first and tuple(old[-1 - last]) == tuple(new[-1 - last]):
        last += 1
    return first, last


def _runs(flags):
    """[(start, stop)] of the stretches of true ones."""
    runs, start = [], None
    for index, flag in enumerate([*flags, False]):
        if flag and start is None:
            start = index
        elif not flag and start is not None:
            runs.append((start, index))
            start = None
    return runs
