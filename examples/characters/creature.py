# SPDX-License-Identifier: GPL-3.0-or-later
"""A four-legged creature: one closed surface, modelled and posed by this script."""

import numpy as np

from characters import implicit, posing
from characters.character import Character, Handle, Key, Look, ball, disjoint
from characters.quadruped import Pose, Rig

CELL = 0.046  # edge length of the mesh; gives about 7,500 vertices

# Joints at rest: x to its left, y backwards, z up. Right legs mirror the left ones.
SPINE = np.array([[0, 0.6, 0.84], [0, 0.1, 0.8], [0, -0.42, 0.9]])
HEAD = np.array([[0, -0.46, 0.98], [0, -0.68, 1.28], [0, -0.92, 1.52], [0, -1.36, 1.44]])
TAIL = np.array(
    [
        [0, 0.74, 0.92],
        [0, 1.1, 0.92],
        [0, 1.42, 0.84],
        [0, 1.74, 0.82],
        [0, 2.04, 0.92],
        [0, 2.26, 1.14],
    ]
)
FRONT = np.array(
    [
        [0.16, -0.4, 1.0],
        [0.24, -0.44, 0.78],
        [0.31, -0.34, 0.48],
        [0.31, -0.45, 0.17],
        [0.32, -0.6, 0.12],
    ]
)
HIND = np.array(
    [
        [0.16, 0.6, 0.96],
        [0.25, 0.58, 0.76],
        [0.34, 0.42, 0.46],
        [0.32, 0.66, 0.18],
        [0.33, 0.5, 0.12],
    ]
)
EAR = np.array([[0.2, -0.8, 1.74], [0.31, -0.75, 1.96], [0.42, -0.68, 2.14]])
MIRROR = np.array([-1.0, 1.0, 1.0])

REST = {
    "spine": SPINE,
    "head": HEAD,
    "tail": TAIL,
    "front.L": FRONT,
    "front.R": FRONT * MIRROR,
    "hind.L": HIND,
    "hind.R": HIND * MIRROR,
    "ear.L": EAR,
    "ear.R": EAR * MIRROR,
}
RADII = {
    "spine": [0.36, 0.43, 0.36],
    "head": [0.27, 0.21, 0.32, 0.15],
    "tail": [0.26, 0.18, 0.14, 0.12, 0.13, 0.17],
    "front": [0.2, 0.22, 0.15, 0.12, 0.13],
    "hind": [0.22, 0.28, 0.19, 0.115, 0.13],
    "ear": [0.12, 0.145, 0.07],
}
EYE = np.array([0.175, -1.14, 1.68])
EYE_RADIUS = 0.13
PUPIL, PUPIL_RADIUS = EYE + [0.02, -0.13, 0.01], 0.075
NOSE, NOSE_RADIUS = np.array([0.0, -1.58, 1.48]), 0.085


def chain_field(points, chain):
    """Distance to one chain alone."""
    centres, _ = posing.curve(REST[chain], posing.NODES_PER_BONE)
    sizes = RADII[chain.split(".")[0]]
    at = np.linspace(0.0, len(sizes) - 1.0, len(centres))
    if chain.startswith("ear"):
        return _leaf(points, centres, np.interp(at, np.arange(len(sizes)), sizes))
    distance = implicit.sweep(points, centres, np.interp(at, np.arange(len(sizes)), sizes))
    if chain == "head":
        return _with_face(points, distance)
    if chain.startswith(("front", "hind")):
        return _with_toes(points, distance, REST[chain][-1])
    return distance


def _leaf(points, centres, sizes):
    """A sweep of flat ellipsoids: distances grow faster across the ear than along it."""
    flat = np.array([1.0, 1.7, 1.0])
    return implicit.sweep(points * flat, centres * flat, sizes) / 1.3


