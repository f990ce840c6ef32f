# SPDX-License-Identifier: GPL-3.0-or-later
"""A small rig for four-legged characters: from offsets and angles to the joints of every chain."""

from dataclasses import dataclass, field

import numpy as np

from characters import implicit, posing
from characters.posing import about, multiply, rotate

X, Y, Z = np.eye(3)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass
class Pose:
    """Offsets from rest in the mesh's unit of length; angles in degrees, as (pitch, yaw, roll)."""

    hips: tuple = (0, 0, 0)
    hips_turn: tuple = (0, 0, 0)
    chest: tuple = (0, 0, 0)
    chest_turn: tuple = (0, 0, 0)
    belly: tuple = (0, 0, 0)
    neck: tuple = (0, 0, 0)
    head: tuple = (0, 0, 0)
    neck_stretch: float = 1.0
    feet: dict = field(default_factory=dict)  # leg: (x, y, z, pitch of the paw, knee outwards)
    tail: tuple = ((0, 0),) * 5  # (pitch, yaw) a bone, each added to the one before
    tail_stretch: float = 1.0
    ears: tuple = (0, 0)  # (back, outwards)
    girth: dict = field(default_factory=dict)  # chain: scale at each joint


def euler(pitch, yaw, roll):
    """Nose up, nose to its left, head tilted to its left: about x, z and the long axis y."""
    return multiply(about(Z, yaw), multiply(about(X, -pitch), about(Y, roll)))


