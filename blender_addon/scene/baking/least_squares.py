# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounded least squares on the normal equations, for a few dozen unknowns.

    min 1/2 x'Gx - c'x   subject to   lower <= x <= upper

An active-set method in the manner of Stark and Parker, "Bounded-variable least-squares: an
algorithm and applications" (1995), which extends Lawson and Hanson's NNLS to two bounds: solve on
the free variables; walk there until one meets its bound and is held; when the free ones are at
rest, let go of the held variable that pulls most. Every step lowers the objective and there are
finitely many sets, so it ends; the cap is for rounding.
"""

import numpy as np

# Pulls below this share of the data's size are rounding.
_RELATIVE_TOLERANCE = 1e-13
# Singular values of G below this share of the largest are treated as zero: two equal shapes share
# their weight.
_RANK_TOLERANCE = 1e-12


def solve(gram, right, lower, upper, start=None):
    """The minimiser, [n].

    gram   [n][n] symmetric, positive semidefinite
    right  [n] c
    start  [n] or None; near the answer (the frame before), it saves steps
    """
    count = len(right)
    gram = np.asarray(gram, dtype=np.float64)
    right = np.asarray(right, dtype=np.float64)
    lower = np.asarray(lower, dtype=np.float64)
    upper = np.asarray(upper, dtype=np.float64)
    x = np.clip(_least_norm(gram, right) if start is None else start, lower, upper)
    free = (x > lower) & (x < upper)
    fixed = lower >= upper
    blocked = np.zeros(count, dtype=bool)
    scale = max(np.abs(right).max(initial=0.0), np.abs(gram).max(initial=0.0))
    tolerance = _RELATIVE_TOLERANCE * scale

    for _ in range(20 * count + 20):
        released = _settle(gram, right, lower, upper, x, free)
        if released:
            blocked[:] = False
        pull = right - gram @ x
        wants = ((pull > tolerance) & (x <= lower)) | ((pull < -tolerance) & (x >= upper))
        wants &= ~free & ~fixed & ~blocked
        if not wants.any():
            break
        worst = int(np.argmax(np.where(wants, np.abs(pull), -1.0)))
        free[worst] = True
        # Rounding can send a variable straight back to its bound; it then waits until something
        # else has moved.
        blocked[worst] = True
    return x


def _settle(gram, right, lower, upper, x, free):
    """Minimise over the free variables within the bounds, in place. True if anything moved."""
    moved = False
    while free.any():
        indices = np.flatnonzero(free)
        held = right[indices] - gram[np.ix_(indices, ~free)] @ x[~free]
        target = _least_norm(gram[np.ix_(indices, indices)], held)
        direction = target - x[indices]
        bound = np.where(direction > 0.0, upper[indices], lower[indices])
        with np.errstate(divide="ignore", invalid="ignore"):
            steps = np.where(direction != 0.0, (bound - x[indices]) / direction, np.inf)
        first = int(np.argmin(steps))
        step = min(1.0, max(0.0, steps[first]))
        moved |= step > 0.0 and bool(np.any(direction != 0.0))
        if steps[first] > 1.0:
            x[indices] = target
            break
        x[indices] += step * direction
        x[indices[first]] = bound[first]
        free[indices[first]] = False
    np.clip(x, lower, upper, out=x)
    return moved


def _least_norm(matrix, right):
    return np.linalg.lstsq(matrix, right, rcond=_RANK_TOLERANCE)[0]