def _with_face(points, distance):
    cheeks = implicit.ellipsoid(points, np.array([0, -1.0, 1.48]), np.array([0.39, 0.31, 0.31]))
    muzzle = implicit.ellipsoid(points, np.array([0, -1.36, 1.4]), np.array([0.22, 0.2, 0.15]))
    distance = implicit.melt(implicit.melt(distance, cheeks, 0.15), muzzle, 0.15)
    nose = implicit.ellipsoid(points, np.array([0, -1.55, 1.47]), np.array([0.075, 0.055, 0.055]))
    distance = implicit.melt(distance, nose, 0.04)
    folded = np.abs(points) * [1, 0, 0] + points * [0, 1, 1]
    eyes = implicit.ellipsoid(folded, EYE, np.full(3, EYE_RADIUS))
    return implicit.melt(distance, eyes, 0.04)


def _with_toes(points, distance, toe):
    for side in (-0.095, 0.0, 0.095):
        tip = np.array([toe[0] + side, toe[1] - 0.08 + abs(side) * 0.3, 0.09])
        distance = implicit.melt(distance, implicit.ellipsoid(points, tip, np.full(3, 0.08)), 0.04)
    sole = 0.02 - points[:, 2]  # flat feet
    return -implicit.melt(-distance, -sole, 0.04)


def field(points):
    """Distance to the whole creature: body first, then what grows from it."""
    distance = chain_field(points, "spine")
    for chain, fillet in (("head", 0.2), ("tail", 0.2)):
        distance = implicit.melt(distance, chain_field(points, chain), fillet)
    for chain in REST:
        if chain.startswith(("front", "hind", "ear")):
            distance = implicit.melt(distance, chain_field(points, chain), 0.12)
    return distance


def surface():
    positions, quads = implicit.surface_net(field, (-0.75, -1.8, -0.1), (0.75, 2.6, 2.4), CELL)
    positions = implicit.relax(field, positions, quads, 8)
    if not implicit.is_closed_manifold(quads, len(positions)):
        raise RuntimeError("the creature's surface is not a closed manifold")
    for centre, radius in (
        (PUPIL, PUPIL_RADIUS),
        (PUPIL * MIRROR, PUPIL_RADIUS),
        (NOSE, NOSE_RADIUS),
    ):
        positions = implicit.snap_to_circle(field, positions, centre, radius, 0.42 * CELL)
    positions = 0.5 * (positions + mirrored(positions, positions))
    return positions, quads


SPREAD = {"spine": 0.16, "head": 0.1, "tail": 0.12, "front": 0.11, "hind": 0.11, "ear": 0.08}

