# SPDX-License-Identifier: GPL-3.0-or-later
"""The creature walks; and a stout cousin of it, of another mesh, that stands like it."""

import importlib.util

import numpy as np

from characters import implicit
from characters.quadruped import Pose, Rig

# When in the cycle each foot is lifted: a walk, left hind foot first.
PHASES = {"hind.L": 0.0, "front.L": 0.25, "hind.R": 0.5, "front.R": 0.75}
ON_THE_GROUND = 0.62  # of a cycle
STRIDE, LIFT = 0.21, 0.2
CYCLE = 16  # frames


def walk_pose(time, vigour=1.0):
    """The pose at a time in cycles; with vigour the feet go higher and the head nods."""
    feet = {leg: _foot((time + phase) % 1.0, leg, vigour) for leg, phase in PHASES.items()}
    twice, once = np.sin(4 * np.pi * time), np.sin(2 * np.pi * time)
    sway = 9.0 * np.cos(2 * np.pi * (time - np.arange(5) * 0.11))
    return Pose(
        hips=(0.02 * once, 0, 0.02 * vigour * twice),
        chest=(-0.02 * once, 0, -0.025 * vigour * twice),
        hips_turn=(0, 3 * once, 2 * once),
        chest_turn=(0, -3 * once, -2 * once),
        neck=(7 * vigour * twice, 4 * once, 0),
        head=(-5 * vigour * twice, 3 * once, 0),
        feet=feet,
        tail=tuple((3.0 * vigour, angle) for angle in sway),
        ears=(-6 * vigour * twice, 6 * vigour * abs(once)),
    )


def _foot(phase, leg, vigour):
    """(x, y, z, pitch of the paw, knee outwards): back along the ground, forwards through the
    air."""
    if phase < ON_THE_GROUND:
        return (0, STRIDE * (2 * phase / ON_THE_GROUND - 1), 0, 0, 0)
    share = (phase - ON_THE_GROUND) / (1 - ON_THE_GROUND)
    forwards = np.cos(np.pi * share)
    height = np.sin(np.pi * share) * LIFT * vigour * (1.0 if leg.startswith("front") else 0.8)
    return (0, STRIDE * forwards, height, -35.0 * np.sin(np.pi * share), 0.05)


def walk(cycles=3):
    """The poses of a walk that grows livelier, one a frame."""
    count = CYCLE * cycles + 1
    return [walk_pose(i / CYCLE, 0.7 + 0.9 * i / (count - 1)) for i in range(count)]


# Poses to match two characters by: a cycle at both ends of the liveliness.
MATCHED = {
    f"Step {number + 1}": (number % 8 / 8, 0.7 if number < 8 else 1.6) for number in range(16)
}


class Walker:
    """A creature's mesh with its rig: what it looks like in a pose."""

    def __init__(self, module):
        self.positions, self.faces = module.surface()
        self.colours = module.colours(self.positions)
        self._rig = Rig(module.REST, module.SPREAD)
        distances = {chain: module.chain_field(self.positions, chain) for chain in module.REST}
        edges = implicit.edges_of(self.faces)
        self._weights = self._rig.weights(self.positions, distances, edges)

    def posed(self, pose):
        """float64 [V][3]"""
        return self._rig.carry(self.positions, self._weights, pose)

    def matched(self):
        """{name: [V][3]}, the Basis first."""
        shapes = {"Basis": self.positions}
        for name, (time, vigour) in MATCHED.items():
            shapes[name] = self.posed(walk_pose(time, vigour))
        return shapes


def creature():
    return Walker(importlib.import_module("characters.creature"))


def cousin():
    """The same joints under a stouter body, in a mesh of its own."""
    spec = importlib.util.find_spec("characters.creature")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.CELL = 0.056
    module.RADII = {
        "spine": [0.44, 0.52, 0.42],
        "head": [0.31, 0.27, 0.34, 0.17],
        "tail": [0.2, 0.12, 0.1, 0.08, 0.09, 0.13],
        "front": [0.24, 0.26, 0.2, 0.17, 0.16],
        "hind": [0.26, 0.32, 0.23, 0.17, 0.16],
        "ear": [0.1, 0.11, 0.06],
    }
    module.COAT = np.array([0.32, 0.36, 0.42])
    return Walker(module)