class Rig:
    """Chains of joints at rest, and which nodes of them carry each vertex."""

    def __init__(self, rest, spread):
        """spread: how far along its chain a node is felt, by kind of chain."""
        self.rest = rest
        curves = {
            name: posing.curve(joints, posing.NODES_PER_BONE) for name, joints in rest.items()
        }
        self.nodes = np.vstack([points for points, _ in curves.values()])
        self.directions = np.vstack([tangents for _, tangents in curves.values()])
        self.sizes = {name: len(points) for name, (points, _) in curves.items()}
        self.spread = spread

    def weights(self, positions, distances, edges, rounds=40):
        """Weights [V][N]: of each chain by the distance to its own surface, smoothed; within it, by
        nearness.
        """
        near = np.stack(
            [np.exp(-((np.maximum(d, 0.0) / 0.07) ** 2)) for d in distances.values()], axis=1
        )
        share = near / near.sum(axis=1, keepdims=True)
        for _ in range(rounds):
            share = 0.5 * (share + implicit.neighbour_mean(share, edges))
        share /= share.sum(axis=1, keepdims=True)
        columns, start = [], 0
        for chain, (name, size) in enumerate(self.sizes.items()):
            nodes = self.nodes[start : start + size]
            squared = ((positions[:, None, :] - nodes[None]) ** 2).sum(axis=2)
            squared -= squared.min(axis=1, keepdims=True)
            felt = np.exp(-0.5 * squared / self.spread[name.split(".")[0]] ** 2)
            columns.append(share[:, chain : chain + 1] * felt / felt.sum(axis=1, keepdims=True))
            start += size
        return np.hstack(columns)

    def carry(self, positions, weights, pose):
        chains = self.chains(pose)
        posed = []
        for name, rest in self.rest.items():
            joints, root, end = chains[name]
            kind = pose.girth.get(name, pose.girth.get(name.split(".")[0], [1.0] * len(rest)))
            posed.append(posing.pose_chain(rest, joints, root, end, kind))
        posed = [np.concatenate(parts) for parts in zip(*posed)]
        return posing.carry(positions, weights, self.nodes, self.directions, posed)

    def chains(self, pose):
        """Posed joints, root and end rotation (or None) of each chain."""
        rest = self.rest
        hips, chest = euler(*pose.hips_turn), euler(*pose.chest_turn)
        spine = rest["spine"] + np.array([pose.hips, (0, 0, 0), pose.chest], dtype=float)
        spine[1] += 0.5 * (np.add(pose.hips, pose.chest)) + pose.belly
        result = {"spine": (spine, hips, chest)}

        def attached(point, joint, turned):
            return spine[joint] + rotate(turned, point - rest["spine"][joint])

        result["head"], skull, turned = self._head(pose, chest, attached(rest["head"][0], 2, chest))
        result["tail"] = self._tail(pose, hips, attached(rest["tail"][0], 0, hips))
        for name in rest:
            if name.startswith("front"):
                root = attached(rest[name][0], 2, chest)
                result[name] = self._leg(name, pose, chest, root)
            elif name.startswith("hind"):
                root = attached(rest[name][0], 0, hips)
                result[name] = self._leg(name, pose, hips, root)
            elif name.startswith("ear"):
                result[name] = self._ear(name, pose, skull, turned)
        return result

    def _head(self, pose, chest, base):
        bones = np.diff(self.rest["head"], axis=0)
        neck = multiply(chest, euler(*pose.neck))
        head = multiply(neck, euler(*pose.head))
        halfway = multiply(neck, posing.part(euler(*pose.head), 0.5))
        joints = [base]
        for bone, turned, stretch in zip(
            bones, (neck, halfway, head), (pose.neck_stretch, pose.neck_stretch, 1.0)
        ):
            joints.append(joints[-1] + stretch * rotate(turned, bone))
        return (np.array(joints), chest, head), joints[2], head

    def _tail(self, pose, hips, base):
        joints, turned = [base], hips
        for bone, (pitch, yaw) in zip(np.diff(self.rest["tail"], axis=0), pose.tail):
            turned = multiply(turned, multiply(about(Z, yaw), about(X, pitch)))
            joints.append(joints[-1] + pose.tail_stretch * rotate(turned, bone))
        return np.array(joints), hips, None

    def _ear(self, name, pose, skull, turned):
        side = 1.0 if name.endswith("L") else -1.0
        back, outwards = pose.ears
        rest = self.rest[name]
        base = skull + rotate(turned, rest[0] - self.rest["head"][2])
        bend = multiply(turned, multiply(about(X, -back), about(Y, side * outwards)))
        middle = base + rotate(
            multiply(turned, posing.part(_between(turned, bend), 0.6)), rest[1] - rest[0]
        )
        return np.array([base, middle, middle + rotate(bend, rest[2] - rest[1])]), turned, None

    def _leg(self, name, pose, parent, blade):
        """A joint fixed to the body, two bones to the ankle, stretched where it is out of reach,
        and the paw.
        """
        rest = self.rest[name]
        *offset, pitch, outwards = pose.feet.get(name, (0, 0, 0, 0, 0))
        root = blade + rotate(parent, rest[1] - rest[0])
        ankle = rest[3] + offset
        upper, lower = np.linalg.norm(rest[2] - rest[1]), np.linalg.norm(rest[3] - rest[2])
        reach = np.linalg.norm(ankle - root)
        scale = max(1.0, reach / (0.985 * (upper + lower)))
        upper, lower = upper * scale, lower * scale
        axis = (ankle - root) / reach
        along = (upper**2 - lower**2 + reach**2) / (2.0 * reach)
        bend = rotate(parent, rest[2] - 0.5 * (rest[1] + rest[3]))
        bend[0] += np.sign(rest[1][0]) * outwards * np.linalg.norm(bend)
        bend -= axis * (bend @ axis)
        bend *= np.sqrt(max(upper**2 - along**2, 0.0)) / np.linalg.norm(bend)
        toe = ankle + rotate(about(X, -pitch), rest[4] - rest[3])
        return np.array([blade, root, root + along * axis + bend, ankle, toe]), parent, None


def _between(a, b):
    """The rotation c with b = a c."""
    return multiply(a * [1.0, -1.0, -1.0, -1.0], b)