POSES = {
    "Crouch": Pose(
        hips=(0, -0.06, -0.3),
        chest=(0, 0.02, -0.4),
        belly=(0, 0, -0.02),
        chest_turn=(-4, 0, 0),
        hips_turn=(4, 0, 0),
        neck=(-28, 0, 0),
        head=(24, 0, 0),
        feet={
            "front.L": (0.16, -0.1, 0, 0, 0.8),
            "front.R": (-0.16, -0.1, 0, 0, 0.8),
            "hind.L": (0.16, -0.12, 0, 0, 0.8),
            "hind.R": (-0.16, -0.12, 0, 0, 0.8),
        },
        tail=((-14, 0), (-6, 8), (8, 12), (4, 14), (-6, 12)),
        ears=(-30, 25),
        girth={
            "spine": [1.08, 1.16, 1.1],
            "front": [1, 1, 1.08, 1.05, 1.08],
            "hind": [1, 1, 1.05, 1.05, 1.08],
        },
    ),
    "Leap": Pose(
        hips=(0, 0.22, 0.1),
        chest=(0, -0.3, 0.28),
        hips_turn=(18, 0, 0),
        chest_turn=(14, 0, 0),
        neck=(-22, 0, 0),
        head=(16, 0, 0),
        neck_stretch=1.12,
        feet={
            "front.L": (0.0, -0.86, 0.5, 55, 0),
            "front.R": (0.0, -0.7, 0.36, 50, 0),
            "hind.L": (0.0, 0.72, -0.02, -70, 0),
            "hind.R": (0.0, 0.58, 0.1, -70, 0),
        },
        tail=((6, 0), (2, 0), (-6, 0), (-10, 0), (-14, 0)),
        tail_stretch=1.15,
        ears=(-45, 0),
        girth={"spine": [0.97, 0.95, 1.0]},
    ),
    "Wave": Pose(
        hips=(-0.03, 0.02, -0.02),
        chest=(-0.08, 0.02, 0.06),
        chest_turn=(8, 0, -6),
        neck=(4, 8, 0),
        head=(4, 10, -12),
        feet={"front.L": (0.1, -0.56, 0.66, 62, 0.2)},
        tail=((10, -4), (12, -8), (10, -10), (4, -12), (4, -10)),
        ears=(4, -4),
        girth={"front.L": [1, 1, 1, 1.12, 1.25]},
    ),
    "Curl": Pose(
        hips=(0, 0, 0.06),
        hips_turn=(-8, 0, 0),
        chest=(0, 0, -0.04),
        neck=(-6, -10, 0),
        head=(-4, -14, 6),
        tail=((38, 0), (46, 4), (52, 5), (50, 5), (46, 5)),
        tail_stretch=1.05,
        ears=(8, 6),
        girth={"tail": [1.05, 1.1, 1.1, 1.1, 1.15, 1.25]},
    ),
    "Howl": Pose(
        hips=(0, 0, -0.12),
        hips_turn=(10, 0, 0),
        chest=(0, 0.03, 0.08),
        chest_turn=(14, 0, 0),
        neck=(26, 0, 0),
        head=(38, 0, 0),
        neck_stretch=1.1,
        tail=((-10, 0), (-4, 0), (0, 0), (6, 0), (8, 0)),
        ears=(-30, 5),
        girth={"spine": [1.0, 1.0, 1.16], "head": [1.16, 1.06, 1.0, 1.0]},
    ),
    "Sniff": Pose(
        hips=(0, -0.02, 0.08),
        hips_turn=(-6, 0, 0),
        chest=(0, -0.02, -0.16),
        chest_turn=(-16, 0, 0),
        neck=(-62, 0, 0),
        head=(8, 0, 0),
        neck_stretch=1.15,
        feet={"front.L": (0.05, -0.1, 0, 0, 0.3), "front.R": (-0.05, -0.04, 0, 0, 0.3)},
        tail=((14, 0), (8, 0), (8, 0), (4, 0), (4, 0)),
        ears=(24, 4),
    ),
}


COAT, CREAM, SOCK = (
    np.array([0.86, 0.42, 0.16]),
    np.array([0.97, 0.9, 0.76]),
    np.array([0.3, 0.17, 0.13]),
)
WHITE, BLACK = np.array([0.98, 0.98, 0.96]), np.array([0.03, 0.03, 0.04])


def colours(positions):
    """A fox's coat, from the positions at rest."""
    x, y, z = positions.T

    def step(value, edge, width):
        return np.clip((value - edge) / width + 0.5, 0.0, 1.0)[:, None]

    def ball(centre, radius, width):
        return 1.0 - step(np.linalg.norm(positions - centre, axis=1), radius, width)

    colour = np.broadcast_to(COAT, positions.shape)
    underside = (1.0 - step(z, 0.56, 0.1)) * (1.0 - step(np.abs(x), 0.26, 0.08))
    front = (
        (1.0 - step(np.abs(x), 0.2, 0.08))
        * (1.0 - step(y, -0.62, 0.08))
        * (1.0 - step(z, 1.2, 0.1))
    )
    jaw = (
        (1.0 - step(z - 0.14 * np.abs(x), 1.4, 0.06))
        * (1.0 - step(y, -0.82, 0.1))
        * step(z, 1.1, 0.1)
    )
    tip = step(y + 0.5 * z, 2.62, 0.1)
    for share in (underside, front, jaw, tip):
        colour = colour + share * (CREAM - colour)
    socks = (1.0 - step(z, 0.3, 0.1)) * (1.0 - step(y, 1.0, 0.1))
    ear_tips = step(z, 2.04, 0.08) * (1.0 - step(y, 0.0, 0.1))
    colour = colour + np.maximum(socks, ear_tips) * (SOCK - colour)
    folded = np.stack([np.abs(x), y, z], axis=1)
    positions = folded
    colour = colour + ball(EYE, EYE_RADIUS * 1.03, 0.02) * (WHITE - colour)
    colour = colour + ball(PUPIL, PUPIL_RADIUS + 0.003, 0.004) * (BLACK - colour)
    return colour + ball(NOSE, NOSE_RADIUS + 0.003, 0.004) * (BLACK - colour)


