# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights: a bake as values of the exemplars' own shape keys, which any engine can play.

For each frame

    min over v of  | basis + sum_s v_s (key_s - relative_s) - positions |^2,   v_s within slider s

A blend of keys is linear, the solved shape is not: what is lost is measured and reported.
"""

from dataclasses import dataclass

import numpy as np

from . import least_squares


@dataclass(frozen=True)
class Misfit:
    """Distances between the blend of keys and the solved mesh, as shares of the diagonal."""

    rms: float
    largest: float
    worst_frame: int  # the frame of `largest`


class KeyFit:
    """Fits the values of S keys to positions.

    basis   [V][3]
    deltas  [S][V][3] what value 1 of each key adds to the basis
    lower, upper  [S] the sliders' ranges
    """

    def __init__(self, basis, deltas, lower, upper):
        self._basis = np.asarray(basis, dtype=np.float64).ravel()
        self._deltas = np.asarray(deltas, dtype=np.float64).reshape(len(deltas), -1)
        self._gram = self._deltas @ self._deltas.T
        self._lower = np.asarray(lower, dtype=np.float64)
        self._upper = np.asarray(upper, dtype=np.float64)
        self._values = None

    def fit(self, positions):
        """(float32 values [S], distances [V]) for positions [V][3]."""
        offset = np.asarray(positions, dtype=np.float64).ravel() - self._basis
        self._values = least_squares.solve(
            self._gram, self._deltas @ offset, self._lower, self._upper, start=self._values
        )
        # What the curve will hold, and no further than the slider goes.
        values = self._values.astype(np.float32)
        residual = (values.astype(np.float64) @ self._deltas - offset).reshape(-1, 3)
        return values, np.linalg.norm(residual, axis=1)


class ErrorSum:
    """Sums up distances frame by frame, without keeping them."""

    def __init__(self):
        self._squares = 0.0
        self._count = 0
        self._largest = -1.0
        self._worst_frame = 0

    def add(self, frame, distances):
        """distances  [V]"""
        self._squares += float(distances @ distances)
        self._count += len(distances)
        if distances.max() > self._largest:
            self._largest, self._worst_frame = float(distances.max()), frame

    def misfit(self, diagonal):
        rms = (self._squares / self._count) ** 0.5
        return Misfit(rms / diagonal, self._largest / diagonal, self._worst_frame)
