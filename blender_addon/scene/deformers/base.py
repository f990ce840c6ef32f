# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on asks of a kind of deformer."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Live:
    """Data that a bound deformer takes up without a Rebind: what is painted, for one."""

    digest: str
    data: Any


class DeformerType:
    """One kind of deformer.

    `build` and `apply` may run in a thread and see no Blender data; `solve` is called with the
    deformer's lock held. All else runs where Blender's data may be read, and writes nothing.
    """

    identifier = ""  # in files: a value of RigProperties.deformer
    label = ""
    description = ""
    exemplars_needed = 2
    takes_exemplars = True  # False: shape keys may be edited freely
    handles_needed = 2

    # ------------------------------------------------------------------------------------- bind

    def bind_settings(self, obj):
        """{name: value}, as JSON can keep it: what takes effect at Bind only."""
        return {}

    def words(self):
        """{name of a bind setting: what the artist calls it}"""
        return {}

    def live_key(self, obj):
        """Cheap to get, hashable, and different where live data may be."""
        return ()

    def live_data(self, obj):
        """Live, or None where this kind has no such data. Raises ExemplarError."""
        return None

    def build(self, mesh, gathered, progress):
        """The native deformer of BindInputs."""
        raise NotImplementedError

    def apply(self, deformer, gathered):
        """Let a deformer take up other live data than it was built with."""
        raise NotImplementedError

    # ------------------------------------------------------------------------------------ solve

    def solve_settings(self, rig):
        """The settings of a stateless solve, frozen; `rig` is evaluated, for they can be
        animated."""
        raise NotImplementedError

    def solve(self, deformer, targets, settings, stateless):
        """A SolveReport. A solve that is not stateless is a step of a drag: as little as will do,
        for the next is on its way."""
        raise NotImplementedError

    def blend_average(self, deformer):
        """float64 [S], sums to 1; None for kinds that do not blend."""
        return None

    def note(self, deformer, settings):
        """What the last solve found beside positions, in a word or two for the status line."""
        return ""
