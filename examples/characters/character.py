# SPDX-License-Identifier: GPL-3.0-or-later
"""What every character here consists of. Numbers only: Blender is not needed."""

import hashlib
import importlib
import pickle
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np


@dataclass
class Handle:
    name: str
    kind: str  # PINNED, ORIENTED or FREE
    vertices: np.ndarray


@dataclass
class Key:
    """At this frame the handles are where the exemplar `pose` has them, but for some of them.

    amount  1: as in the exemplar; 0: as in the Basis; more than 1: beyond
    others  (pose, amount) of the handles whose names begin so
    """

    frame: int
    pose: str
    amount: float = 1.0
    others: dict = field(default_factory=dict)
    note: str = ""

    @property
    def label(self):
        return self.note or self.pose


@dataclass
class Look:
    """The camera: its heading and height in degrees, what it is aimed at, and the width it sees."""

    heading: float
    height: float
    centre: tuple
    width: float
    aspect: float  # width over height


@dataclass
class Character:
    name: str
    faces: np.ndarray
    shapes: dict  # Basis first: name -> [V][3]
    colours: np.ndarray  # [V][3], linear
    handles: list
    keys: list
    rotations: bool  # whether parts turn; faces do without
    title: str
    strip: tuple  # frames to show
    look: Look

    def targets(self, key):
        """Centre [3] and turn [3][3] of every handle at a key."""
        basis = self.shapes["Basis"]
        result = []
        for handle in self.handles:
            pose, amount = key.pose, key.amount
            for start, other in key.others.items():
                if handle.name.startswith(start):
                    pose, amount = other
            posed = basis + amount * (self.shapes[pose] - basis)
            rest, there = basis[handle.vertices], posed[handle.vertices]
            result.append((there.mean(axis=0), closest_turn(rest, there)))
        return result


def modelled(name, folder):
    """The character, modelled anew only when the scripts here have changed."""
    scripts = sorted(Path(__file__).parent.glob("*.py"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in scripts)).hexdigest()
    kept = folder / "models" / f"{name}.pickle"
    if kept.is_file():
        made_by, character = pickle.loads(kept.read_bytes())
        if made_by == digest:
            return character
    character = importlib.import_module(f"characters.{name}").build()
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_bytes(pickle.dumps((digest, character)))
    return character


def closest_turn(rest, posed):
    """The rotation that takes points to points best, about their centres."""
    spread = (posed - posed.mean(axis=0)).T @ (rest - rest.mean(axis=0))
    u, _, vt = np.linalg.svd(spread)
    return u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt


def ball(positions, centre, radius, where=True):
    """The vertices within `radius` of a point, of those that `where` allows."""
    near = np.linalg.norm(positions - np.asarray(centre), axis=1) <= radius
    return np.flatnonzero(near & where)


def disjoint(handles):
    """A vertex belongs to one handle at most: the first that has it."""
    taken = np.empty(0, dtype=int)
    for handle in handles:
        handle.vertices = np.setdiff1d(handle.vertices, taken)
        taken = np.concatenate([taken, handle.vertices])
    return handles