def mirrored(positions, shape):
    """The mirror image of a shape of a mesh that is its own mirror image."""
    squared = np.sum(positions**2, axis=1)
    twin = [np.argmin(squared - 2.0 * positions @ image) for image in positions * MIRROR]
    return shape[twin] * MIRROR


def exemplars(positions, quads):
    """The Basis and its poses, by name. The wave of the other paw is the mirror image, to the
    vertex.
    """
    rig = Rig(REST, SPREAD)
    distances = {chain: chain_field(positions, chain) for chain in REST}
    weights = rig.weights(positions, distances, implicit.edges_of(quads))
    shapes = {"Basis": positions}
    for name, pose in POSES.items():
        shapes[name] = rig.carry(positions, weights, pose)
        if name == "Wave":
            shapes["Wave R"] = mirrored(positions, shapes[name])
    return shapes


TITLE = "A creature and what its seven exemplars make of a few dragged handles"
LOOK = Look(heading=-48.0, height=14.0, centre=(0.0, 0.28, 1.01), width=4.4, aspect=1.32)
KEYS = [
    Key(1, "Basis"),
    Key(7, "Crouch"),
    Key(13, "Leap"),
    Key(20, "Basis"),
    Key(27, "Wave"),
    Key(33, "Wave", others={"tail": ("Curl", 1.0)}, note="Wave + Curl"),
    Key(41, "Sniff"),
    Key(49, "Howl"),
    Key(53, "Howl", 1.2, note="Howl, beyond"),
    Key(60, "Basis"),
]
STRIP = (1, 4, 7, 10, 13, 17, 20, 24, 27, 30, 33, 37, 41, 45, 49, 53)


def handles(positions):
    """Paws, head, hips, chest and the tail's tip follow their empties; the rest is free."""
    x, y, z = positions.T
    low = z < 0.34
    result = [
        Handle("head", "ORIENTED", ball(positions, HEAD[2], 0.4, (z > 1.3) & (y < -0.7))),
        Handle("hips", "PINNED", ball(positions, (0, 0.58, 1.2), 0.2)),
        Handle("chest", "PINNED", ball(positions, (0, -0.36, 1.24), 0.2)),
        Handle("tail.tip", "PINNED", ball(positions, TAIL[-1], 0.22)),
    ]
    for side, sign in (("L", x > 0), ("R", x < 0)):
        front, hind = (REST[f"{leg}.{side}"] for leg in ("front", "hind"))
        result += [
            Handle(f"front.{side}", "PINNED", ball(positions, front[-1], 0.26, low & sign)),
            Handle(f"hind.{side}", "PINNED", ball(positions, hind[-1], 0.24, low & sign)),
            Handle(f"elbow.{side}", "FREE", ball(positions, front[2], 0.19, sign)),
            Handle(f"knee.{side}", "FREE", ball(positions, hind[2], 0.23, sign)),
        ]
    result += [
        Handle("tail.root", "FREE", ball(positions, TAIL[1], 0.22)),
        Handle("tail.middle", "FREE", ball(positions, TAIL[3], 0.18)),
        Handle("belly", "FREE", ball(positions, (0, 0.1, 0.4), 0.18)),
    ]
    return disjoint(result)


def build():
    positions, quads = surface()
    return Character(
        name="creature",
        faces=quads,
        shapes=exemplars(positions, quads),
        colours=colours(positions),
        handles=handles(positions),
        keys=KEYS,
        rotations=True,
        title=TITLE,
        strip=STRIP,
        look=LOOK,
    )
